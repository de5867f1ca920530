"""What a parallelogram reflects where nothing is in the way, in closed form: the sum of the surface's lobes.

Reflected radiance = L sum albedo P, P a lobe's integral over the light's polygon (`Lobe.patch`).
"""

from __future__ import annotations

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats

from .facing import faced_by


def quad_patch(points: ShadingPoints, corner: Floats, ab: Floats, ac: Floats, glossy: bool) -> tuple[Floats, Floats]:
    """Light of the parallelogram corner + u ab + v ac, one-sided, of unit radiance.

    Parameters
    ----------
    corner, ab, ac : (3, 1) or (3, n) float64
        Emits on the side of -(ab x ac).

    Returns
    -------
    radiance : (3, n) float64
        Reflected.
    bound : (n,) float64
        Of its relative error; what is below 1e-280 is nothing.

    Raises
    ------
    InputError
        If a lobe has no closed form.
    """
    facing = faced_by(corner, ab, ac, points.position)
    out, error = np.zeros_like(points.position), np.zeros_like(points.position)
    for kind in points.reflecting(glossy):
        albedo = points.albedo(kind)
        k = np.flatnonzero(facing & (albedo > 0).any(axis=0))
        if not k.size:
            continue
        if kind.patch is None:
            raise InputError(
                kind.title, "over a parallelogram", "a lobe with a closed form, or an estimator that samples"
            )
        value, bound = kind.patch(points, k, corner, ab, ac)
        share = albedo[:, k] * value
        out[:, k] += share
        error[:, k] += share * bound
    return out, np.divide(error, out, out=np.zeros_like(out), where=out > 1e-280).max(axis=0)
