"""What is left of a light, in strips of its square: for coincidences of any kind, and for many occluders.

Between neighbouring places u where anything begins, ends or crosses, what hides the light are intervals of v whose
ends run along one curve each, so that what they leave is trapezoids. Each is closed by itself: a curve taken for its
neighbour where rounding cannot tell costs the area between the two, never the length of an edge. No tie is looked
for, and none has to be undone: equal, touching and abutting things are what they are, to rounding.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from nusselt.renderer.closed_forms.circles.pairing import columns, joined
from nusselt.renderer.vectors import Bools, Floats, Ints

from .breaks import conic_crossings, line_crossings
from .conics import Conics
from .sections import FINE, NO_LINE, ROUND, HalfPlanes, Square

BOTTOM, TOP = -1, -2
"""Numbers of the square's sides v = 0 and v = 1 among the curves."""


@dataclass(frozen=True, eq=False)
class Trapezoids:
    """Parts of the square between two curves.

    Parameters
    ----------
    point : (k,) int64
    u : (2, k) float64
        Where they begin and end.
    v : (2, 2, k) float64
        First below and above, then at the beginning and at the end. In a sliver of rounding they may change places.
    curve : (2, k) int64
        What bounds them below and above: BOTTOM, TOP, a line (below ``lines``), or a round body's cone.
    lit : (n,) bool
        Points from which no body hides anything; they have no trapezoids.
    """

    point: Ints
    u: Floats
    v: Floats
    curve: Ints
    lit: Bools

    def hidden(self, n: int) -> Bools:
        """Points (n,) that see nothing of it."""
        return np.asarray((np.bincount(self.point, minlength=n) == 0) & ~self.lit)

    def take(self, index: Ints) -> Trapezoids:
        """Some of them."""
        u, v, curve = (columns(w, index) for w in (self.u, self.v, self.curve))
        return Trapezoids(self.point[index], u, v, curve, self.lit)


@dataclass(frozen=True)
class Bodies:
    """All that stands before a light, for each of n points.

    Parameters
    ----------
    square : Square
    flats : HalfPlanes
    rounds : list of Conics
        Their numbers go on where those of ``flats`` end.
    """

    square: Square
    flats: HalfPlanes
    rounds: list[Conics]

    @property
    def count(self) -> int:
        return self.square.p.shape[1]

    @property
    def lines(self) -> int:
        """Curves below this number are lines: body + bodies x line."""
        return self.flats.a.size

    def owner(self) -> Ints:
        """Point of each body."""
        return np.concatenate([self.flats.point, *(r.point for r in self.rounds)])

    def curved(self) -> list[tuple[Conics, int, int]]:
        """Round bodies: their group, the number of its first curve, and of its first body."""
        sizes = np.cumsum([0, *(r.point.size for r in self.rounds)])
        return [(r, self.lines + int(k), self.flats.count + int(k)) for r, k in zip(self.rounds, sizes, strict=False)]

    def shift(self) -> Floats:
        """By which angles (n,) the bodies' curves may lie from where they should, summed."""
        lines, n = self.flats.a.shape[0], self.count
        curves = np.bincount(self.flats.point, minlength=n) * lines + 8.0
        out = np.bincount(self.flats.point, self.flats.place * lines, n).astype(np.float64)
        for group in self.rounds:
            many = np.bincount(group.point, minlength=n)
            out += many * ROUND
            curves += 2 * many
        # And each place on a curve is rounded as a part of the square.
        return np.asarray(out + FINE * curves * (2 * self.square.reach / self.square.nearest))

    def blocks(self) -> Bools:
        """Bodies that are no horizon."""
        return np.concatenate([self.flats.blocks, *(np.ones(r.point.size, dtype=bool) for r in self.rounds)])

    def interval(self, body: Ints, u: Floats) -> tuple[Floats, Floats, Ints, Ints]:
        """What bodies (m,) hide at u (m,), v = lo to hi, and the curves (m,) below and above."""
        lo, hi = np.full(u.shape, 2.0), np.full(u.shape, -1.0)
        below, above = np.full(u.shape, BOTTOM), np.full(u.shape, TOP)
        flat = np.flatnonzero(body < self.flats.count)
        lo[flat], hi[flat], *which = self.flats.interval(body[flat], u[flat])
        for out, line, side in zip((below, above), which, (BOTTOM, TOP), strict=True):
            out[flat] = np.where(line == NO_LINE, side, body[flat] + self.flats.count * line)
        for group, curve, first in self.curved():
            mine = np.flatnonzero((body >= first) & (body < first + group.point.size))
            pair = body[mine] - first
            lo[mine], hi[mine] = group.interval(pair, u[mine])
            below[mine] = above[mine] = curve + pair
        return lo, hi, below, above


