"""Visibility between shading points and light points, without an epsilon.

A triangle blocks the segment from p to q if the two lie strictly on opposite sides of its plane and the
direction passes inside its three edges (see `watertight`). "Strictly" means beyond the rounding of the plane
equation itself, a bound that scales with the coordinates: the surface p lies on, its coplanar neighbours and
the light's own triangles drop out by it, a blocker 1e-12 away from either end does not, and nothing depends
on the scene's size (1e-6 or 1e9) or place.

An ellipsoid is convex: the one p lies on never blocks a direction above p's horizon.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .bvh import Hierarchy
from .geometry import Geometry, Ints
from .pairs import take
from .ray_offset import RayOffset
from .vectors import Floats, dot, transform
from .watertight import SLOPE_ULPS, edge_functions, largest, one_norm

Bools = NDArray[np.bool_]

PLANE_ULPS = 16 * 2.0**-53
"""Rounding of n . (p - a), relative to |n|_1 times the coordinates: a cross product (3), a sum of three
products (3), and p itself (5, from its barycentric sum), with room to spare."""

BLOCK = 1 << 17
"""Triangle-segment pairs handled at once."""

FEW = 128
"""Triangles up to which every segment tests every one."""

LOOSE = 32
"""At most so many triangles, far larger than the others, stay out of the hierarchy."""

BOXED = 1 << 22
"""Plane-point pairs beyond which the points' bounding box stands for them."""


