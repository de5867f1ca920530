"""The light that shading points reflect: the sum of their lobes."""

from __future__ import annotations

import numpy as np

from .lobes.protocol import ShadingPoints
from .vectors import Floats, dot

__all__ = ["ShadingPoints", "reflect"]


def reflect(points: ShadingPoints, d: Floats, weight: Floats, glossy: bool) -> Floats:
    """sum_k f(w_k, w_o) max(n.w_k, 0) weight_k: the reflected radiance of a set of beams.

    Parameters
    ----------
    d : (3, n, k) float64
        Towards each light point, any length.
    weight : (n, k) float64
        Radiance times solid angle of each beam, without the surface's cosine.
    glossy : bool
        Whether other lobes than Lambert's are to be evaluated.

    Returns
    -------
    (3, n) float64
    """
    length = np.sqrt(dot(d, d))
    arriving = weight * np.maximum(dot(points.normal[:, :, None], d), 0) / length
    shares = [points.albedo(kind) * kind.over_beams(points, arriving, d, length) for kind in points.reflecting(glossy)]
    out = shares[0] if shares else np.zeros(points.position.shape)
    for share in shares[1:]:
        out += share
    return out
