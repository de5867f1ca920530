"""Nusselt's analog: a polygon on the hemisphere, then on the disk below it; its area there is the irradiance.

W. Nusselt 1928. Independent of Lambert's formula: no angle of an edge is taken. The outline on the disk is
q(t) = p_xy / |p| as p runs along an edge, an arc of an ellipse, and its area is Green's 1/2 of q x dq, integrated
numerically: q x q' = (a x b)_z / |p(t)|^2 between corners a and b. Right to 1e-13 of the disk.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.renderer.vectors import Floats, column, dot, frame, unit

NODES = 24
DOUBLINGS = 60


@dataclass(frozen=True)
class Analog:
    """The outline of a polygon, seen from a point, in three places.

    Parameters
    ----------
    polygon, sphere : (3, k) float64
        The part above the horizon, in the frame whose z is the normal; and pushed onto the unit hemisphere.
    disk : (2, k) float64
        Dropped onto the unit disk.
    """

    polygon: Floats
    sphere: Floats
    disk: Floats


def above_horizon(point: Floats, normal: Floats, corners: Floats) -> Floats:
    """The visible corners (3, m) in the point's frame (x, y, normal), counter-clockwise or not as given.

    Parameters
    ----------
    point, normal : (3,) float64
    corners : (3, k) float64
        Of a convex polygon, in order.
    """
    n = unit(column(normal))
    x, y = frame(n)
    v = corners - column(point)
    v = np.stack([dot(axis, v) for axis in (x, y, n)])
    kept = []
    for k in range(v.shape[1]):
        a, b = v[:, k], v[:, (k + 1) % v.shape[1]]
        if a[2] >= 0:  # a corner on the horizon is kept
            kept.append(a)
        if (a[2] >= 0) != (b[2] >= 0):
            crossing = a + (b - a) * (a[2] / (a[2] - b[2]))
            kept.append(np.array([crossing[0], crossing[1], 0.0]))
    return np.stack(kept, axis=1) if len(kept) > 2 else np.zeros((3, 0))


def disk_area(point: Floats, normal: Floats, corners: Floats) -> float:
    """Area of the projected polygon on the unit disk: the irradiance it gives for unit radiance.

    Parameters
    ----------
    point, normal : (3,) float64
        The normal may have any length but 0.
    corners : (3, k) float64
        Of a convex polygon, in order; both its sides count.

    Returns
    -------
    float
        0 to pi. The error is below 1e-13 unless the point lies on the polygon's outline.
    """
    v = above_horizon(point, normal, corners)
    total = 0.0
    for k in range(v.shape[1]):
        total += _arc_area(v[:, k], v[:, (k + 1) % v.shape[1]])
    return abs(total)


def _arc_area(a: Floats, b: Floats) -> float:
    """1/2 of q x dq along one edge: panels as wide as the distance to where the edge passes nearest."""
    edge = b - a
    length2 = float(edge @ edge)
    lever = float(a[0] * b[1] - a[1] * b[0])
    if length2 == 0 or lever == 0:
        return 0.0
    nearest = float(-(a @ edge) / length2)
    width = float(np.linalg.norm(np.cross(a, edge))) / length2  # of the distance, in units of the edge
    steps = width * 2.0 ** np.arange(-1, DOUBLINGS)
    cuts = np.concatenate((nearest - steps[::-1], [nearest], nearest + steps))
    cuts = np.unique(np.concatenate(([0.0], np.clip(cuts, 0, 1), [1.0])))
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    half = np.diff(cuts)[:, None] / 2
    t = cuts[:-1, None] + half * (1 + nodes)
    p = a[:, None, None] + edge[:, None, None] * t
    return lever / 2 * float((weights * half / dot(p, p)).sum())


def analog(point: Floats, normal: Floats, corners: Floats, steps: int = 64) -> Analog:
    """The outlines, for drawing: ``steps`` points an edge."""
    v = above_horizon(point, normal, corners)
    following = np.roll(v, -1, axis=1)
    t = np.arange(steps) / steps
    polygon = (v[:, :, None] + (following - v)[:, :, None] * t).reshape(3, -1)
    sphere = unit(polygon)
    return Analog(polygon, sphere, sphere[:2])