@dataclass(frozen=True)
class Blockers:
    """The surfaces that may stand between some points and a light.

    Parameters
    ----------
    geometry : Geometry
    triangles, ellipsoids : (k,) int64
        Indices of the candidates.
    hierarchy : Hierarchy, optional
        Over the last of ``triangles``, where they are many.
    offset : RayOffset, optional
        Another renderer's rule for shadow rays; None is ours.
    """

    geometry: Geometry
    triangles: Ints
    ellipsoids: Ints
    hierarchy: Hierarchy | None = None
    offset: RayOffset | None = None

    @classmethod
    def everything(cls, geometry: Geometry) -> Blockers:
        """All surfaces of a scene."""
        return cls(geometry, np.arange(geometry.triangles), np.arange(geometry.ellipsoids))

    @property
    def none(self) -> bool:
        return self.triangles.size == 0 and self.ellipsoids.size == 0

    @property
    def loose(self) -> Ints:
        """The triangles that no hierarchy holds."""
        return self.triangles if self.hierarchy is None else self.triangles[: -self.hierarchy.triangles.size]

    def gathered(self) -> Blockers:
        """With the scene's hierarchy, if there are many triangles in it that may matter."""
        hierarchy = small_triangles(self.geometry)
        if hierarchy is None or self.triangles.size <= FEW:
            return self
        small = np.zeros(self.geometry.triangles, dtype=bool)
        small[hierarchy.triangles] = True
        loose = self.triangles[~small[self.triangles]]
        if loose.size == self.triangles.size:
            return self
        return replace(self, triangles=np.concatenate((loose, hierarchy.triangles)), hierarchy=hierarchy)

    def between(self, points: Floats, lights: Floats, at_infinity: bool) -> Blockers:
        """Without the triangles whose plane has all points and all light points on one side.

        Parameters
        ----------
        points : (3, n) float64
        lights : (3, m) float64
            Points whose convex hull holds the light; with ``at_infinity`` directions towards it.
        """
        g, k = self.geometry, self.loose
        if k.size * points.shape[1] > BOXED:
            points = box_corners(points)
        n, a = g.normal[:, k], g.a[:, k]
        bound = plane_bound(n, a, points)
        here = dot(n[:, :, None], points[:, None, :] - a[:, :, None])
        there = dot(n[:, :, None], lights[:, None, :] if at_infinity else lights[:, None, :] - a[:, :, None])
        slack = PLANE_ULPS * np.abs(n).sum(axis=0) * np.abs(lights).max() if at_infinity else plane_bound(n, a, lights)
        above = (here.min(axis=1, initial=np.inf) >= -bound) & (there.min(axis=1) >= -slack)
        below = (here.max(axis=1, initial=-np.inf) <= bound) & (there.max(axis=1) <= slack)
        kept = k[~(above | below)]
        if self.hierarchy is None:
            return replace(self, triangles=kept)
        if not at_infinity and self._missed(np.hstack((points, lights))):
            return replace(self, triangles=kept, hierarchy=None)
        return replace(self, triangles=np.concatenate((kept, self.hierarchy.triangles)))

    def _missed(self, points: Floats) -> bool:
        """Whether the bounding box of the points and the hierarchy's are apart."""
        if self.hierarchy is None or points.shape[1] == 0:
            return True
        low, high = points.min(axis=1, keepdims=True), points.max(axis=1, keepdims=True)
        centre, half = self.hierarchy.centre, self.hierarchy.half
        return bool(((low > centre + half) | (high < centre - half)).any())

    def visible(
        self, points: Floats, own_ellipsoid: Ints, d: Floats, at_infinity: bool, normal: Floats | None = None
    ) -> Bools:
        """Which light points each shading point sees.

        Parameters
        ----------
        points : (3, n) float64
        own_ellipsoid : (n,) int64
            Ellipsoid each point lies on, -1 for none.
        d : (3, n, k) float64
            From each point to its k light points; with ``at_infinity`` directions of any length.
        normal : (3, n) float64, optional
            Unit normals, read by the offset rule alone.

        Returns
        -------
        (n, k) bool
        """
        if self.offset is not None and normal is not None:
            points, d = self.offset.moved(points, normal, d, at_infinity)
        hidden = np.zeros(d.shape[1:], dtype=bool)
        loose = self.loose
        if loose.size:
            step = max(1, BLOCK // (loose.size * d.shape[2]))
            wide = max(1, BLOCK // d.shape[2])
            for start in range(0, points.shape[1], step):
                some = slice(start, start + step)
                for first in range(0, loose.size, wide):
                    chosen = loose[first : first + wide]
                    hidden[some] |= self._triangles_hide(chosen, points[:, some], d[:, some], at_infinity)
        if self.hierarchy is not None:
            open_ = np.flatnonzero(~hidden)
            p, ray = np.repeat(points, d.shape[2], axis=1)[:, open_], d.reshape(3, -1)[:, open_]
            hidden.ravel()[open_] = self.hierarchy_hides(p, ray, at_infinity)
        for index in self.ellipsoids:
            hidden |= self._ellipsoid_hides(index, points, own_ellipsoid, d, at_infinity)
        return ~hidden

    def _triangles_hide(self, chosen: Ints, p: Floats, d: Floats, at_infinity: bool) -> Bools:
        g = self.geometry
        bound = plane_bound(g.normal[:, chosen], g.a[:, chosen], p)
        p = p[:, :, None]
        height = dot(g.normal[:, None, chosen], g.a[:, None, chosen] - p)  # of the plane over p; (n, t)
        side = np.where(np.abs(height) > bound, np.sign(height), 0.0)
        live = np.flatnonzero(side.any(axis=0))
        if live.size == 0:
            return np.zeros(d.shape[1:], dtype=bool)
        chosen, side, away = chosen[live], side[:, live], (np.abs(height) + bound)[:, live]
        size = one_norm(d)[:, None, :]
        d = d[:, :, None, :]
        n = g.normal[:, None, chosen] * side
        rise = dot(n[..., None], d)  # > 0: towards the plane
        if at_infinity:
            hides = rise > (SLOPE_ULPS * one_norm(n))[..., None] * size
        else:
            # The far end lies beyond the plane by more than its own rounding.
            hides = rise > (away + PLANE_ULPS * one_norm(n) * size.max(axis=2))[..., None]
        hides &= (side != 0)[..., None]
        a, b, c = (corner[:, None, chosen] for corner in (g.a, g.b, g.c))
        for edge, slack in edge_functions(a, b, c, p):
            hides &= dot((edge * side)[..., None], d) >= -slack[..., None] * size
        return np.asarray(hides.any(axis=1))

    def hierarchy_hides(self, p: Floats, d: Floats, at_infinity: bool) -> Bools:
        """The same for segments (3, n), each of its own point, and the triangles of the hierarchy."""
        hierarchy = self.hierarchy
        if hierarchy is None:
            return np.zeros(p.shape[1], dtype=bool)

        return hierarchy.any_hit(p, d, at_infinity, self._pair_test(p, d, at_infinity))

    def crossings(self, p: Floats, d: Floats, at_infinity: bool) -> Ints:
        """How many triangles of the hierarchy each segment crosses."""
        if self.hierarchy is None:
            return np.zeros(p.shape[1], dtype=np.int64)
        return self.hierarchy.count_hits(p, d, at_infinity, self._pair_test(p, d, at_infinity))

    def _pair_test(self, p: Floats, d: Floats, at_infinity: bool) -> Callable[[Ints, Ints], Bools]:
        def hits(ray: Ints, triangle: Ints) -> Bools:
            return crosses(self.geometry, triangle, take(p, ray), take(d, ray), at_infinity)

        return hits

    def _ellipsoid_hides(self, index: int, p: Floats, own: Ints, d: Floats, at_infinity: bool) -> Bools:
        g = self.geometry
        inverse = g.inverse[index]
        local = transform(inverse, p - g.center[:, [index]])[:, :, None]
        d = transform(inverse, d)
        length2, b = dot(d, d), dot(local, d)
        closest = local - d * (b / length2)
        reach = np.sqrt(length2 * np.maximum(1 - dot(closest, closest), 0))  # half the chord, in |d|^2
        outside = dot(local, local) > 1
        crosses = dot(closest, closest) < 1
        enters = outside & (b < 0) & crosses
        leaves = ~outside & crosses
        if not at_infinity:
            enters &= -b - reach < length2
            leaves &= -b + reach < length2
        return (enters | leaves) & (own != index)[:, None]


@lru_cache(maxsize=4)
def small_triangles(g: Geometry) -> Hierarchy | None:
    """The hierarchy of a scene's many triangles: no lights, nor the few that are far larger than the others."""
    mine = np.flatnonzero(g.light[g.triangle_surface] < 0)
    if mine.size <= FEW:
        return None
    a, b, c = (take(v, mine) for v in (g.a, g.b, g.c))
    size = np.maximum(largest(b - a), largest(c - a))
    big = size > 16 * np.median(size)
    return Hierarchy.over(g, mine[~big] if big.sum() <= LOOSE else mine)


def crosses(g: Geometry, k: Ints, p: Floats, d: Floats, at_infinity: bool) -> Bools:
    """Which of m pairs block: triangle k (m,), segment from p along d, each (3, m). See the module."""
    n, a = take(g.normal, k), take(g.a, k)
    height = dot(n, a - p)
    bound = PLANE_ULPS * one_norm(n) * (largest(a) + largest(p))
    side = np.sign(height)
    size = one_norm(d)
    rise = dot(n, d) * side
    if at_infinity:
        through = rise > SLOPE_ULPS * one_norm(n) * size
    else:
        through = rise > np.abs(height) + bound + PLANE_ULPS * one_norm(n) * size
    live = np.flatnonzero(through & (np.abs(height) > bound))
    k, p, d, side, size = take(k, live), take(p, live), take(d, live), take(side, live), take(size, live)
    inside = np.ones(live.size, dtype=bool)
    for edge, slack in edge_functions(take(g.a, k), take(g.b, k), take(g.c, k), p):
        inside &= dot(edge, d) * side >= -slack * size
    hidden = np.zeros(through.size, dtype=bool)
    hidden[live] = inside
    return hidden


def box_corners(points: Floats) -> Floats:
    """The corners (3, 8) of the bounding box of points (3, n)."""
    low, high = points.min(axis=1), points.max(axis=1)
    return np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, 8)


def plane_bound(n: Floats, a: Floats, points: Floats) -> Floats:
    """Rounding bound (t,) of n . (p - a) over all points (3, m), for planes n, a (3, t)."""
    size = np.abs(a).max(axis=0) + np.abs(points).max(initial=0)
    return PLANE_ULPS * np.abs(n).sum(axis=0) * size
