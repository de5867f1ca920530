"""Light of a parallelogram, or of half of one, behind occluders: for each point the cheapest sound route.

unlit    the light's back, or below the horizon: exactly 0
lit      nothing reaches into the light's cone: closed form
hidden   one occluder holds the whole light, or nothing is left of the contour: exactly 0
exact    the boundary integral over the visible contour
coarse   the same, where its bound is above COARSE
silhouette  big closed meshes: see `soft_shadows.meshes`; taken for all points at once (`estimators.exact`)
sampled  too many candidates: the closed form minus a Monte Carlo estimate of what is hidden

Each value comes with a bound of its error in units of the unoccluded value: what is left of a light deep in penumbra
is a difference.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from nusselt.renderer.closed_forms.circles.pairing import columns
from nusselt.renderer.errors import InputError
from nusselt.renderer.lights import QuadLight, colour
from nusselt.renderer.lights.facing import faced_by
from nusselt.renderer.lobes import Lobe
from nusselt.renderer.needs import Source
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Bools, Floats, Ints, column, dot

from .candidates import Standing, portions
from .integrals import Integral, displaced, over_arcs, over_nodes, small_lights
from .rims import rims
from .strips import Bodies, Trapezoids, trapezoids

BLOCK = 8192
"""Points handled at once."""

ROUTES = ("unlit", "lit", "hidden", "exact", "coarse", "silhouette", "sampled")

ENOUGH = 1e-10
"""A bound for which the lobe of the whole light need not be known."""
COARSE = 1e-6
"""A bound that the route tells of."""


@dataclass
class Tally:
    """How many points took which route."""

    counts: dict[str, int] = field(default_factory=lambda: dict.fromkeys(ROUTES, 0))

    def add(self, route: str, count: int) -> None:
        self.counts[route] += int(count)


@dataclass(frozen=True, eq=False)
class Found:
    """Light at n points.

    Parameters
    ----------
    radiance : (3, n) float64
        Reflected radiance; 0 at the points left to sampling.
    bound : (n,) float64
        Of its error, in units of what the whole light would give.
    sampled : (k,) int64
        The points left to sampling.
    tally : Tally
        The routes taken.
    """

    radiance: Floats
    bound: Floats
    sampled: Ints
    tally: Tally


@dataclass(frozen=True, eq=False)
class QuadShadows:
    """One light over one set of points.

    Parameters
    ----------
    points : ShadingPoints
    source : Source
    light : QuadLight
        The source's, or the parallelogram of which that is the half u + v < 1.
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

    def radiance(self) -> Found:
        """Light at all points but those left to sampling."""
        points, tally = self.points, Tally()
        found = Found(np.zeros((3, points.count)), np.zeros(points.count), np.empty(0, dtype=np.int64), tally)
        lit, left = [], []
        faced = self._faced()
        tally.add("unlit", points.count - faced.size)
        standing = Standing.before(self.light, self.source.blockers, self.source.light.half_of() is not None)
        for start in range(0, faced.size, BLOCK):
            free, sampled = self._block(faced[start : start + BLOCK], standing, found)
            lit.append(free)
            left.append(sampled)
        free = np.sort(np.concatenate([*lit, np.empty(0, dtype=np.int64)]))
        tally.add("lit", free.size)
        if free.size:
            few = points if free.size == points.count else points.take(free)
            found.radiance[:, free], found.bound[free] = self.source.light.unshadowed(few, self.source.glossy)
        sampled = np.sort(np.concatenate([*left, np.empty(0, dtype=np.int64)]))
        found.bound[sampled] = np.inf
        tally.add("sampled", sampled.size)
        return replace(found, sampled=sampled)

    def _faced(self) -> Ints:
        """Points that the light faces, and above whose horizon it reaches."""
        p, ab, ac = column(self.light.corner) - self.points.position, column(self.light.ab), column(self.light.ac)
        facing = faced_by(column(self.light.corner), ab, ac, self.points.position)
        top = np.maximum.reduce([dot(self.points.normal, v) for v in (p, p + ab, p + ac, p + ab + ac)])
        return np.flatnonzero(facing & (top > 0))

    def _block(self, index: Ints, standing: Standing, out: Found) -> tuple[Ints, Ints]:
        """Fill in the points that are not lit or sampled; those that are."""
        points = self.points.take(index)
        if self.shortcuts:
            standing = standing.near(points.position)
            if standing.none:
                return index, np.empty(0, dtype=np.int64)
        pairs = standing.pairs(points, self.shortcuts)
        awkward = standing.awkward(points, pairs)
        bodies_before = np.bincount(pairs.point, minlength=index.size)
        work = np.flatnonzero(bodies_before) if self.shortcuts else np.arange(index.size)
        free, left = np.ones(index.size, dtype=bool), np.zeros(index.size, dtype=bool)
        crowded = np.flatnonzero(bodies_before > self.most)
        free[work] = False
        left[awkward], left[crowded] = True, True
        for some, portion in portions(work[~left[work]], pairs.point):
            chosen = points.take(some)
            bodies, inside = standing.bodies(chosen, some, pairs, portion)
            bodies, parts = trapezoids(bodies, self.shortcuts)
            hidden, lit = parts.hidden(some.size), parts.lit.copy()
            hidden[inside], lit[inside] = True, False
            free[some[lit]] = True
            out.tally.add("hidden", hidden.sum())
            rest = np.flatnonzero(~hidden & ~lit)
            value, bound = self._reflected(chosen, bodies, parts, rest)
            place = index[some[rest]]
            out.radiance[:, place], out.bound[place] = value * colour(self.source.light), bound
            out.tally.add("coarse", (bound > COARSE).sum())
            out.tally.add("exact", (bound <= COARSE).sum())
        return index[free], index[left]

    def _reflected(self, points: ShadingPoints, bodies: Bodies, parts: Trapezoids, rest: Ints) -> tuple[Floats, Floats]:
        """Radiance (3, k) of unit light at the points ``rest`` (k,), and its bound."""
        number = np.full(points.count, -1)
        number[rest] = np.arange(rest.size)
        parts = parts.take(np.flatnonzero(number[parts.point] >= 0))
        bent = np.zeros(points.count, dtype=bool)
        for group in bodies.rounds:
            bent[group.point] = True
        few, value, error = points.take(rest), np.zeros((3, rest.size)), np.zeros((3, rest.size))
        for kind in points.reflecting(self.source.glossy):
            albedo = points.albedo(kind)
            if kind.glossy and not albedo.any():
                continue
            integral = _integral(points, bodies, parts, bent, kind).take(rest)
            albedo = columns(albedo, rest)
            value, error = value + albedo * integral.value, error + albedo * integral.error
        value, error = value / (2 * math.pi), error / (2 * math.pi)
        # What is left is less than the whole: mostly that tells enough.
        bound = np.where(error > 0, _ratio(error, value - error), 0.0).max(axis=0)
        unsure = np.flatnonzero(bound > max(ENOUGH, points.enough))
        if unsure.size:
            unit = self.source.light.with_colour((1.0, 1.0, 1.0))
            whole, rounding = unit.unshadowed(few.take(unsure), self.source.glossy)
            value[:, unsure] = np.minimum(value[:, unsure], whole)
            bound[unsure] = np.where(whole > 0, _ratio(error[:, unsure], whole * (1 - rounding)), 0.0).max(axis=0)
        return value, np.minimum(bound, 1.0)


def _integral(points: ShadingPoints, bodies: Bodies, parts: Trapezoids, bent: Bools, kind: type[Lobe]) -> Integral:
    """By nodes at points to which the light is small and no rim is bent, by arcs at the others."""
    contour = kind.contour
    if contour is None:
        raise InputError(kind.title, "behind occluders", "a lobe with boundary integrals, or an estimator that samples")
    small = small_lights(points, bodies.square, contour) & ~bent
    if contour.dear:
        parts = parts.take(np.flatnonzero(points.albedo(kind).max(axis=0)[parts.point] > 0))
    one = over_arcs(points, *rims(bodies, parts.take(np.flatnonzero(~small[parts.point])), few=contour.dear), contour)
    two = over_nodes(points, bodies.square, parts.take(np.flatnonzero(small[parts.point])), contour)
    error = one.error + two.error + displaced(points, bodies, contour)
    return Integral(np.maximum(one.value + two.value, 0.0), error)


def _ratio(error: Floats, least: Floats) -> Floats:
    """error / least, inf where nothing is known to be there."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return np.asarray(np.where(least > 0, error / least, np.inf))
