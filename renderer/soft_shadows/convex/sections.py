"""What hides a parallelogram light from a point, as regions of the light's own square.

A light point is p + u ab + v ac, (u, v) in [0, 1]^2, p the corner as the shading point sees it. A plane through the
point cuts the square in the line a u + b v + c = 0, so that a convex cone is a convex region of the square however
far behind the point its body reaches, and nothing is ever projected. The coefficients are taken in double-double from
coordinates that are given exactly: each line lies where it should to the rounding of float64, and what coincides in
space coincides here to that rounding.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from nusselt.renderer.closed_forms import double_double as dd
from nusselt.renderer.closed_forms.circles.pairing import columns
from nusselt.renderer.vectors import Bools, Floats, Ints, cross, dot

NO_LINE = -1


@dataclass(frozen=True, eq=False)
class Square:
    """A light's square as n points see it.

    Parameters
    ----------
    p : (3, n) float64
        The corner, relative to each point.
    low : (3, n) float64
        What rounding took from ``p``.
    ab, ac : (3, 1) float64
        Its sides.
    normal : (3, n) float64
        The points'.
    """

    p: Floats
    low: Floats
    ab: Floats
    ac: Floats
    normal: Floats

    @classmethod
    def seen(cls, points: Floats, normal: Floats, corner: Floats, ab: Floats, ac: Floats) -> Square:
        """From points (3, n) with unit normals (3, n)."""
        p, low = dd.two_sum(np.broadcast_to(corner, points.shape), -points)
        return cls(p, low, ab, ac, normal)

    @property
    def corners(self) -> list[Floats]:
        """Four times (3, n), clockwise for points that the light faces."""
        return [self.p, self.p + self.ab, self.p + self.ab + self.ac, self.p + self.ac]

    def at(self, point: Ints, u: Floats, v: Floats) -> Floats:
        """Directions (3, k) to places (u, v) from the points (k,)."""
        return columns(self.p, point) + u * self.ab + v * self.ac

    def place(self, point: Ints, d: Floats) -> tuple[Floats, Floats]:
        """Where directions (3, k) meet the light's plane; nan where they do not."""
        n = cross(self.ab, self.ac)
        p = columns(self.p, point)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            ahead = dot(n, p) / dot(n, d)
            q = np.where(ahead > 0, d * ahead - p, np.nan)
            square = dot(n, n)
            return np.asarray(dot(cross(self.ac, n), q) / square), np.asarray(dot(cross(n, self.ab), q) / square)

    def sides(self) -> Floats:
        """Planes (3, 4, n) through the square's sides, pointing inwards.

        Of the sides themselves: two corners of a short one are all but parallel, and would give a plane beside it.
        """
        along = (self.ab, self.ac, -self.ab, -self.ac)
        return np.stack([cross(corner, side) for corner, side in zip(self.corners, along, strict=True)], axis=1)

    def cone(self) -> Floats:
        """Planes (3, 5, n) that hold what can matter: the sides', and the horizon."""
        return np.concatenate((self.sides(), self.normal[:, None]), axis=1)

    def edges(self, vertices: Floats, points: Floats, point: Ints) -> Lines:
        """Lines of the edges of closed loops of vertices (3, k, q) before points (3, q), of those that may matter.

        In float64 first: what then lies beyond one of its lines with all of the square is left out, and what is not
        known to PLACE is taken again in double-double.
        """
        start, step = vertices - points[:, None], np.roll(vertices, -1, axis=1) - vertices
        room = np.abs(start).max(axis=0) * np.abs(step).max(axis=0)
        lines, kept = self._rounded(cross(start, step), room, point)
        vague = self._vague(lines)
        if vague.size:
            of = kept[vague]
            corners = columns(vertices, of)
            arms = dd.two_sum(corners, -columns(points[:, None], of))
            sides = dd.two_sum(np.roll(corners, -1, axis=1), -corners)
            self._mend(lines, vague, dd.cross(arms, sides))
        return lines.reaching()

    def lines(self, planes: Floats, point: Ints) -> Lines:
        """Lines of planes (3, k, q) of unit normals through the points (q,), of those that may matter."""
        lines, kept = self._rounded(planes, np.ones(planes.shape[1:]), point)
        vague = self._vague(lines)
        if vague.size:
            self._mend(lines, vague, dd.exact(columns(planes, kept[vague])))
        return lines.reaching()

    def _rounded(self, plane: Floats, room: Floats, point: Ints) -> tuple[Lines, Ints]:
        """Lines in float64 of planes (3, k, q) that are products of the size ``room`` (k, q); and which are kept."""
        p = columns(self.p, point)
        a, b, c = dot(plane, self.ab[..., None]), dot(plane, self.ac[..., None]), dot(plane, p[:, None])
        reach = np.maximum(np.abs(p).max(axis=0), max(np.abs(self.ab).max(), np.abs(self.ac).max()))
        beyond = c + np.maximum(a, 0) + np.maximum(b, 0) < -4 * ROUNDING * room * reach
        kept = np.flatnonzero(~beyond.any(axis=0))
        point, plane, a, b, c, room = (columns(v, kept) for v in (point, plane, a, b, c, room))
        length = np.sqrt(dot(plane, plane))
        with np.errstate(divide="ignore", invalid="ignore"):
            turn = np.where(length > 0, room / length, np.where((room > 0) & (a != 0), np.inf, 0.0)).max(axis=0)
        place = ROUNDING * (turn + reach[kept] / self.nearest[point])
        size = np.maximum(np.maximum(np.abs(a), np.abs(b)), np.abs(c))
        size += size == 0
        return Lines(point, plane, a / size, b / size, c / size, place), kept

    def _vague(self, lines: Lines) -> Ints:
        """Pairs whose lines are not known to PLACE of the square as it is seen."""
        return np.flatnonzero(~(lines.place <= PLACE * self.width[lines.point]))

    def _mend(self, lines: Lines, index: Ints, plane: dd.Pair) -> None:
        """The same of planes in double-double, for the lines of some pairs (k,)."""
        point = lines.point[index]
        ab, ac = (dd.exact(v[:, :, None]) for v in (self.ab, self.ac))
        p = columns(self.p[:, None], point), columns(self.low[:, None], point)
        a, b, c = (dd.value(dd.dot(plane, v)) for v in (ab, ac, p))
        size = np.maximum(np.maximum(np.abs(a), np.abs(b)), np.abs(c))
        size += size == 0
        for v, mended in zip((lines.a, lines.b, lines.c), (a, b, c), strict=True):
            v[:, index] = mended / size
        lines.planes[..., index] = dd.value(plane)
        lines.place[index] = FINE * self.width[point]

    @cached_property
    def nearest(self) -> Floats:
        """At most the distance (n,) of the square's nearest place."""
        normal, middle = cross(self.ab, self.ac), self.p + 0.5 * (self.ab + self.ac)
        height = np.abs(dot(normal, self.p)) / np.sqrt(dot(normal, normal))
        return np.maximum(np.sqrt(dot(middle, middle)) - self.reach, height)

    @cached_property
    def slack(self) -> Floats:
        """By how much (n,) the v of a direction's place may be off.

        The direction is known to ROUND: that angle times its distance, over the cosine at the light's plane, is small
        beside the room, and may be more than the height of a light of a hair's width.
        """
        normal = cross(self.ab, self.ac)
        height = np.abs(dot(normal, self.p)) / np.sqrt(dot(self.ab, self.ab))  # times the square's, from v = 0 to 1
        farthest = np.maximum.reduce([dot(corner, corner) for corner in self.corners])
        return np.asarray(ROUND * farthest / height)

    @property
    def reach(self) -> float:
        """At least half its diagonal."""
        return float(0.5 * (np.sqrt(dot(self.ab, self.ab)) + np.sqrt(dot(self.ac, self.ac)))[0])

    @cached_property
    def width(self) -> Floats:
        """At least the angle (n,) under which it is seen, in radians, but for a factor of pi where it is wide."""
        return np.minimum(2 * self.reach / self.nearest, 1.0)


