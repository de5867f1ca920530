"""What the camera sees: the nearest surface along rays that share one origin.

With a common origin the edge functions of a triangle (see `watertight`) are the same for all rays and linear
in the direction (Olano & Greer 1997). In a tile of an image the direction is affine in the pixel, so their
signs at the tile's four corners tell which triangles it can see at all.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .geometry import Geometry, Ints
from .shadows import plane_bound
from .vectors import Floats, dot, transform, unit
from .watertight import SLOPE_ULPS, edge_functions, one_norm

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


@dataclass(frozen=True)
class _Pencil:
    """All triangles about one origin: edge functions (3 edges, 3, t) with slack (3, t), and planes.

    The origin lies ``height`` (t,) below each plane, times its normal; planes it lies in are not live.
    """

    edges: Floats
    slack: Floats
    height: Floats
    live: NDArray[np.bool_]

    @classmethod
    def about(cls, geometry: Geometry, origin: Floats) -> _Pencil:
        pairs = edge_functions(geometry.a, geometry.b, geometry.c, origin)
        height = dot(geometry.a - origin, geometry.normal)
        live = np.abs(height) > plane_bound(geometry.normal, geometry.a, origin)
        return cls(np.stack([edge for edge, _ in pairs]), np.stack([s for _, s in pairs]), height, live)

    def in_tile(self, corners: Floats) -> Ints:
        """Which triangles can be hit by directions in the cone of four corner directions (3, 4)."""
        value = np.stack([dot(edge[:, :, None], corners[:, None, :]) for edge in self.edges])  # (3, t, 4)
        slack = 2 * self.slack * one_norm(corners).max()
        high, low = value.max(axis=2) + slack, value.min(axis=2) - slack
        return np.flatnonzero(((high >= 0).all(axis=0) | (low <= 0).all(axis=0)) & self.live)

    def nearest(self, normal: Floats, d: Floats, chosen: Ints) -> tuple[Floats, Ints, Floats]:
        """Nearest of the chosen triangles along each direction: distance (n,), triangle, weights (3, n)."""
        n = d.shape[1]
        best, which, weight = np.full(n, np.inf), np.full(n, -1), np.zeros((3, n))
        rays, size = np.arange(n), one_norm(d)
        step = max(1, BLOCK // max(n, 1))
        for start in range(0, chosen.size, step):
            block = chosen[start : start + step]
            w = np.stack([dot(edge[:, block, None], d[:, None, :]) for edge in self.edges])  # (3, block, n)
            slack = self.slack[:, block, None] * size
            inside = (w >= -slack).all(axis=0) | (w <= slack).all(axis=0)
            slope = dot(normal[:, block, None], d[:, None, :])
            height = np.broadcast_to(self.height[block, None], slope.shape)
            inside &= np.abs(slope) > SLOPE_ULPS * one_norm(normal[:, block])[:, None] * size
            t = np.full(slope.shape, np.inf)
            np.divide(height, slope, out=t, where=inside & (slope * height > 0))
            nearest = t.argmin(axis=0)
            better = t[nearest, rays] < best
            best[better] = t[nearest, rays][better]
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
    pencil = _Pencil.about(geometry, origin)
    chosen = np.flatnonzero(pencil.live) if corners is None else pencil.in_tile(corners)
    distance, triangle, weight = pencil.nearest(geometry.normal, d, chosen)
    n = d.shape[1]
    ellipsoid = np.full(n, -1)
    for index in range(geometry.ellipsoids):
        inverse = geometry.inverse[index]
        t = _ellipsoid_distance(transform(inverse, origin - geometry.center[:, [index]]), transform(inverse, d))
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
