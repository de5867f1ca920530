"""Visibility between shading points and light points, without an epsilon.

A triangle blocks the segment from p to q if the two lie strictly on opposite sides of its plane and the
direction passes inside its three edges (see `watertight`). "Strictly" means beyond the rounding of the plane
equation itself, a bound that scales with the coordinates: the surface p lies on, its coplanar neighbours and
the light's own triangles drop out by it, a blocker 1e-12 away from either end does not, and nothing depends
on the scene's size (1e-6 or 1e9) or place.

An ellipsoid is convex: the one whose outside p lies on never blocks a direction above p's horizon. From its inside it
blocks all that is outside. A point on it to rounding is told by its normal to be on the one or the other, whichever
body it was found on (`body_side`): bodies that coincide, or touch, need no rule of their own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.geometry.flat_disks import disk_hides
from nusselt.renderer.geometry.ragged import take
from nusselt.renderer.vectors import Bools, Floats, Ints, dot, transform
from nusselt.renderer.watertight import PLANE_ULPS, SLOPE_ULPS, edge_functions, largest, one_norm

from .bvh import Hierarchy
from .ray_offset import RayOffset

BODY_ULPS = 64 * 2.0**-53
"""Rounding of T (p - c) for a point of an ellipsoid c + A u, T the inverse of A, relative to |T| (|p| + |c| + |A| 1):
u (2), A u (3) and the sum (1); the difference (1), the product (3), and T, which has no simple bound. Measured: 1/35 of
it at most while the longest axis is below 1000 times the shortest, half of it up to 1e11 times."""

BLOCK = 1 << 17
"""Triangle-segment pairs handled at once."""

FEW = 128
"""Triangles up to which every segment tests every one."""

LOOSE = 32
"""At most so many triangles, far larger than the others, stay out of the hierarchy."""

BOXED = 1 << 22
"""Plane-point pairs beyond which the points' bounding box stands for them."""


@dataclass(frozen=True, eq=False)
class Blockers:
    """The surfaces that may stand between some points and a light.

    Parameters
    ----------
    geometry : Geometry
    triangles, ellipsoids, disks : (k,) int64
        Indices of the candidates.
    hierarchy : Hierarchy, optional
        Over the last of ``triangles``, where they are many.
    offset : RayOffset, optional
        Another renderer's rule for shadow rays; None is ours.
    """

    geometry: Geometry
    triangles: Ints
    ellipsoids: Ints
    disks: Ints
    hierarchy: Hierarchy | None = None
    offset: RayOffset | None = None

    @classmethod
    def everything(cls, geometry: Geometry) -> Blockers:
        """All surfaces of a scene."""
        g = geometry
        return cls(g, np.arange(g.triangles), np.arange(g.ellipsoids), np.arange(g.disks))

    @classmethod
    def around(cls, geometry: Geometry, light: int, hides_itself: bool = False) -> Blockers:
        """All but what a light is made of: its beams end on the near side, but for rounding, unless it hides itself."""
        g = geometry
        balls = np.flatnonzero(g.light[g.ellipsoid_surface] != light)
        own = (g.light[g.triangle_surface] == light) & ~np.bool_(hides_itself)
        return cls(g, np.flatnonzero(~own), balls, np.arange(g.disks))

    @classmethod
    def nothing(cls, geometry: Geometry) -> Blockers:
        """None of them."""
        none = np.empty(0, dtype=np.int64)
        return cls(geometry, none, none, none)

    @property
    def none(self) -> bool:
        return self.count == 0

    @property
    def count(self) -> int:
        return int(self.triangles.size + self.ellipsoids.size + self.disks.size)

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
        """Without the triangles and disks whose plane has all points and all light points on one side.

        Parameters
        ----------
        points : (3, n) float64
        lights : (3, m) float64
            Points whose convex hull holds the light; with ``at_infinity`` directions towards it.
        """
        g, k = self.geometry, self.loose
        if k.size * points.shape[1] > BOXED:
            points = box_corners(points)
        kept = k[~_on_one_side(g.normal[:, k], g.a[:, k], points, lights, at_infinity)]
        disks = self.disks
        if disks.size:
            n, center = g.disk_normal[:, disks], g.disk_center[:, disks]
            disks = disks[~_on_one_side(n, center, points, lights, at_infinity)]
        if self.hierarchy is None:
            return replace(self, triangles=kept, disks=disks)
        if not at_infinity and self._missed(np.hstack((points, lights))):
            return replace(self, triangles=kept, disks=disks, hierarchy=None)
        return replace(self, triangles=np.concatenate((kept, self.hierarchy.triangles)), disks=disks)

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
            Unit normals: where the offset rule moves the points, and on which side of an ellipsoid those are that lie
            on it. Without them that is the side a direction leads to: the same above the horizon.

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
            hidden |= self._ellipsoid_hides(index, points, own_ellipsoid, d, at_infinity, normal)
        for index in self.disks:
            hidden |= disk_hides(self.geometry, index, points, d, at_infinity)
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

    def _ellipsoid_hides(
        self, index: int, p: Floats, own: Ints, d: Floats, at_infinity: bool, normal: Floats | None
    ) -> Bools:
        others = np.flatnonzero(own != index)
        if others.size == own.size:
            return _crosses_body(self.geometry, index, p, d, at_infinity, normal)
        hidden = np.zeros(d.shape[1:], dtype=bool)
        if others.size:
            looks = None if normal is None else normal[:, others]
            hidden[others] = _crosses_body(self.geometry, index, p[:, others], d[:, others], at_infinity, looks)
        return hidden


