"""What Mitsuba makes of a point and a light as they are given, outside its valid range too."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from nusselt.renderer.vectors import Floats

from .llvm import backend
from .process import ReferenceUnavailable
from .reference import ask
from .temporary import temporary_folder

SAMPLES = 1 << 14
"""Samples in each of eight passes; a square number, so that they fill a square grid."""


def irradiance_by_mitsuba(cases: Sequence[dict[str, Any]], seed: int, timeout: float = 300.0) -> tuple[Floats, Floats]:
    """Mean irradiance and its standard error (n,), NaN where Mitsuba has no answer.

    Parameters
    ----------
    cases : sequence of dict
        ``x``, ``n``, ``P``, ``e1``, ``e2``: lists of three floats.
    seed : int
    timeout : float
        Seconds for all.

    Raises
    ------
    ReferenceUnavailable
        If Mitsuba's LLVM variant cannot run here.
    """
    running = backend()
    if not running.variant.startswith("llvm"):
        raise ReferenceUnavailable(f"cases are put to Mitsuba's LLVM variant alone: {running.sentence}")
    with temporary_folder() as name:
        job = {"task": "patches", "cases": list(cases), "seed": seed, "samples": SAMPLES}
        arrays, _ = ask(job, Path(name), running, timeout)
    return arrays["mean"], arrays["standard_error"]