@dataclass(frozen=True, eq=False)
class HalfPlanes:
    """Convex regions of the square, one for each pair of a point and a body: where all lines are >= 0.

    Parameters
    ----------
    point : (q,) int64
        Ascending.
    planes : (3, k, q) float64
        Through the point, pointing inwards; zero where a region has fewer lines.
    a, b, c : (k, q) float64
        Their lines a u + b v + c >= 0.
    place : (q,) float64
        By which angle a line may lie from where it should, in radians.
    blocks : (q,) bool
        Bodies; the others are horizons.
    """

    point: Ints
    planes: Floats
    a: Floats
    b: Floats
    c: Floats
    place: Floats
    blocks: Bools

    @property
    def count(self) -> int:
        return self.point.size

    def take(self, index: Ints) -> HalfPlanes:
        """Some of the pairs, in order."""
        return HalfPlanes(*(columns(getattr(self, f.name), index) for f in fields(self)))

    def interval(self, pair: Ints, u: Floats) -> tuple[Floats, Floats, Ints, Ints]:
        """What regions (m,) hide at u (m,): from v = lo to hi, and the lines (m,) that bound it; NO_LINE for none.

        lo > hi where they hide nothing.
        """
        lo, hi = np.full(u.shape, -np.inf), np.full(u.shape, np.inf)
        below, above = np.full(u.shape, NO_LINE), np.full(u.shape, NO_LINE)
        for k in range(self.a.shape[0]):
            a, b, c = self.a[k, pair], self.b[k, pair], self.c[k, pair]
            rest = a * u + c
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                v = -rest / b
            rises, falls = (b > 0) & (v > lo), (b < 0) & (v < hi)
            lo, hi = np.where(rises, v, lo), np.where(falls, v, hi)
            below, above = np.where(rises, k, below), np.where(falls, k, above)
            hi = np.where((b == 0) & (rest < 0), -np.inf, hi)
        return lo, hi, below, above

    def segments(self) -> tuple[Ints, Ints, Floats, Floats]:
        """The lines' parts on their regions' rim and in the square: pair and line (m,), ends u, v (2, m)."""
        line, pair = np.nonzero((self.a != 0) | (self.b != 0))
        a, b, c = (v[line, pair] for v in (self.a, self.b, self.c))
        steep = np.abs(a) > np.abs(b)  # then v is the parameter, else u
        most = np.where(steep, a, b)
        slope, base = -np.where(steep, b, a) / most, -c / most
        along_u, along_v = np.where(steep, slope, 1.0), np.where(steep, 1.0, slope)
        base_u, base_v = np.where(steep, base, 0.0), np.where(steep, 0.0, base)
        ends = np.zeros(line.size), np.ones(line.size)
        _limit(slope, base, *ends)
        _limit(-slope, 1 - base, *ends)
        for k in range(self.a.shape[0]):  # its own line limits none
            a, b, c = self.a[k, pair], self.b[k, pair], self.c[k, pair]
            _limit(a * along_u + b * along_v, a * base_u + b * base_v + c, *ends)
        there = np.flatnonzero(ends[0] <= ends[1])
        t, line, pair, steep = columns(np.stack(ends), there), line[there], pair[there], steep[there]
        other = slope[there] * t + base[there]
        u, v = np.clip(np.where(steep, other, t), 0.0, 1.0), np.clip(np.where(steep, t, other), 0.0, 1.0)
        # What runs along v = 0 or 1 parts nothing, and does not tell how far a region reaches.
        inner = np.flatnonzero((v.max(axis=0) > ROUND) & (v.min(axis=0) < 1 - ROUND))
        return pair[inner], line[inner], columns(u, inner), columns(v, inner)


