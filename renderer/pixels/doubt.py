"""Where a shadow may begin and end within one pixel, so that values around it tell nothing of what is inside.

A point sees a light through a cone. An edge that passes through the cone at a distance t throws a penumbra as wide as
the light seems from it; on a footprint of radius r the shadow moves by r / t as seen from the edge, against the light's
own width 2 k (k is its radius over its distance). Where the first is the larger, all of the penumbra fits in the
footprint: a crack of light under a box, a contact shadow, any shadow of a light without extent. These places are found
from the edges themselves, not from radiance. What lies below the surface's own plane throws no shadow on it.
So are the rims of lights that end by themselves.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.geometry.ragged import expand
from nusselt.renderer.lights import Light
from nusselt.renderer.needs import Source
from nusselt.renderer.vectors import Floats, Ints, dot, unit
from nusselt.renderer.visibility.bvh import morton

from .folds import clipped
from .regions import Regions
from .shadow_edges import FLAT, shadow_edges

BLOCK, GROUP = 256, 32
"""Footprints for which edges are looked up together, at most and at least."""
PAIRS = 1 << 18
"""Footprints and edges handled at once."""
WIDTHS = 1.0
"""Of footprints, that a penumbra must be wide to be seen by the values around it."""
WIDEST = 10.0
"""Of a cone's growth: a sky's has no end, and shadows that fit into a pixel are thrown from very near."""


@dataclass(frozen=True, eq=False)
class Footprints:
    """Parts of surfaces that pixels show.

    Parameters
    ----------
    position, normal : (3, n) float64
        Middles; unit normals on the viewer's side.
    radius : (n,) float64
    reach : (n,) float64
        How far from there others of at most that radius lie on the same plane: one stands for all of them.
    """

    position: Floats
    normal: Floats
    radius: Floats
    reach: Floats

    def take(self, index: Ints) -> Footprints:
        """The footprints ``index`` (k,)."""
        return Footprints(*(getattr(self, part.name)[..., index] for part in fields(self)))


def footprints(
    regions: Regions,
    x: Floats,
    y: Floats,
    region: Ints,
    size: Floats | float = 1.0,
    around: Floats | None = None,
) -> Footprints:
    """Footprints ``size`` pixels wide around image points (n,) of given regions' surfaces, no larger than those.

    Each may stand for all whose middles lie in a rectangle, ``around`` (2, n) pixels to either side of it: of planes,
    to which the distance changes by less than itself there.
    """
    points, lens, surface = regions.points(x, y, region), regions.lens, region % regions.surfaces
    d, to = lens.directions(x, y), points.position - lens.origin
    away, down = np.sqrt(dot(to, to) / dot(d, d)), dot(d, points.normal)
    turn = [dot(step, points.normal) / np.where(down == 0, 1.0, down) for step in lens.steps]
    sides = [away * (step - d * share) for step, share in zip(lens.steps, turn, strict=True)]  # on its plane
    length, reach = [np.sqrt(dot(side, side)) for side in sides], np.zeros(x.size)
    if around is not None:
        # The plane's point s beside the middle one, in pixels, is sides . s / (1 + turn . s) away from it.
        across, down_ = (side * half for side, half in zip(sides, around, strict=True))
        ends = [across + sign * down_ for sign in (1, -1)]
        least = 1 - sum(np.abs(share) * half for share, half in zip(turn, around, strict=True))
        reach = np.sqrt(np.maximum(*(dot(end, end) for end in ends))) / least
        length = [(side + reach * np.abs(share)) / least for side, share in zip(length, turn, strict=True)]
    radius = np.minimum(size * np.hypot(*length) / 2, regions.radii[surface])
    return Footprints(points.position, points.normal, radius, reach)


def doubtful(
    regions: Regions, sources: tuple[Source, ...], x: Floats, y: Floats, region: Ints, size: Floats | float = 1.0
) -> NDArray[np.bool_]:
    """At which image points (n,) of given regions a shadow, or a light's rim, may fit in ``size`` pixels."""
    found = np.zeros(x.size, dtype=bool)
    if not sources or x.size == 0:
        return found
    parts = footprints(regions, x, y, region, size)
    for source in sources:
        found[in_doubt(regions, source, parts)[0]] = True
    return found


