"""Flat disks: what cameras see of them, and what shadow rays meet. Only bodies of lights are any.

A ray meets a disk where it meets its plane, within the radius. Planes are told apart by the same bounds of rounding as
those of triangles (`segments`, `first_hits.nearer_disks`): what lies in a disk's plane is not hidden by it. The rim
is exact to rounding, and borders on nothing.
"""

from __future__ import annotations

import numpy as np

from nusselt.renderer.vectors import Bools, Floats, dot, frame
from nusselt.renderer.watertight import PLANE_ULPS, SLOPE_ULPS, largest, one_norm

from .arrays import Geometry
from .ragged import take


def disk_hides(g: Geometry, index: int, p: Floats, d: Floats, at_infinity: bool) -> Bools:
    """Whether a disk stands between points (3, n) and the ends of d (3, n, k), or along rays: (n, k)."""
    normal, center = g.disk_normal[:, [index]], g.disk_center[:, [index]]
    height = dot(normal, center - p)[:, None]
    bound = (PLANE_ULPS * one_norm(normal) * (largest(center) + largest(p)))[:, None]
    fall = dot(normal[:, :, None], d)
    rise = np.sign(height) * fall  # > 0: towards the plane
    if at_infinity:
        through = rise > SLOPE_ULPS * one_norm(normal) * one_norm(d)
    else:
        # The far end lies beyond the plane by more than its own rounding.
        through = rise > np.abs(height) + bound + PLANE_ULPS * one_norm(normal) * one_norm(d)
    through &= np.abs(height) > bound
    point, way = np.nonzero(through)
    through[point, way] = within_disk(g, index, take(p, point), d[:, point, way])
    return through


def within_disk(g: Geometry, index: int, p: Floats, d: Floats) -> Bools:
    """Whether lines from points (3, n) or (3, 1) along d (3, n) meet a disk's plane within its radius."""
    x, y = disk_place(g, index, p, d)
    return np.asarray(x * x + y * y <= g.disk_radius[index] ** 2)


def disk_place(g: Geometry, index: int, p: Floats, d: Floats) -> Floats:
    """Where lines from p (3, n) or (3, 1) along d (3, n) meet a disk's plane: (2, n) from its centre, along `frame`."""
    normal, v = g.disk_normal[:, [index]], g.disk_center[:, [index]] - p
    along = dot(normal, v) / dot(normal, d)
    return np.stack([along * dot(axis, d) - dot(axis, v) for axis in frame(normal)])


def disk_hull(g: Geometry, index: int) -> Floats:
    """Corners (3, 4) of a square around a disk."""
    x, y = (axis * g.disk_radius[index] for axis in frame(g.disk_normal[:, [index]]))
    return np.hstack([g.disk_center[:, [index]] + sx * x + sy * y for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))])


def disk_rim(g: Geometry, index: int, angle: Floats, swell: float = 1.0) -> Floats:
    """Points (3, m) at angles (m,) of a circle of ``swell`` times a disk's radius."""
    x, y = (axis * (swell * g.disk_radius[index]) for axis in frame(g.disk_normal[:, [index]]))
    return g.disk_center[:, [index]] + np.cos(angle) * x + np.sin(angle) * y