def _on_one_side(n: Floats, a: Floats, points: Floats, lights: Floats, at_infinity: bool) -> Bools:
    """Which planes n, a (3, t) have all points (3, n) and all light points (3, m), or directions, on one side."""
    bound = plane_bound(n, a, points)
    here = dot(n[:, :, None], points[:, None, :] - a[:, :, None])
    there = dot(n[:, :, None], lights[:, None, :] if at_infinity else lights[:, None, :] - a[:, :, None])
    slack = PLANE_ULPS * np.abs(n).sum(axis=0) * np.abs(lights).max() if at_infinity else plane_bound(n, a, lights)
    above = (here.min(axis=1, initial=np.inf) >= -bound) & (there.min(axis=1) >= -slack)
    below = (here.max(axis=1, initial=-np.inf) <= bound) & (there.max(axis=1) <= slack)
    return np.asarray(above | below)


def _crosses_body(g: Geometry, index: int, p: Floats, d: Floats, at_infinity: bool, normal: Floats | None) -> Bools:
    """Whether segments p to p + d, or rays, cross an ellipsoid's surface; (3, n), (3, n, k) -> (n, k)."""
    side = body_side(g, index, p, normal)
    local = transform(g.inverse[index], p - g.center[:, [index]])[:, :, None]
    way = transform(g.inverse[index], d)
    length2, b = dot(way, way), dot(local, way)
    closest = local - way * (b / length2)
    through = (b < 0) & (dot(closest, closest) < 1)  # of those that start outside
    beyond: Bools = np.ones(b.shape, dtype=bool)  # the far end is outside
    if not at_infinity:
        end = local + way
        farthest = np.abs(d).max(axis=2, initial=0)  # p + d is no better known than this
        slack = 2 * _body_rounding(g, index, np.abs(p) + farthest).sum(axis=0)[:, None]
        height = dot(end, end) - 1
        beyond = height > slack
        # Past the point closest to the centre, or ending within.
        through = (through & (b + length2 > 0)) | (height < -slack)
    crosses = np.where(side[:, None] > 0, through, beyond)
    on = np.flatnonzero(side == 0)
    if on.size:
        crosses[on] &= normal is None and _heads_inwards(g, index, p[:, on], d[:, on])
    return np.asarray(crosses)


def _heads_inwards(g: Geometry, index: int, p: Floats, d: Floats) -> Bools:
    """Whether directions d (3, n, k) from points p (3, n) of an ellipsoid lead into it, beyond rounding."""
    inverse = g.inverse[index]
    local, way = transform(inverse, p - g.center[:, [index]])[:, :, None], transform(inverse, d)
    rounding = _body_rounding(g, index, np.abs(p))[:, :, None]
    slack = dot(rounding, np.abs(way)) + BODY_ULPS * dot(np.abs(local), transform(np.abs(inverse), np.abs(d)))
    return np.asarray(dot(local, way) < -slack)


def body_side(g: Geometry, body: Ints | int, points: Floats, normal: Floats | None = None) -> Ints:
    """On which side of an ellipsoid each point lies: 1 outside, -1 inside, 0 on its surface to rounding.

    Parameters
    ----------
    body : int or (n,) int64
        Ellipsoid, or each point's.
    points : (3, n) float64
    normal : (3, n) float64, optional
        The points' own: one on the surface that looks into the body, whose far side is in its way, then counts as
        inside. What is 0 then has nothing of this body above its horizon.
    """
    local = _local(g, body, points)
    slack = _body_rounding(g, body, np.abs(points))
    height, bound = dot(local, local) - 1, dot(2 * np.abs(local) + slack, slack)
    side = np.where(height > bound, 1, np.where(height < -bound, -1, 0))
    if normal is not None:
        into = dot(local, transform(_matrices(g.inverse, body), normal)) < 0
        side[(side == 0) & into] = -1
    return side


def _matrices(values: Floats, body: Ints | int) -> Floats:
    """Each point's 3 x 3 matrix, (3, 3) or (3, 3, n)."""
    return np.moveaxis(values[body], (-2, -1), (0, 1))


def _local(g: Geometry, body: Ints | int, points: Floats) -> Floats:
    """Where points are in an ellipsoid's unit sphere."""
    return transform(_matrices(g.inverse, body), points - g.center[:, np.atleast_1d(body)])


def _body_rounding(g: Geometry, body: Ints | int, size: Floats) -> Floats:
    """Rounding (3, n) of points of the given size (3, n) in an ellipsoid's unit sphere."""
    reach = np.abs(_matrices(g.axes, body)).sum(axis=1).reshape(3, -1)
    where = size + np.abs(g.center[:, np.atleast_1d(body)]) + reach
    return BODY_ULPS * transform(np.abs(_matrices(g.inverse, body)), where)


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