def _limit(along: Floats, rest: Floats, first: Floats, last: Floats) -> None:
    """Cut lines first <= t <= last, in [0, 1], to where along t + rest >= 0."""
    enters, leaves = along > ROUND, along < -ROUND
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        cut = -rest / along
    np.maximum(first, np.where(enters, cut, 0.0), out=first)
    np.minimum(last, np.where(leaves, cut, 1.0), out=last)
    last[(rest < -ROUND) & ~(enters | leaves)] = -1.0


ROUNDING = 12 * 2.0**-53
"""Rounding of a plane's components in float64, in products of the vectors' largest components, and of its line's."""
PLACE, FINE = 2e-13, 2e-15
"""How wrong a line may be as it is seen, relative to the square's width, in float64; and in double-double."""
ROUND = 1e-14
"""Rounding of a line's value where its coefficients are at most 1: lines that part by less are one."""


@dataclass(frozen=True, eq=False)
class Lines:
    """The same before they are `gathered`: of as many lines each."""

    point: Ints
    planes: Floats
    a: Floats
    b: Floats
    c: Floats
    place: Floats
    blocks: bool = True

    def reaching(self) -> Lines:
        """Those of regions of which more than rounding lies in the square: bodies may abut the light."""
        a, b = self.a, self.b
        beyond = (self.c + np.maximum(a, 0) + np.maximum(b, 0) <= ROUND) & ((a != 0) | (b != 0))
        kept = np.flatnonzero(~beyond.any(axis=0))
        if kept.size == self.point.size:
            return self
        a, b, c = (columns(v, kept) for v in (a, b, self.c))
        return Lines(self.point[kept], columns(self.planes, kept), a, b, c, self.place[kept], self.blocks)


def gathered(parts: list[Lines]) -> HalfPlanes:
    """Regions of any numbers of lines as one, by point."""
    widest = max((part.a.shape[0] for part in parts), default=1)
    order = np.argsort(np.concatenate([np.empty(0, dtype=np.int64), *(part.point for part in parts)]), kind="stable")

    def padded(v: Floats) -> Floats:
        return np.concatenate((v, np.zeros((*v.shape[:-2], widest - v.shape[-2], v.shape[-1]))), axis=-2)

    def whole(name: str, empty: Floats) -> Floats:
        return columns(np.concatenate([empty, *(padded(getattr(part, name)) for part in parts)], axis=-1), order)

    point = np.concatenate([np.empty(0, dtype=np.int64), *(part.point for part in parts)])[order]
    flat = np.zeros((widest, 0))
    a, b, c = (whole(name, flat) for name in "abc")
    place = np.concatenate([np.empty(0), *(part.place for part in parts)])[order]
    blocks = np.concatenate([np.empty(0, dtype=bool), *(np.full(part.point.size, part.blocks) for part in parts)])
    return HalfPlanes(point, whole("planes", np.zeros((3, widest, 0))), a, b, c, place, blocks[order])
