"""A plain ray caster that shares no code with the renderer's shadows: what lies on a segment from a point.

Triangles by Moeller and Trumbore (1997), ellipsoids by the quadratic in their unit sphere's space. What is no blocker
is said before any ray is cast, not by an epsilon along it: triangles in whose plane the point lies, to the rounding of
the coordinates, and for a light's samples those that lie in the light's plane. Planes are told from points in extended
precision, since a needle's normal is only as good as its width.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.lights import Light, QuadLight
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats, column, cross, dot, frame, unit

FLAT = 128 * 2.0**-53
"""Height over a plane, relative to the coordinates, that counts as none."""
PAIRS = 1 << 19
"""Ray-triangle pairs at once."""


def coplanar(geometry: Geometry, p: Floats) -> Any:
    """Whether each point (3, n) lies in each triangle's plane, (n, t)."""
    a, b, c = (v.astype(np.longdouble) for v in (geometry.a, geometry.b, geometry.c))
    normal = unit(cross(b - a, c - a))
    size = max(float(np.abs(v).max(initial=0)) for v in (p, geometry.a, geometry.b, geometry.c))
    height = dot(normal[:, None], p.astype(np.longdouble)[:, :, None] - a[:, None])
    return np.abs(height) <= FLAT * size


def in_plane(geometry: Geometry, light: QuadLight) -> Any:
    """Which triangles lie in the light's plane, its own two among them; (t,)."""
    normal = unit(cross(*(column(v).astype(np.longdouble) for v in (light.ab, light.ac))))
    corner = column(light.corner).astype(np.longdouble)
    parts = (geometry.a, geometry.b, geometry.c)
    size = max(float(np.abs(v).max(initial=0)) for v in (corner, *parts))
    flat = [np.abs(dot(normal, v.astype(np.longdouble) - corner)) <= FLAT * size for v in parts]
    return flat[0] & flat[1] & flat[2]


def _triangles_hide(geometry: Geometry, p: Floats, q: Floats, skip: Any) -> Any:
    """Segments from p (3, n) to q (3, n, k); ``skip`` (n, t): (n, k)."""
    a, e1, e2 = geometry.a, geometry.b - geometry.a, geometry.c - geometry.a
    d = (q - p[:, :, None])[:, :, :, None]
    s = (p[:, :, None] - a[:, None])[:, :, None]  # (3, n, 1, t)
    e1, e2 = e1[:, None, None], e2[:, None, None]
    h, r = cross(d, np.broadcast_to(e2, np.broadcast_shapes(d.shape, e2.shape))), cross(s, np.broadcast_to(e1, s.shape))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        scale = 1 / dot(e1, h)
        u, v, t = dot(s, h) * scale, dot(d, r) * scale, dot(e2, r) * scale
        inside = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t < 1)
    return (inside & ~skip[:, None]).any(axis=2)


def _ellipsoid_hides(geometry: Geometry, index: int, points: ShadingPoints, p: Floats, q: Floats) -> Any:
    """(n, k). A point on the body sees it only from within, and then its far side."""
    center, axes = geometry.center[:, [index]], geometry.axes[index]
    o = np.linalg.solve(axes, p - center)
    d = np.linalg.solve(axes, (q - p[:, :, None]).reshape(3, -1)).reshape(q.shape)
    least = np.linalg.svd(axes, compute_uv=False)[-1]
    rounding = FLAT * float(max(np.abs(p).max(), np.abs(center).max())) / least
    off = dot(o, o) - 1
    on = (points.ellipsoid == index) | (np.abs(off) <= 4 * rounding)
    within = dot(np.linalg.solve(axes.T, o), points.normal) < 0
    length2, along = np.maximum(dot(d, d), 1e-300), dot(o[:, :, None], d)
    far = -2 * along / length2
    from_on = within[:, None] & (far > 0) & (far < 1)
    rest = along**2 - length2 * off[:, None]
    root = np.sqrt(np.maximum(rest, 0))
    near, far = (-along - root) / length2, (-along + root) / length2
    crossed = (rest > 0) & (((near > 0) & (near < 1)) | ((far > 0) & (far < 1)))
    return np.where(on[:, None], from_on, crossed)


def hidden(geometry: Geometry, points: ShadingPoints, q: Floats, skip: Any, start: Floats | None = None) -> Any:
    """Whether something lies between each point and its ends q (3, n, k); (n, k).

    Parameters
    ----------
    skip : (n, t) bool
        Triangles that block nothing.
    start : (3, n) float64, optional
        Where segments start, if not at the points.
    """
    p = points.position if start is None else start
    found = np.zeros(q.shape[1:], dtype=bool)
    step = max(1, PAIRS // max(1, p.shape[1] * max(1, geometry.triangles)))
    for first in range(0, q.shape[2], step):
        some = slice(first, first + step)
        if geometry.triangles:
            found[:, some] = _triangles_hide(geometry, p, q[:, :, some], skip)
        for index in range(geometry.ellipsoids):
            found[:, some] |= _ellipsoid_hides(geometry, index, points, p, q[:, :, some])
    return found


def reach(geometry: Geometry, points: ShadingPoints) -> float:
    """Longer than anything in the scene."""
    bodies = np.abs(geometry.center).max(initial=0) + np.abs(geometry.axes).sum(axis=(1, 2), initial=0).max(initial=0)
    triangles = max(np.abs(v).max(initial=0) for v in (geometry.a, geometry.b, geometry.c))
    return float(4 * (np.abs(points.position).max(initial=0) + bodies + triangles))


def end_of(geometry: Geometry, points: ShadingPoints, light: Light) -> Floats:
    """Where the segments to a light without extent end, (3, n)."""
    place, _ = light.middle()
    if light.at_infinity:
        return points.position + place * reach(geometry, points)
    return np.broadcast_to(place, points.position.shape)


def unanimous(geometry: Geometry, points: ShadingPoints, lights: tuple[Light, ...], blur: Floats) -> Any:
    """Whether no light without extent is seen past an edge so closely that a step of ``blur`` (n,) decides; (n,)."""
    alike = np.ones(points.count, dtype=bool)
    sharp = [light for light in lights if not light.has_extent]
    if not sharp:
        return alike
    skip = coplanar(geometry, points.position)
    tangents = frame(points.normal)
    for light in sharp:
        end = end_of(geometry, points, light)
        ends = np.stack([end, *(end + sign * blur * v for v in np.eye(3)[:, :, None] for sign in (1, -1))], axis=2)
        first = hidden(geometry, points, ends, skip)
        alike &= (first == first[:, :1]).all(axis=1)
        for tangent in tangents:
            for sign in (1, -1):
                start = points.position + sign * blur * tangent
                alike &= (hidden(geometry, points, end[:, :, None], skip, start) == first[:, :1]).all(axis=1)
    return alike
