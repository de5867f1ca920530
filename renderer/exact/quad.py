"""Light of a parallelogram behind occluders: for each point the cheapest sound route.

unlit    the light's back, or below the horizon: exactly 0
lit      nothing reaches into the light's cone: closed form
hidden   one occluder holds the whole light, or nothing is left of the contour: exactly 0
exact    the boundary integral over the visible contour
sampled  too many candidates: the closed form minus a Monte Carlo estimate of what is hidden

Accuracy is absolute, relative to the unoccluded value: what is left of a light deep in penumbra is a difference.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ..geometry import Ints
from ..light_points import colour
from ..needs import Source
from ..scene import QuadLight
from ..shading import ShadingPoints
from ..shadows import PLANE_ULPS
from ..unshadowed import quad_light
from ..vectors import Floats, dot
from .contour import Contour, visible_contour
from .fans import Fan, fans_of
from .kernels import lambert_arcs, lobe_arcs
from .light_cone import LightCone, cut_cone, light_corners, whole_cone
from .occluders import Occluders, occluders
from .shaft import in_shaft, reaching

BLOCK = 2048
"""Points handled at once."""
PAIRS = 1 << 14
"""Pairs of a point and an occluder handled at once."""

ROUTES = ("unlit", "lit", "hidden", "exact", "sampled")


@dataclass
class Tally:
    """How many points took which route."""

    counts: dict[str, int] = field(default_factory=lambda: dict.fromkeys(ROUTES, 0))

    def add(self, route: str, count: int) -> None:
        self.counts[route] += int(count)


@dataclass(frozen=True)
class QuadShadows:
    """One light over one set of points.

    Parameters
    ----------
    points : ShadingPoints
    source : Source
    light : QuadLight
    shortcuts : bool
        Leave out what cannot matter: shafts, closed forms, umbrae.
    most : int
        Candidates beyond which a point is left to sampling.
    """

    points: ShadingPoints
    source: Source
    light: QuadLight
    shortcuts: bool
    most: int

    def radiance(self) -> tuple[Floats, Ints, Tally]:
        """Reflected radiance (3, n); the points (k,) left to sampling, which are 0; the routes taken."""
        points, tally = self.points, Tally()
        out, left = np.zeros((3, points.count)), []
        whole, cut = self._sides()
        tally.add("unlit", points.count - whole.size - cut.size)
        bodies = occluders(self.source.blockers.geometry, self.light)
        pieces = bodies.among(self.source.blockers)
        lit = []
        for index, clipped in ((whole, False), (cut, True)):
            for start in range(0, index.size, BLOCK):
                some = index[start : start + BLOCK]
                free, sampled = self._block(some, clipped, bodies, pieces, out, tally)
                lit.append(free)
                left.append(sampled)
        free = np.concatenate([*lit, np.empty(0, dtype=np.int64)])
        tally.add("lit", free.size)
        if free.size:
            few = points if free.size == points.count else points.take(np.sort(free))
            out[:, np.sort(free)] = quad_light(few, self.light, self.source.glossy)
        sampled = np.sort(np.concatenate([*left, np.empty(0, dtype=np.int64)]))
        tally.add("sampled", sampled.size)
        return out, sampled, tally

    def _sides(self) -> tuple[Ints, Ints]:
        """Points that the light faces: those it is wholly above, and those whose horizon cuts it."""
        corners = light_corners(self.light, self.points.position)
        z = dot(self.points.normal[:, None], corners)
        facing = dot(np.cross(self.light.ab, self.light.ac), corners[:, 0]) > 0
        top, bottom = z.max(axis=0), z.min(axis=0)
        return np.flatnonzero(facing & (bottom >= 0) & (top > 0)), np.flatnonzero(facing & (bottom < 0) & (top > 0))

    def _block(
        self, index: Ints, clipped: bool, bodies: Occluders, pieces: Ints, out: Floats, tally: Tally
    ) -> tuple[Ints, Ints]:
        """Fill in the points that are not lit or sampled; those that are."""
        none = np.empty(0, dtype=np.int64)
        position, normal = self.points.position[:, index], self.points.normal[:, index]
        corners = light_corners(self.light, position)
        if self.shortcuts and pieces.size:
            lamp = corners[:, :, 0] + position[:, [0]]
            pieces = pieces[in_shaft(bodies.center[:, pieces], bodies.radius[pieces], position, lamp)]
        if self.shortcuts and pieces.size == 0:
            return index, none
        cone = cut_cone(corners, normal) if clipped else whole_cone(corners)
        if self.shortcuts:
            point, ball = reaching(bodies.center[:, pieces], bodies.radius[pieces], position, cone.planes, normal)
        else:
            point, ball = np.nonzero(np.ones((index.size, pieces.size), dtype=bool))
        free, left = np.ones(index.size, dtype=bool), np.zeros(index.size, dtype=bool)
        work = np.unique(point) if self.shortcuts else np.arange(index.size)
        free[work] = False
        for some, pairs in _portions(work, point):
            local = np.searchsorted(some, point[pairs])
            chosen = self.points.take(index[some])
            fans, inside = fans_of(chosen.position, bodies, local, pieces[ball[pairs]])
            fans = [above for fan in fans if (above := _above(fan, chosen)).point.size]
            found = visible_contour(cone.take(some), fans, inside, self.shortcuts, self.most)
            many = (found.candidates > self.most) & ~found.hidden
            free[some[found.lit]] = self.shortcuts
            left[some[many]] = True
            done = ~many & ~(found.lit & self.shortcuts)
            out[:, index[some[done]]] = self._reflected(chosen, found)[:, done]
            tally.add("hidden", found.hidden.sum())
            tally.add("exact", (done & ~found.hidden).sum())
        return index[free], index[left]

    def _reflected(self, points: ShadingPoints, found: Contour) -> Floats:
        """Reflected radiance (3, n) of the contour's arcs."""
        arcs, n = found.arcs, points.count
        share = arcs.sign * lambert_arcs(arcs.start, arcs.end, points.normal[:, arcs.point])
        value = np.maximum(np.bincount(arcs.point, share, n), 0.0) / 2
        out = points.diffuse * (value / math.pi)
        if self.source.glossy and points.is_glossy:
            k = np.flatnonzero(points.specular.max(axis=0)[arcs.point] > 0)
            p = arcs.point[k]
            n_p, w_p, s_p = points.normal[:, p], points.mirror[:, p], points.shininess[p]
            share = arcs.sign[k] * lobe_arcs(arcs.start[:, k], arcs.end[:, k], n_p, w_p, s_p)
            out += points.specular * (np.maximum(np.bincount(p, share, n), 0.0) / (2 * math.pi))
        return np.asarray(out * colour(self.light))


def _above(fan: Fan, points: ShadingPoints) -> Fan:
    """Without the outlines that lie below the horizon, or in it to rounding."""
    height = dot(points.normal[:, None, fan.point], fan.corners)
    size = np.abs(fan.corners).max(axis=(0, 1)) + np.abs(points.position).max(axis=0)[fan.point]
    return fan.take(np.flatnonzero(height.max(axis=0) > 8 * PLANE_ULPS * size))


def _portions(work: Ints, point: Ints) -> list[tuple[Ints, slice]]:
    """Points (ascending) in portions of at most PAIRS pairs, and the slice of their pairs."""
    first = np.searchsorted(point, work)
    portion = np.r_[0, np.flatnonzero(np.diff(first // PAIRS)) + 1, work.size] if work.size else np.array([0])
    out = []
    for a, b in zip(portion[:-1], portion[1:], strict=True):
        stop = first[b] if b < work.size else point.size
        out.append((work[a:b], slice(int(first[a]), int(stop))))
    return out
