"""The textbook's closed form, as a lecture writes it down: the competitor.

Phi = 1/2 sum Theta_i Gamma_i, Theta_i = acos of the cosine between two corners, Gamma_i their normalised cross
product (Baum 1989, Arvo 1994), over the polygon clipped at the horizon; no care is taken of anything.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from nusselt.experiments.studies.stability.cases import Case


def _clipped(corners: list[Any], n: Any) -> list[Any]:
    """Sutherland & Hodgman against the horizon."""
    out = []
    for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
        za, zb = n @ a, n @ b
        if za >= 0:
            out.append(a)
        if (za >= 0) != (zb >= 0):
            out.append(a + (b - a) * (za / (za - zb)))
    return out


def textbook_irradiance(case: Case, dtype: Any) -> float:
    """Irradiance in working precision; NaN where the formula divides zero by zero."""
    x, n, p, e1, e2 = (np.array(getattr(case, name), dtype=dtype) for name in ("x", "n", "P", "e1", "e2"))
    with np.errstate(all="ignore"):
        n = n / np.sqrt(n @ n)
        polygon = _clipped([v - x for v in (p, p + e1, p + e1 + e2, p + e2)], n)
        total = np.zeros(3, dtype=dtype)
        for a, b in zip(polygon, polygon[1:] + polygon[:1], strict=True):
            normal = np.cross(a, b)
            theta = np.arccos((a @ b) / (np.sqrt(a @ a) * np.sqrt(b @ b)))
            total = total + theta * normal / np.sqrt(normal @ normal)
        return float(abs(total @ n) / 2)


def textbook_values(cases: Sequence[Case], dtype: Any) -> list[float | None]:
    """The textbook's irradiances; None for a lobe, whose textbook form takes whole exponents alone."""
    return [textbook_irradiance(case, dtype) if case.kind == "E" else None for case in cases]