def trapezoids(bodies: Bodies, shortcuts: bool) -> tuple[Bodies, Trapezoids]:
    """The bodies that reach into the light, and what is left of it; with ``shortcuts`` lit points are only named."""
    bodies, ends = _reaching(bodies)
    lit = (np.bincount(bodies.owner()[bodies.blocks()], minlength=bodies.count) == 0) & shortcuts
    point, u, first, last, body = _breaks(bodies, ends, lit)
    order = np.lexsort((u, point))
    fresh = np.r_[True, (np.diff(point[order]) != 0) | (np.diff(u[order]) != 0)][: order.size]
    rank = np.empty(order.size, dtype=np.int64)
    rank[order] = np.cumsum(fresh) - 1
    point, u = point[order][fresh], u[order][fresh]
    strip = np.r_[point[1:] == point[:-1], False][: point.size]  # the strip from one place to the next
    middle = u + 0.5 * np.diff(u, append=0.0)
    i, at = joined(np.arange(first.size), rank[first], rank[last] - rank[first])
    lo, hi, below, above = bodies.interval(body[i], middle[at])
    hides = np.flatnonzero((lo < hi) & (hi > 0) & (lo < 1))
    edge = np.flatnonzero(strip)
    sides = np.ones(edge.size)
    at = np.concatenate((edge, at[hides], edge))
    lo, hi = np.concatenate((0 * sides - 1, lo[hides], sides)), np.concatenate((0 * sides, hi[hides], 2 * sides))
    below = np.concatenate((np.full(edge.size, BOTTOM), below[hides], np.full(edge.size, TOP)))
    above = np.concatenate((np.full(edge.size, BOTTOM), above[hides], np.full(edge.size, TOP)))
    strip_of, gap_below, gap_above = _gaps(at, lo, hi, below, above)
    strip_of, until, gap_below, gap_above = _merged(strip_of, gap_below, gap_above, bodies.lines)
    where = np.stack((u[strip_of], u[until + 1]))
    return bodies, _shaped(bodies, point[strip_of], where, np.stack((gap_below, gap_above)), lit)


@dataclass(frozen=True, eq=False)
class _Ends:
    """Where flat bodies' rims run in the square.

    Parameters
    ----------
    pair, line : (k,) int64
    u, v : (2, k) float64
        See `HalfPlanes.segments`.
    low, high : (q,) float64
        Between which places u each body lies.
    """

    pair: Ints
    line: Ints
    u: Floats
    v: Floats
    low: Floats
    high: Floats


def _reaching(bodies: Bodies) -> tuple[Bodies, _Ends]:
    """The bodies that reach into the square, and where the flat ones' rims run."""
    flats = bodies.flats
    low, high = np.full(flats.count, np.inf), np.full(flats.count, -np.inf)
    for side in (0.0, 1.0):  # a body may reach out of the square there
        lo, hi, _, _ = flats.interval(np.arange(flats.count), np.full(flats.count, side))
        reaches = np.minimum(hi, 1.0) - np.maximum(lo, 0.0) > ROUND
        low[reaches], high[reaches] = np.minimum(low[reaches], side), np.maximum(high[reaches], side)
    pair, line, u, v = flats.segments()
    np.minimum.at(low, pair, u.min(axis=0))
    np.maximum.at(high, pair, u.max(axis=0))
    there = np.flatnonzero(high - low > ROUND)
    number = np.full(flats.count, -1)
    number[there] = np.arange(there.size)
    kept = np.flatnonzero(number[pair] >= 0)
    ends = _Ends(number[pair[kept]], line[kept], columns(u, kept), columns(v, kept), low[there], high[there])
    return replace(bodies, flats=flats.take(there)), ends


