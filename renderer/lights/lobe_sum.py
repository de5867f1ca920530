"""What a patch of light reflects where nothing is in the way: its lobes' shares, and a bound, summed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.lobes import Lobe
from nusselt.renderer.lobes.protocol import Contour
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Bools, Floats, Ints

Share = Callable[[type[Lobe], Ints], tuple[Floats, Floats]]
"""A lobe's integral over the light at points (k,), and its absolute bound, for an albedo of 1."""


def lobe_sum(points: ShadingPoints, reached: Bools, glossy: bool, share: Share) -> tuple[Floats, Floats]:
    """Reflected radiance (3, n) of the points that are ``reached`` (n,), and a bound (n,) of its relative error.

    What is below 1e-280 is nothing; where all of a value has cancelled, its bound is 1.
    """
    out, error = np.zeros_like(points.position), np.zeros_like(points.position)
    for lobe in points.reflecting(glossy):
        albedo = points.albedo(lobe)
        k = np.flatnonzero(reached & (albedo > 0).any(axis=0))
        if k.size:
            value, bound = share(lobe, k)
            out[:, k] += albedo[:, k] * value
            error[:, k] += albedo[:, k] * bound
    lost = np.where(error > 1e-280, 1.0, 0.0)
    return out, np.divide(error, out, out=lost, where=out > 1e-280).max(axis=0)


def contour_of(lobe: type[Lobe], kind: str) -> Contour:
    """A lobe's boundary integrals; an InputError naming the ``kind`` of light if it has none."""
    if lobe.contour is None:
        raise InputError(lobe.title, f"over a {kind}", "a lobe with boundary integrals, or an estimator that samples")
    return lobe.contour
