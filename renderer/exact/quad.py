"""Light of a parallelogram behind occluders: for each point the cheapest sound route.

unlit    the light's back, or below the horizon: exactly 0
lit      nothing reaches into the light's cone: closed form
hidden   one occluder holds the whole light, or nothing is left of the contour: exactly 0
exact    the boundary integral over the visible contour
silhouette  big closed meshes: see `penumbra`; taken for all points at once (`estimators.exact`)
sampled  too many candidates: the closed form minus a Monte Carlo estimate of what is hidden

Accuracy is absolute, relative to the unoccluded value: what is left of a light deep in penumbra is a difference.
Measured: at most 1.8e-10 (see `occluders`); 1e-12 where nothing is partly hidden.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ..geometry import Ints
from ..light_points import colour
from ..lights import QuadLight
from ..needs import Source
from ..shading import ShadingPoints
from ..unshadowed import quad_light
from ..vectors import Floats, dot
from .circles import lambert_circles
from .contour import Contour, visible_contour
from .kernels import lambert_arcs, lobe_arcs, lobe_circles
from .light_cone import cut_cone, light_corners, whole_cone
from .standing import Standing, portions

BLOCK = 4096
"""Points handled at once."""

ROUTES = ("unlit", "lit", "hidden", "exact", "silhouette", "sampled")


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
        out, lit, left = np.zeros((3, points.count)), [], []
        whole, cut = self._sides()
        tally.add("unlit", points.count - whole.size - cut.size)
        standing = Standing.before(self.light, self.source.blockers)
        for index, clipped in ((whole, False), (cut, True)):
            for start in range(0, index.size, BLOCK):
                free, sampled = self._block(index[start : start + BLOCK], clipped, standing, out, tally)
                lit.append(free)
                left.append(sampled)
        free = np.sort(np.concatenate([*lit, np.empty(0, dtype=np.int64)]))
        tally.add("lit", free.size)
        if free.size:
            few = points if free.size == points.count else points.take(free)
            out[:, free] = quad_light(few, self.light, self.source.glossy)
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

    def _block(self, index: Ints, clipped: bool, standing: Standing, out: Floats, tally: Tally) -> tuple[Ints, Ints]:
        """Fill in the points that are not lit or sampled; those that are."""
        points = self.points.take(index)
        corners = light_corners(self.light, points.position)
        if self.shortcuts:
            standing = standing.near(points.position, corners[:, :, 0] + points.position[:, [0]])
            if standing.none:
                return index, np.empty(0, dtype=np.int64)
        cone = cut_cone(corners, points.normal) if clipped else whole_cone(corners)
        pairs = standing.pairs(points, cone.planes, self.shortcuts)
        awkward = np.unique(pairs.point[pairs.awkward])
        work = np.unique(pairs.point) if self.shortcuts else np.arange(index.size)
        free, left = np.ones(index.size, dtype=bool), np.zeros(index.size, dtype=bool)
        free[work], left[awkward] = False, True
        for some, portion in portions(np.setdiff1d(work, awkward), pairs.point):
            chosen = points.take(some)
            groups, inside = standing.groups(chosen, some, pairs, portion)
            found = visible_contour(cone.take(some), groups, inside, self.shortcuts, self.most)
            many = (found.candidates > self.most) & ~found.hidden
            lit = found.lit & self.shortcuts
            free[some[lit]], left[some[many]] = True, True
            done = np.flatnonzero(~many & ~lit)
            out[:, index[some[done]]] = self._reflected(chosen, found)[:, done]
            tally.add("hidden", found.hidden.sum())
            tally.add("exact", done.size - found.hidden.sum())
        return index[free], index[left]

    def _reflected(self, points: ShadingPoints, found: Contour) -> Floats:
        """Reflected radiance (3, n) of the contour's arcs."""
        total = self._total(points, found, lobe=False)
        out = points.diffuse * (np.maximum(total, 0.0) / (2 * math.pi))
        if self.source.glossy and points.is_glossy:
            total = self._total(points, found, lobe=True)
            out += points.specular * (np.maximum(total, 0.0) / (2 * math.pi))
        return np.asarray(out * colour(self.light))

    def _total(self, points: ShadingPoints, found: Contour, lobe: bool) -> Floats:
        """The boundary integral (n,) of the irradiance, twice it, or of the lobe, s + 2 times it."""
        wanted = (points.specular.max(axis=0) > 0) | (not lobe)
        total = np.zeros(points.count)
        arcs = found.arcs.take(np.flatnonzero(wanted[found.arcs.point]))
        if lobe:
            share, _ = lobe_arcs(arcs.start, arcs.end, *_lobe_of(points, arcs.point))
        else:
            share, _ = lambert_arcs(arcs.start, arcs.end, points.normal[:, arcs.point])
        total += np.bincount(arcs.point, arcs.sign * share, points.count)
        for circles in found.circles:
            few = circles.take(np.flatnonzero(wanted[circles.cone.point]))
            p = few.cone.point
            share, _ = lobe_circles(few, *_lobe_of(points, p)) if lobe else lambert_circles(few, points.normal[:, p])
            total -= np.bincount(p, share, points.count)
        return total


def _lobe_of(points: ShadingPoints, index: Ints) -> tuple[Floats, Floats, Floats]:
    return points.normal[:, index], points.mirror[:, index], points.shininess[index]