def _breaks(bodies: Bodies, ends: _Ends, lit: Bools) -> tuple[Ints, Floats, Ints, Ints, Ints]:
    """Points and places u (m,) where strips may begin; bodies, and the numbers of the places where each (k,) ends."""
    owner = bodies.owner()
    everywhere = np.flatnonzero(~lit)
    touching = [group.tangents() for group in bodies.rounds]
    low = np.concatenate([ends.low, *(t[1] for t in touching)])
    high = np.concatenate([ends.high, *(t[2] for t in touching)])
    found = conic_crossings(bodies.square, bodies.flats, ends.pair, ends.line, bodies.rounds)
    curved = [(owner[first + pair], u) for (_, _, first), (pair, u) in zip(bodies.curved(), found, strict=True)]
    for (_, _, start), (within, _, _) in zip(bodies.curved(), touching, strict=True):
        row, pair = np.nonzero(np.isfinite(within))
        curved.append((owner[start + pair], within[row, pair]))
    there = np.flatnonzero((low <= high) & ~lit[owner])
    crossed, crossings = line_crossings(bodies.flats, ends.pair, ends.line, ends.u, ends.v)
    own = bodies.flats.point[ends.pair]
    points = [everywhere, everywhere, owner[there], owner[there], own, own, crossed, *(c[0] for c in curved)]
    places = [
        0.0 * everywhere,
        0.0 * everywhere + 1,
        low[there],
        high[there],
        *ends.u,
        crossings,
        *(c[1] for c in curved),
    ]
    point, u = np.concatenate(points), np.concatenate(places)
    first = 2 * everywhere.size + np.arange(there.size)
    return point, u, first, first + there.size, there


def _gaps(at: Ints, lo: Floats, hi: Floats, below: Ints, above: Ints) -> tuple[Ints, Ints, Ints]:
    """Between the intervals of each strip: strip, and the curves below and above the gap."""
    order = np.lexsort((lo, at))
    at, lo, hi, below, above = at[order], lo[order], hi[order], below[order], above[order]
    farthest = np.arange(at.size)  # of the intervals up to here in the strip, that which reaches highest
    step = 1
    longest = np.bincount(at).max(initial=0)
    while step < longest:
        before, now = farthest[:-step], farthest[step:]
        better = (at[step:] == at[:-step]) & (hi[before] > hi[now])
        farthest = np.concatenate((farthest[:step], np.where(better, before, now)))
        step *= 2
    reached = farthest[:-1]
    k = np.flatnonzero((at[1:] == at[:-1]) & (hi[reached] < lo[1:]))
    return at[k], above[reached[k]], below[k + 1]


def _merged(strip: Ints, below: Ints, above: Ints, lines: int) -> tuple[Ints, Ints, Ints, Ints]:
    """Gaps of neighbouring strips between the same two lines as one: first and last strip, and the curves."""
    order = np.lexsort((strip, above, below))
    strip, below, above = strip[order], below[order], above[order]
    goes_on = (np.diff(strip) == 1) & (np.diff(below) == 0) & (np.diff(above) == 0)
    goes_on &= np.maximum(below, above)[1:] < lines
    start = np.flatnonzero(np.r_[True, ~goes_on][: strip.size])
    end = np.r_[start[1:], strip.size][: start.size] - 1
    return strip[start], strip[end], below[start], above[start]


def _shaped(bodies: Bodies, point: Ints, u: Floats, curve: Ints, lit: Bools) -> Trapezoids:
    """With the corners' v."""
    v = np.empty((2, 2, point.size))
    flats = bodies.flats
    for side, which in enumerate(curve):
        line = np.flatnonzero((which >= 0) & (which < bodies.lines))
        v[side][:, which == BOTTOM], v[side][:, which == TOP] = 0.0, 1.0
        k, pair = np.divmod(which[line], max(flats.count, 1))
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            v[side][:, line] = -(flats.a[k, pair] * columns(u, line) + flats.c[k, pair]) / flats.b[k, pair]
        for group, first, _ in bodies.curved():
            bend = np.flatnonzero((which >= first) & (which < first + group.point.size))
            pair = which[bend] - first
            for end in (0, 1):
                lo, hi = group.interval(pair, u[end, bend], meets=True)
                v[side, end, bend] = hi if side == 0 else lo
    return Trapezoids(point, u, np.clip(v, 0.0, 1.0), curve, lit)
