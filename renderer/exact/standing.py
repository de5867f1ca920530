"""What stands before a light, for a scene, a block of points, and each point."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..geometry import Ints
from ..lights import QuadLight
from ..shading import ShadingPoints
from ..shadows import PLANE_ULPS, Blockers
from ..vectors import Floats, dot
from .contour import Group
from .fans import Fan, fans_of
from .light_cone import Bools
from .occluders import Occluders, occluders
from .round_bodies import RoundBodies, round_bodies
from .shaft import in_shaft, reaching, shaft_planes

EFFORT = 1 << 14
"""Work handled at once: see `portions`."""
FEW = 4
"""Bodies for which a shaft costs more than it saves."""


@dataclass(frozen=True)
class Pairs:
    """Pairs of a point and a body.

    Parameters
    ----------
    point, body : (k,) int64
        Points ascending; pieces first, then round bodies, numbered on.
    awkward : (k,) bool
        Bodies that are left to sampling.
    """

    point: Ints
    body: Ints
    awkward: Bools


@dataclass(frozen=True)
class Standing:
    """Bodies that may matter.

    Parameters
    ----------
    flat : Occluders
    round : RoundBodies
    pieces, balls : (k,) int64
        Those of each that may.
    """

    flat: Occluders
    round: RoundBodies
    pieces: Ints
    balls: Ints

    @classmethod
    def before(cls, light: QuadLight, blockers: Blockers) -> Standing:
        """All that a light's blockers are part of."""
        flat, bodies = occluders(blockers.geometry, light), round_bodies(blockers.geometry, light)
        balls = blockers.ellipsoids[~bodies.behind[blockers.ellipsoids]]
        return cls(flat, bodies, flat.among(blockers), balls)

    @property
    def none(self) -> bool:
        return self.pieces.size + self.balls.size == 0

    def near(self, points: Floats, light: Floats) -> Standing:
        """Those in the shaft between points (3, n) and a light's corners (3, 4)."""
        if self.pieces.size + self.balls.size <= FEW:
            return self
        planes = shaft_planes(points, light)
        pieces = in_shaft(self.flat.center[:, self.pieces], self.flat.radius[self.pieces], *planes)
        balls = in_shaft(self.round.center[:, self.balls], self.round.reach[self.balls], *planes)
        return replace(self, pieces=self.pieces[pieces], balls=self.balls[balls])

    def pairs(self, points: ShadingPoints, planes: Floats, reached: bool) -> Pairs:
        """Bodies that reach into each point's cone; all of them with all if not ``reached``."""
        center = np.hstack((self.flat.center[:, self.pieces], self.round.center[:, self.balls]))
        radius = np.r_[self.flat.radius[self.pieces], self.round.reach[self.balls]]
        if reached:
            point, which = reaching(center, radius, points.position, planes, points.normal)
        else:
            point, which = np.nonzero(np.ones((points.count, radius.size), dtype=bool))
        body = np.r_[self.pieces, self.flat.count + self.balls][which]
        ball = body - self.flat.count
        others = (ball < 0) | (points.ellipsoid[point] != ball)  # no convex body hides what lies over its own horizon
        awkward = np.r_[np.zeros(self.flat.count, dtype=bool), self.round.awkward][body]
        return Pairs(point[others], body[others], awkward[others])

    def groups(self, points: ShadingPoints, number: Ints, pairs: Pairs, portion: slice) -> tuple[list[Group], Ints]:
        """Cones of the pairs of some points, the ``number``-th; and the points inside a body."""
        mine = pairs.point[portion]
        place = np.searchsorted(number, mine)
        there = np.flatnonzero(number[np.minimum(place, number.size - 1)] == mine)
        place, body = place[there], pairs.body[portion][there]
        flat = np.flatnonzero(body < self.flat.count)
        groups: list[Group] = []
        fans, inside = fans_of(points.position, self.flat, place[flat], body[flat])
        groups += [above for fan in fans if (above := _above(fan, points)).point.size]
        balls = np.flatnonzero(body >= self.flat.count)
        if balls.size:
            rounds, within = self.round.seen(points.position, place[balls], body[balls] - self.flat.count)
            groups += rounds
            inside = np.r_[inside, within]
        return groups, inside


def _above(fan: Fan, points: ShadingPoints) -> Fan:
    """Without the outlines that lie below the horizon, or in it to rounding."""
    height = dot(points.normal[:, None, fan.point], fan.corners)
    size = np.abs(fan.corners).max(axis=(0, 1)) + np.abs(points.position).max(axis=0)[fan.point]
    return fan.take(np.flatnonzero(height.max(axis=0) > 8 * PLANE_ULPS * size))


def portions(work: Ints, point: Ints) -> list[tuple[Ints, slice]]:
    """Points (ascending) in portions of bounded work, and the slice of the pairs that holds theirs.

    The work of a point with m bodies is m + m^2/8: each outline is cut by all others.
    """
    if work.size == 0:
        return []
    first, last = np.searchsorted(point, work), np.searchsorted(point, work, side="right")
    many = last - first
    effort = np.cumsum(many + many * many // 8)
    bounds = np.r_[0, np.flatnonzero(np.diff(effort // EFFORT)) + 1, work.size]
    return [(work[a:b], slice(int(first[a]), int(last[b - 1]))) for a, b in pairwise(bounds)]
