"""What stands before a light, for a scene, a block of points, and each point."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from nusselt.renderer.closed_forms.circles.pairing import columns
from nusselt.renderer.lights import QuadLight
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats, Ints, column, distinct, dot
from nusselt.renderer.visibility.segments import Blockers
from nusselt.renderer.watertight import PLANE_ULPS

from .conics import Conics, may_meet
from .occluders import INSIDE, TOUCHING, Occluders, occluders
from .round_bodies import OUTSIDE, RoundBodies, round_bodies
from .sections import Lines, Square, gathered
from .shaft import Bounds, in_shaft, reaching, shaft_planes
from .strips import Bodies

EFFORT = 1 << 15
"""Work handled at once: see `portions`."""
FEW = 4
"""Bodies for which a shaft costs more than it saves."""


@dataclass(frozen=True, eq=False)
class Pairs:
    """Pairs of a point and a body.

    Parameters
    ----------
    point, body : (k,) int64
        Points ascending; pieces first, then round bodies, numbered on.
    """

    point: Ints
    body: Ints


@dataclass(frozen=True, eq=False)
class Standing:
    """Bodies that may matter.

    Parameters
    ----------
    light : QuadLight
    half : bool
        Whether only its half u + v < 1 shines.
    flat : Occluders
    round : RoundBodies
    pieces, balls : (k,) int64
        Those of each that may.
    """

    light: QuadLight
    half: bool
    flat: Occluders
    round: RoundBodies
    pieces: Ints
    balls: Ints

    @classmethod
    def before(cls, light: QuadLight, blockers: Blockers, half: bool = False) -> Standing:
        """All that a light's blockers are part of."""
        flat, bodies = occluders(blockers.geometry, light), round_bodies(blockers.geometry, light)
        balls = blockers.ellipsoids[~bodies.behind[blockers.ellipsoids]]
        return cls(light, half, flat, bodies, flat.among(blockers), balls)

    @property
    def none(self) -> bool:
        return self.pieces.size + self.balls.size == 0

    def near(self, points: Floats) -> Standing:
        """Those in the shaft between points (3, n) and the light."""
        if self.pieces.size + self.balls.size <= FEW:
            return self
        corner, ab, ac = (column(v) for v in (self.light.corner, self.light.ab, self.light.ac))
        planes = shaft_planes(points, np.hstack((corner, corner + ab, corner + ac, corner + ab + ac)))
        pieces = in_shaft(self.flat.center[:, self.pieces], self.flat.radius[self.pieces], *planes)
        balls = in_shaft(self.round.center[:, self.balls], self.round.reach[self.balls], *planes)
        return replace(self, pieces=self.pieces[pieces], balls=self.balls[balls])

    def pairs(self, points: ShadingPoints, reached: bool) -> Pairs:
        """Bodies that reach into each point's cone; all of them with all if not ``reached``."""
        center = np.hstack((self.flat.center[:, self.pieces], self.round.center[:, self.balls]))
        radius = np.r_[self.flat.radius[self.pieces], self.round.reach[self.balls]]
        if reached:
            half = np.hstack((self.flat.half[:, self.pieces], np.tile(self.round.reach[self.balls], (3, 1))))
            light = np.abs(self.light.hull()).max()
            point, which = reaching(Bounds(center, half, radius, light), points.position, self._square(points).cone())
        else:
            point, which = np.nonzero(np.ones((points.count, radius.size), dtype=bool))
        return Pairs(point, np.r_[self.pieces, self.flat.count + self.balls][which])

    def awkward(self, points: ShadingPoints, pairs: Pairs) -> Ints:
        """Points (k,) before whose light a round body stands that is left to sampling."""
        ball = pairs.body - self.flat.count
        odd = np.r_[np.zeros(self.flat.count, dtype=bool), self.round.awkward][pairs.body]
        return distinct(pairs.point[odd & (points.ellipsoid[pairs.point] != ball)])

    def bodies(self, points: ShadingPoints, number: Ints, pairs: Pairs, portion: slice) -> tuple[Bodies, Ints]:
        """What stands before some points, the ``number``-th; and the points (k,) from which one body hides all."""
        mine = pairs.point[portion]
        place = np.searchsorted(number, mine)
        there = np.flatnonzero(number[np.minimum(place, number.size - 1)] == mine)
        place, body = place[there], pairs.body[portion][there]
        square = self._square(points)
        flat, balls = np.flatnonzero(body < self.flat.count), np.flatnonzero(body >= self.flat.count)
        lines, inside = self._flats(points, square, place[flat], body[flat])
        rounds = []
        if balls.size:
            p, ball = place[balls], body[balls] - self.flat.count
            own = points.ellipsoid[p] == ball
            side, outward = self.round.sides(columns(points.position, p), columns(points.normal, p), own, ball)
            out, met = np.flatnonzero(side == OUTSIDE), np.flatnonzero(side == TOUCHING)
            cones = self.round.seen(points.position, p[out], ball[out])
            cones = [cone.take(np.flatnonzero(may_meet(cone, square))) for cone in cones]
            rounds = [Conics.seen(cone, square) for cone in cones if cone.point.size]
            inside = np.r_[inside, p[side == INSIDE]]
            lines.append(square.lines(-columns(outward[:, None], met), p[met]))
        # What lies below the horizon is hidden as if by one more body.
        cut = np.flatnonzero(np.minimum.reduce([dot(points.normal, corner) for corner in square.corners]) <= 0)
        lines.append(replace(square.lines(-columns(points.normal[:, None], cut), cut), blocks=False))
        if self.half:  # so is the other half
            far = square.edges(*self._far_half(points))
            lines.append(replace(far, blocks=False))
        return Bodies(square, gathered(lines), rounds), inside

    def _far_half(self, points: ShadingPoints) -> tuple[Floats, Floats, Ints]:
        """The corners (3, 3, n) that do not shine, the points, and their numbers."""
        corner, ab, ac = (column(v) for v in (self.light.corner, self.light.ab, self.light.ac))
        corners = np.stack((corner + ab, corner + ab + ac, corner + ac), axis=1)
        return np.repeat(corners, points.count, axis=2), points.position, np.arange(points.count)

    def _square(self, points: ShadingPoints) -> Square:
        corner, ab, ac = (column(v) for v in (self.light.corner, self.light.ab, self.light.ac))
        return Square.seen(points.position, points.normal, corner, ab, ac)

    def _flats(self, points: ShadingPoints, square: Square, point: Ints, piece: Ints) -> tuple[list[Lines], Ints]:
        """Pieces as regions of the square, and points (k,) inside one."""
        x, normal = columns(points.position, point), columns(points.normal, point)
        row, width, on = self.flat.outline(x, normal, piece)
        lines = []
        for k in np.flatnonzero(np.bincount(width[width > 0])).tolist():
            mine = np.flatnonzero(width == k)
            vertices = columns(self.flat.vertices, self.flat.outlines.table[row[mine], :k].T)
            at = columns(x, mine)
            height = dot(columns(normal, mine)[:, None], vertices - at[:, None]).max(axis=0)
            room = 8 * PLANE_ULPS * (np.abs(vertices).max(axis=(0, 1)) + np.abs(at).max(axis=0))
            seen = np.flatnonzero(height > room)  # nothing hides from below the horizon, or in it
            lines.append(square.edges(columns(vertices, seen), columns(at, seen), point[mine[seen]]))
        met = np.flatnonzero(width == TOUCHING)
        lines.append(square.lines(-columns(self.flat.normals, piece[met]) * columns(on, met), point[met]))
        return lines, point[width == INSIDE]


def portions(work: Ints, point: Ints) -> list[tuple[Ints, slice]]:
    """Points (ascending) in portions of bounded work, and the slice of the pairs that holds theirs.

    The work of a point with m bodies is m + m^2/8: their edges are cut by each other.
    """
    if work.size == 0:
        return []
    first, last = np.searchsorted(point, work), np.searchsorted(point, work, side="right")
    many = last - first
    effort = np.cumsum(many + many * many // 8)
    bounds = np.r_[0, np.flatnonzero(np.diff(effort // EFFORT)) + 1, work.size]
    return [(work[a:b], slice(int(first[a]), int(last[b - 1]))) for a, b in pairwise(bounds)]
