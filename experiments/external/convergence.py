"""How a renderer's error falls with samples and with time."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from nusselt.experiments.images.transfer import Quantiser
from nusselt.experiments.results.work_precision import slope
from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.image import Image
from nusselt.renderer.vectors import Floats

from .program import Run

GROWS = 2.0
"""Times the shortest time, from which a slope over it says something."""


def error_row(runs: list[Run], decode: Callable[[Run], Floats], seen: Image, truth: Reference) -> dict[str, Any]:
    """RMS of one image at one number of samples, the truth's noise taken out, and every wall time."""
    judged = seen.shaded & ~seen.unjudged
    squares = []
    for run in runs:
        step = (decode(run) - truth.mean).mean(axis=0)[judged]
        square = (step * step - truth.pixel_standard_error[judged] ** 2)[np.isfinite(step)]
        squares.append(float(square.mean()) if square.size else math.nan if step.size else 0.0)
    mean = float(np.abs(truth.mean).mean(axis=0)[judged].mean()) if judged.any() else 1.0
    rms = math.sqrt(max(float(np.mean(squares)), 0.0))
    return {
        "samples": runs[0].samples,
        "rms": rms,
        "rms_relative": rms / (mean or 1.0),
        "seconds": [run.seconds for run in runs],
    }


def fall(rows: list[dict[str, Any]], against: str) -> float | None:
    """Slope of log RMS over log samples or seconds; None where there are too few points or no error."""
    points = [(row[against], row["rms"]) for row in rows if row["rms"] > 0 and row[against] > 0]
    return slope(*zip(*points, strict=True))[0] if len({x for x, _ in points}) > 1 else None


def convergence(by_samples: list[list[Run]], quantiser: Quantiser, seen: Image, truth: Reference) -> dict[str, Any]:
    """The rows of error against samples and time, the first run of each kept apart, and their slopes."""
    rows = [error_row(runs, lambda run: quantiser.decode(run.raw), seen, truth) for runs in by_samples]
    for row in rows:
        later = row["seconds"][1:] or row["seconds"]
        row["seconds_first"], row["seconds_median"] = row["seconds"][0], float(np.median(later))
    times = [row["seconds_median"] for row in rows]
    started = max(times) < GROWS * min(times)  # it starts longer than it renders: its time tells nothing of samples
    return {
        "rows": rows,
        "slope_samples": fall(rows, "samples"),
        "slope_seconds": None if started else fall(rows, "seconds_median"),
    }
