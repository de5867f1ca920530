"""What the closed forms say of cases: value, bound and form, and how far the inputs' last digits reach."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from nusselt.experiments.studies.stability.cases import INPUTS, Case, stacked
from nusselt.renderer.closed_forms.irradiance import irradiance, irradiance_form
from nusselt.renderer.closed_forms.phong_lobe import phong_lobe, phong_lobe_form
from nusselt.renderer.vectors import Floats

STEP = 2.0**-30
"""Relative change of an input, by which a condition is estimated."""


def evaluate(cases: Sequence[Case], dtype: Any) -> tuple[Floats, Floats, list[str]]:
    """Values, relative error bounds and forms of cases of one kind, each (n,)."""
    x, n, p, e1, e2, w = (stacked(cases, name) for name in INPUTS)
    if cases[0].kind == "E":
        return *irradiance(x, n, p, e1, e2, dtype), irradiance_form(x, n, p, e1, e2, dtype)
    s = np.array([case.s for case in cases])
    return *phong_lobe(x, n, w, s, p, e1, e2, dtype), phong_lobe_form(x, n, w, s, p, e1, e2, dtype)


def conditions(cases: Sequence[Case]) -> list[float | None]:
    """Relative condition numbers, sum |dI/dx x|/I: the file's, or else estimated by central differences.

    An estimate is no better than a factor of two next to a horizon, and None where the value is zero.
    """
    moved: list[Case] = []
    for case in cases:
        for name in INPUTS:
            given = getattr(case, name)
            for k in range(3):
                for sign in (1, -1):
                    other = list(given)
                    other[k] *= 1 + sign * STEP
                    one: dict[str, Any] = {name: tuple(other)}
                    moved.append(replace(case, **one))
    values, _, _ = evaluate(moved, np.float64)
    pairs = values.reshape(len(cases), 3 * len(INPUTS), 2)
    change = np.abs(pairs[..., 0] - pairs[..., 1]).sum(axis=1) / (2 * STEP)
    found: list[float | None] = []
    for case, moves in zip(cases, change, strict=True):
        own = float(case.oracle)
        found.append(case.condition if case.condition is not None else float(moves / own) if own > 1e-300 else None)
    return found
