"""What the camera sees: the nearest surface along rays that share one origin.

With a common origin o, the edge function of a triangle's edge (p, q) along direction d is d . (p-o) x (q-o):
linear in d (Olano & Greer 1997), and for two triangles that share the edge exactly the negative of the
other's, so that no ray slips between them (the watertight test of Woop, Benthin & Wald 2013, without its
shear, which only pays where origins differ). In a tile of an image d is affine in the pixel, so the signs at
the tile's four corners tell which triangles it can see at all.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .geometry import Geometry, Ints
from .vectors import Floats, cross, dot, transform, unit

BLOCK = 1 << 18
"""Triangle-ray pairs handled at once: bounds the memory, and fits the cache."""


@dataclass(frozen=True)
class Hits:
    """The nearest hits of n rays.

    Parameters
    ----------
    surface : (n,) int64
        Row of the surface tables, -1 where nothing was hit.
    position : (3, n) float64
        On the surface to a few ulps of its own coordinates, however far the camera is.
    normal : (3, n) float64
        Unit geometric normal of the front side.
    distance : (n,) float64
        Ray parameter, in lengths of the direction given; inf where nothing was hit.
    ellipsoid : (n,) int64
        Index of the ellipsoid hit, -1 for triangles and misses.
    """

    surface: Ints
    position: Floats
    normal: Floats
    distance: Floats
    ellipsoid: Ints


def _edges(geometry: Geometry, origin: Floats) -> tuple[Floats, Floats]:
    """Edge functions (3 edges, 3, t) opposite to corners a, b, c, and volumes (t,), about ``origin``."""
    a, b, c = geometry.a - origin, geometry.b - origin, geometry.c - origin
    return np.stack((cross(b, c), cross(c, a), cross(a, b))), dot(a, geometry.normal)


def _visible_in_tile(edges: Floats, corners: Floats) -> NDArray[Any]:
    """Which triangles can be hit by directions in the cone of four corner directions (3, 4)."""
    value = np.stack([dot(edge[:, :, None], corners[:, None, :]) for edge in edges])  # (3, t, 4)
    # Two roundings of a triple product apart from the exact sign: keep what is that close.
    slack = 1e-14 * np.abs(value).max(axis=2)
    high, low = value.max(axis=2) + slack, value.min(axis=2) - slack
    return np.flatnonzero((high >= 0).all(axis=0) | (low <= 0).all(axis=0))


def _nearest_triangle(
    edges: Floats, normal: Floats, volume: Floats, d: Floats, chosen: Ints
) -> tuple[Floats, Ints, Floats]:
    """Nearest of the chosen triangles along each direction: distance (n,), triangle, weights (3, n)."""
    n = d.shape[1]
    best = np.full(n, np.inf)
    which = np.full(n, -1)
    weight = np.zeros((3, n))
    rays = np.arange(n)
    step = max(1, BLOCK // max(n, 1))
    for start in range(0, chosen.size, step):
        block = chosen[start : start + step]
        w = np.stack([dot(edge[:, block, None], d[:, None, :]) for edge in edges])  # (3, block, n)
        inside = (w >= 0).all(axis=0) | (w <= 0).all(axis=0)
        slope = dot(normal[:, block, None], d[:, None, :])
        height = np.broadcast_to(volume[block, None], slope.shape)
        ahead = inside & (slope * height > 0)
        t = np.full(slope.shape, np.inf)
        np.divide(height, slope, out=t, where=ahead)
        nearest = t.argmin(axis=0)
        t_nearest = t[nearest, rays]
        better = t_nearest < best
        best[better] = t_nearest[better]
        which[better] = block[nearest[better]]
        weight[:, better] = w[:, nearest[better], rays[better]]
    return best, which, weight


def _ellipsoid_distance(o: Floats, d: Floats) -> Floats:
    """First positive crossing of the unit sphere from o (3, 1) along d (3, n); inf where there is none.

    The discriminant is taken from the closest approach, 1 - |o - (o.d)d|^2, which keeps its digits for
    spheres far away (Haines et al. 2019); the nearer root avoids the difference of two close numbers.
    """
    length2 = dot(d, d)
    b = dot(np.broadcast_to(o, d.shape), d)
    closest = o - d * (b / length2)
    discriminant = length2 * (1 - dot(closest, closest))
    c = dot(o, o) - 1
    root = np.sqrt(np.maximum(discriminant, 0))
    q = -(b + np.copysign(root, b))
    with np.errstate(divide="ignore", invalid="ignore"):
        t0, t1 = q / length2, c / q
    near, far = np.minimum(t0, t1), np.maximum(t0, t1)
    t = np.where(near > 0, near, far)
    return np.where((discriminant >= 0) & (t > 0), t, np.inf)


def first_hits(geometry: Geometry, origin: Floats, d: Floats, corners: Floats | None = None) -> Hits:
    """Nearest hit of each ray.

    Parameters
    ----------
    origin : (3, 1) float64
        Common origin.
    d : (3, n) float64
        Directions, of any length.
    corners : (3, 4) float64, optional
        Directions whose cone holds all of ``d``: triangles outside it are left out.
    """
    edges, volume = _edges(geometry, origin)
    chosen = np.arange(geometry.triangles) if corners is None else _visible_in_tile(edges, corners)
    distance, triangle, weight = _nearest_triangle(edges, geometry.normal, volume, d, chosen)
    n = d.shape[1]
    ellipsoid = np.full(n, -1)
    for index in range(geometry.ellipsoids):
        inverse = geometry.inverse[index]
        t = _ellipsoid_distance(
            transform(inverse, origin - geometry.center[:, [index]]), transform(inverse, d)
        )
        nearer = t < distance
        distance = np.where(nearer, t, distance)
        ellipsoid[nearer] = index
    position, normal = np.zeros((3, n)), np.zeros((3, n))
    surface = np.full(n, -1)
    on_triangle = np.flatnonzero((ellipsoid < 0) & (triangle >= 0))
    if on_triangle.size:
        k = triangle[on_triangle]
        # From the corners, not from origin + t d: off the plane by ulps of the corners alone.
        w = weight[:, on_triangle] / weight[:, on_triangle].sum(axis=0)
        position[:, on_triangle] = w[0] * geometry.a[:, k] + w[1] * geometry.b[:, k] + w[2] * geometry.c[:, k]
        normal[:, on_triangle] = unit(geometry.normal[:, k])
        surface[on_triangle] = geometry.triangle_surface[k]
    for index in range(geometry.ellipsoids):
        mine = np.flatnonzero(ellipsoid == index)
        inverse, center = geometry.inverse[index], geometry.center[:, [index]]
        local = unit(transform(inverse, origin - center) + transform(inverse, d[:, mine]) * distance[mine])
        position[:, mine] = center + transform(geometry.axes[index], local)
        normal[:, mine] = unit(transform(inverse.T, local))
        surface[mine] = geometry.ellipsoid_surface[index]
    return Hits(surface, position, normal, distance, ellipsoid)