@dataclass(frozen=True, eq=False)
class Suspects:
    """Which of a light's edges may throw a shadow on each of n places, as far as that is known.

    Parameters
    ----------
    first, count : (n,) int64
        Where each place's begin in ``edge``, and how many they are; -1 if all may.
    edge : (m,) int64
    """

    first: Ints
    count: Ints
    edge: Ints

    @classmethod
    def all_edges(cls, n: int) -> Suspects:
        """Nothing is known yet of n places."""
        return cls(np.zeros(n, dtype=np.int64), np.full(n, -1), np.zeros(0, dtype=np.int64))

    def take(self, index: Ints) -> Suspects:
        """Of the places ``index`` (k,)."""
        return Suspects(self.first[index], self.count[index], self.edge)

    def given(self, place: Ints, point: Ints, edge: Ints) -> Suspects:
        """With those of some places (k,) known: pairs (m,) of numbers among them, and edges."""
        order, first, count = np.argsort(point, kind="stable"), self.first.copy(), self.count.copy()
        count[place] = np.bincount(point, minlength=place.size)
        first[place] = self.edge.size + np.cumsum(count[place]) - count[place]
        return Suspects(first, count, np.append(self.edge, edge[order]))


def in_doubt(
    regions: Regions, source: Source, parts: Footprints, suspects: Suspects | None = None
) -> tuple[Ints, Ints]:
    """Footprints (m,) that may hold a shadow, or a light's rim, and what may throw it: pairs with a light's edges.

    The rim is one more edge, of number -1.
    """
    light, (rim,) = source.light, np.nonzero(source.light.rim_within(parts.position, parts.radius + parts.reach))
    ends = shadow_edges(regions, light)
    if source.blockers.none or ends[0].shape[1] == 0 or parts.radius.size == 0:
        return rim, np.full(rim.size, -1)
    places = np.hstack((parts.position, *ends))
    sides = places.max(axis=1) - places.min(axis=1)
    span = float(np.sqrt(dot(sides, sides)))  # nothing is farther than that
    cones = _cones(parts, light, span)
    found: list[tuple[Ints, Ints]] = [(rim, np.full(rim.size, -1))]
    for point, edge in _pairs(cones, parts, ends, span, suspects or Suspects.all_edges(parts.radius.size)):
        start, end = (v[:, edge] for v in ends)
        low, high = _above(parts.position[:, point], parts.normal[:, point], start, end)
        holds = np.flatnonzero(cones.take(point).holds(start, end, low, high))
        found.append((point[holds], edge[holds]))
    point, edge = (np.concatenate(v) for v in zip(*found, strict=True))
    return point, edge


