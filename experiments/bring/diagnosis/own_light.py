"""Shadow rays that stop at the light and test it too: float32 rounding decides whether they hit it.

Where such a ray ends on the light's own plane its parameter comes out as 1 give or take an ulp, and about half of
the rays are lost: which half depends on the scene's coordinates, not on chance.
"""

from __future__ import annotations

import numpy as np

from renderer.scene import Light, QuadLight
from renderer.shading import ShadingPoints
from renderer.vectors import Floats


def reaches_in_single_precision(light: Light, points: ShadingPoints, d: Floats) -> Floats:
    """(n, k): 0 where a ray of float32 length |d| finds the light's own plane before its end."""
    if not isinstance(light, QuadLight):
        return np.ones(d.shape[1:])
    origin = points.position.astype(np.float32)[:, :, None]
    end = (points.position[:, :, None] + d).astype(np.float32)
    ray = end - origin
    length = np.sqrt((ray * ray).sum(axis=0))
    ray = ray / length
    normal = np.asarray(light.normal, dtype=np.float32)[:, None, None]
    corner = np.asarray(light.corner, dtype=np.float32)[:, None, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = ((corner - origin) * normal).sum(axis=0) / (ray * normal).sum(axis=0)
    return (~(t < length)).astype(np.float64)