def _pairs(
    cones: Cone, parts: Footprints, ends: tuple[Floats, Floats], span: float, suspects: Suspects
) -> Iterator[tuple[Ints, Ints]]:
    """Footprints and edges that may meet, a block at a time."""
    known = np.flatnonzero(suspects.count > 0)
    for first in range(0, known.size, PAIRS // GROUP):
        some = suspects.take(known[first : first + PAIRS // GROUP])
        owner, nth = expand(some.count)
        edge = some.edge[some.first[owner] + nth]
        k = np.flatnonzero(edge >= 0)
        yield known[first + owner[k]], edge[k]
    every = np.flatnonzero(suspects.count < 0)
    every = every[_together(parts.take(every))]
    size = int(np.clip(PAIRS // ends[0].shape[1], GROUP, BLOCK))
    for first in range(0, every.size, size):
        block = every[first : first + size]
        point, edge = _near(cones.take(block), parts.normal[:, block], ends, span)
        yield block[point], edge


def _near(cones: Cone, normal: Floats, ends: tuple[Floats, Floats], span: float) -> tuple[Ints, Ints]:
    """Cones (n,) and edges that come near enough to each other, above the planes of the former."""
    start, end = ends
    middle, way, slack = (start + end) / 2, (end - start) / 2, FLAT * span
    half = np.sqrt(dot(way, way)) + slack
    low, high = cones.position.min(axis=1, keepdims=True), cones.position.max(axis=1, keepdims=True)
    centre, around = (low + high) / 2, np.sqrt(dot(high - low, high - low)) / 2 + cones.reach.max()
    away = middle - centre
    near = np.flatnonzero(dot(away, away) <= (around + half) ** 2)
    # Not each edge's own distance and height, but what products of matrices tell of both, and rounding.
    at, away, half, one = cones.position - centre, away[:, near], half[near], np.ones(cones.k.size)
    rows = np.vstack((-2 * at, dot(at, at) - cones.reach**2 - slack * span, -2 * cones.reach, one))
    meet = rows.T @ np.vstack((away, np.ones(near.size), half, dot(away, away) - half**2)) <= 0
    meet &= normal.T @ away + np.abs(normal.T @ way[:, near]) >= dot(normal, at)[:, None] - slack
    point, edge = np.divmod(np.flatnonzero(meet), max(near.size, 1))
    return point, near[edge]


def _together(parts: Footprints) -> Ints:
    """An order (n,) in which footprints of like size that lie beside each other follow each other."""
    if parts.radius.size == 0:
        return np.zeros(0, dtype=np.int64)
    low, high = (f(parts.position, axis=1, keepdims=True) for f in (np.min, np.max))
    place = (2 * parts.position - low - high) / max(float((high - low).max()), np.finfo(float).tiny)
    return np.lexsort((morton(place), np.frexp(parts.radius + parts.reach)[1] // 2))


def _above(position: Floats, normal: Floats, start: Floats, end: Floats) -> tuple[Floats, Floats]:
    """Between which shares of their length edges (3, n) are above the planes of surfaces at positions (3, n)."""
    a = start - position
    height, rise = dot(normal, a) - FLAT * np.sqrt(dot(a, a)), dot(normal, end - start)
    return clipped(np.zeros(height.size), np.ones(height.size), height, rise)


def _cones(parts: Footprints, light: Light, span: float) -> Cone:
    """From footprints (n,) to a light, as far as a penumbra can come from that fits in them, ``span`` at most.

    Cones whose middles lie ``reach`` away turn against the middle one by no more than that over the light's distance:
    within the range of a cone by ``sway``.
    """
    n, (middle, size) = parts.radius.size, light.middle()
    radius, reach = parts.radius, parts.reach
    if light.at_infinity:
        axis = np.broadcast_to(unit(middle), parts.position.shape)
        near = far = np.full(n, min(size, WIDEST))
        distance, sway = np.full(n, np.inf), np.zeros(n)
    else:
        to = middle - parts.position
        away = np.sqrt(dot(to, to))
        least, distance = np.maximum(away - reach, FLAT * away), away + reach
        axis, near, far, sway = to / away, size / least, size / distance, reach / least
    farthest = radius / np.maximum(2 * far / WIDTHS + radius / distance, radius / span)
    sway = sway * np.hypot(farthest, radius + near * farthest)
    wide = radius + sway * (1 + near) + reach * np.hypot(1.0, near)
    return Cone(parts.position, axis, wide, near, farthest + sway + reach)


@dataclass(frozen=True, eq=False)
class Cone:
    """From footprints (n,) to a light, as far as a penumbra that fits in them can come from.

    Parameters
    ----------
    position, axis : (3, n) float64
        Middles of the footprints; unit directions to the light's middle.
    radius, k : (n,) float64
        At the middle, and how it grows with the distance along the axis.
    farthest : (n,) float64
        Distance at which it ends.
    """

    position: Floats
    axis: Floats
    radius: Floats
    k: Floats
    farthest: Floats

    @property
    def reach(self) -> Floats:
        """How far from the middle a cone goes at most (n,)."""
        return np.hypot(self.farthest, self.radius + self.k * self.farthest)

    def take(self, index: Ints) -> Cone:
        """The cones ``index`` (k,)."""
        return Cone(*(getattr(self, part.name)[..., index] for part in fields(self)))

    def holds(self, start: Floats, end: Floats, low: Floats, high: Floats) -> NDArray[np.bool_]:
        """Whether some of its edge (3, n), between two shares of its length, is in each cone.

        Along an edge, q = a + s e, let t be the distance along the axis and l the one from it. The edge is in the
        cone where l^2 - (r + k t)^2 <= 0: a quadratic in s, whose least value between the ends that count decides.
        """
        a, e, k = start - self.position, end - start, self.k
        t, along = dot(self.axis, a), dot(self.axis, e)
        low, high = clipped(low, high, self.farthest - t, -along)
        low, high = clipped(low, high, t + self.radius, along)
        wide = self.radius + k * t
        square = dot(e, e) - along**2 - (k * along) ** 2
        half = dot(a, e) - t * along - k * along * wide
        rest = dot(a, a) - t**2 - wide**2
        least = np.where(square > 0, np.clip(-half / np.where(square > 0, square, 1.0), low, high), low)
        inside = np.zeros(t.size, dtype=bool)
        for s in (low, high, least):
            inside |= (square * s + 2 * half) * s + rest <= 0
        return np.asarray(inside & (low <= high))
