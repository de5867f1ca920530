"""What several layers count more than once: int f (w - 1) where w > 1, exactly, from the order of the pieces.

Strips of the light lie between consecutive ends of pieces, so that no piece begins or ends inside one; pieces that
cross there change places (see `order`). So the number of layers w is known between any two neighbours, and where
(w - 1)+ steps along a piece, so does the integral: by Lambert's term of that part of the piece. Together with the rim
those parts bound the levels of (w - 1)+; the edges between strips cancel, but for those where pieces lie along them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.geometry.ragged import expand, take
from nusselt.renderer.vectors import Floats, Ints, column, dot

from .contour import Pieces, Rim, above_horizon, edge_terms
from .light_frame import LightFrame
from .order import BANDS, Order, Parts, change, swaps_in_bands

GRID = 2.0**-40
"""The ends of strips are kept to this share of the light: receiver i lives in [2 i, 2 i + 1] of one sorted list."""


@dataclass(frozen=True, eq=False)
class Lines:
    """Directed straight lines on the light, each with a weight: Lambert's terms are taken along them.

    Parameters
    ----------
    who : (m,) int64
        Receiver.
    p, q : (2, m) float64
        Ends on the light.
    weight : (m,) int64
    """

    who: Ints
    p: Floats
    q: Floats
    weight: Ints

    @classmethod
    def join(cls, *some: Lines) -> Lines:
        """All of them, those without weight left out."""
        who, p, q, weight = (
            np.concatenate([getattr(lines, name) for lines in some], axis=-1) for name in ("who", "p", "q", "weight")
        )
        k = np.flatnonzero(weight)
        return cls(take(who, k), take(p, k), take(q, k), take(weight, k))

    def sums(self, x: Floats, n: Floats, frame: LightFrame) -> tuple[Floats, Floats, Floats]:
        """For points x with normals n, (3, m): sums of terms, their doubts, and lengths on the light."""
        ab, ac, count = column(frame.light.ab), column(frame.light.ac), x.shape[1]
        first = take(frame.rim[:, :1] - x, self.who) + self.p[0] * ab + self.q[0] * ac
        dp, dq = self.p[1] - self.p[0], self.q[1] - self.q[0]
        term, doubt = edge_terms(first, dp * ab + dq * ac, take(n, self.who))
        size = np.abs(self.weight)
        every = (self.weight * term, size * doubt, size * (np.abs(dp) + np.abs(dq)))
        value, doubts, lengths = (np.bincount(self.who, v, minlength=count).astype(np.float64) for v in every)
        return value, doubts, lengths


@dataclass(frozen=True)
class Merging:
    """Neighbouring strips are taken as one, in which all is as on the line along its middle: the midpoint rule.

    Each is closed by itself. In a view of a bumpy ball of 100,000 triangles 4 of them, in 1/128 of the light, changed
    the radiance by 1.5e-5 of its RMS, 8 by 3.4e-5, 16 in 1/64 by 1.2e-4, 32 in 1/32 by 5e-4; in one of 2,200 triangles
    16 did by 1e-4, 32 by 3e-4.

    Parameters
    ----------
    most : int
        So many at most.
    shares : int
        Into which the light is cut across: only strips in one share are merged.
    """

    most: int
    shares: int

    def merged(self, bottom: Floats, top: Floats) -> tuple[Floats, Floats]:
        """Ends of merged strips, from those of all (s,); receiver i lives in [2 i, 2 i + 1]."""
        share = ((bottom + top) * (self.shares / 2)).astype(np.int64)
        start = np.flatnonzero(np.append(True, np.diff(share) != 0)[: share.size])
        nth = np.arange(share.size) - np.repeat(start, np.diff(np.append(start, share.size)))
        first = np.flatnonzero(nth % self.most == 0)
        return bottom[first], top[np.append(first[1:], share.size)[: first.size] - 1]


@dataclass(frozen=True, eq=False)
class Strips:
    """Strips of the lights of many points, in order, those that can have no overlap left out.

    Parameters
    ----------
    number : (s,) int64
        Among all strips: neighbours that join differ by 1.
    who : (s,) int64
        Receiver.
    low, high : (s,) float64
        Ends, of the light's q.
    left : (s,) int64
        Layers on the light's left.
    shut : (2, s) bool
        Whether the lower and the upper edge count: on the rim, and where pieces lie along them.
    first, count : (m,) int64
        For each piece the first of these strips that it spans, and how many it does.
    """

    number: Ints
    who: Ints
    low: Floats
    high: Floats
    left: Ints
    shut: NDArray[np.bool_]
    first: Ints
    count: Ints

    @classmethod
    def of(cls, cut: Pieces, rim: Rim, start: Ints, at: Floats, jump: Ints, merging: Merging | None) -> Strips:
        """With ``start`` layers before the first corner; ``at``, ``jump``: see `contour.on_left`."""
        base, each = 2.0 * cut.owner, 2.0 * np.arange(start.size)
        low, high = base + cut.q.min(axis=0), base + cut.q.max(axis=0)
        side = np.flatnonzero(at <= 1)
        turns = 2.0 * np.concatenate((cut.owner, cut.owner))[side] + at[side]
        corners = np.concatenate((each, each + 1, *(each + rim.q)))
        ends = np.sort(np.concatenate((corners, low, high, turns)))
        k = np.flatnonzero((np.diff(ends) > 0) & (ends[:-1] % 2 < 1))
        bottom, top = ends[k], ends[k + 1]
        if merging:
            bottom, top = merging.merged(bottom, top)
        count, line = bottom.size, (bottom + top) / 2 if merging else bottom  # on which it is told what a strip holds
        who = (bottom / 2).astype(np.int64)
        begin, stop = np.searchsorted(line, low), np.searchsorted(line, high)
        # Layers left of the light, and how many rise to their right: where there cannot be two, nothing overlaps.
        turn = np.searchsorted(line, turns)
        within = np.flatnonzero(
            take(np.append(who, start.size), turn) == (turns / 2).astype(np.int64)
        )  # else above all
        left: Ints = start[who] + _running(turn[within], jump[side][within], np.searchsorted(line, each), who)
        rises = cut.q[1] > cut.q[0]
        up = np.bincount(begin[rises], minlength=count + 1) - np.bincount(stop[rises], minlength=count + 1)
        good = np.flatnonzero(left + np.cumsum(up)[:count] > 1)
        bottom, top = bottom[good], top[good]
        number = np.concatenate(([0], np.cumsum(np.bincount(good, minlength=count).astype(np.int64))))
        shut: NDArray[np.bool_] = np.ones((2, good.size), dtype=bool)
        if not merging:
            along = np.flatnonzero((low == high) & (cut.p[0] != cut.p[1]))
            marks = np.unique(np.concatenate((corners, low[along], high[along])))
            shut = np.stack([take(marks, np.searchsorted(marks, v)) == v for v in (bottom, top)])
            shut |= take((rim.q != 0).any(axis=0), who[good])  # the horizon may be all but parallel to the strips
        who, left, first = who[good], left[good], number[begin]
        return cls(
            2 * good if merging else good, who, bottom - 2 * who, top - 2 * who, left, shut, first, number[stop] - first
        )


def extra_layers(
    cut: Pieces,
    rim: Rim,
    x: Floats,
    n: Floats,
    start: Ints,
    at: Floats,
    jump: Ints,
    frame: LightFrame,
    merging: Merging | None,
) -> tuple[Floats, Floats, Floats]:
    """int f (w - 1)+ over the light, (n,), and what its error is made of: see `Strips.of`.

    With ``merging``, nothing crosses in a strip.

    Returns
    -------
    value : (n,) float64
    doubt, lengths : (n,) float64
        Sums over the lines it is integrated along: see `contour.edge_terms`, and of their lengths on the light.
    """
    count = x.shape[1]
    strips = Strips.of(cut, rim, start, at, jump, merging)
    if strips.who.size == 0:
        return np.zeros(count), np.zeros(count), np.zeros(count)
    piece, offset = expand(strips.count)
    sides = _sides(x, n, frame, strips)
    parts = _parts(cut, piece, take(strips.first, piece) + offset, strips, sides, merging is not None)
    order = Order.of(parts, strips.left)
    weights = np.zeros((3, piece.size), dtype=np.int64)  # along the part, on the strip's lower edge, on its upper one
    weights[:, order.index] = change(order.right, order.step)
    crossing = [] if merging else _crossings(order, strips, weights)
    within = np.bincount(parts.strip, parts.step, minlength=strips.who.size).astype(np.int64)
    lines = Lines.join(
        _runs(parts, piece, weights[0], strips),
        *crossing,
        *_rim(strips, sides, np.maximum(strips.left - 1, 0), np.maximum(strips.left + within - 1, 0)),
        *_edges(strips, sides, parts, weights[1:]),
    )
    return lines.sums(x, n, frame)


def _crossings(order: Order, strips: Strips, weights: Ints) -> list[Lines]:
    """Along parts that change places; their weights are no more those of the whole, but may differ on either edge."""
    order = order.disordered()
    count = order.index.size
    if count == 0:
        return []
    middle, edges = (order.low + order.high) / 2, np.stack((order.low, order.high))
    last, moved = np.tile(change(order.right, order.step), (2, 1)), np.zeros(count, dtype=bool)
    (below, first), (above, second) = (order.groups(edge) for edge in edges)
    at, group = np.concatenate((below, above + count)), np.concatenate((first, second + count))
    found = []
    for bands in BANDS:
        if at.size == 0:
            break
        end, k = np.divmod(at, count)
        some = swaps_in_bands(middle[k], edges[end, k], order.step[k], order.right[k], group, bands)
        done = ~some.late | (bands == BANDS[-1])
        last[end[done], k[done]] = some.last[done]
        kept = np.flatnonzero(done[some.part])
        moved[k[some.part[kept]]] = True
        found.append((at[some.part[kept]], some.share[kept], some.p[kept], some.before[kept]))
        at, group = at[~done], group[~done]
    weights[1:, order.index] = last
    whole = np.flatnonzero(moved)
    weights[0, order.index[whole]] = 0
    rest = np.concatenate((whole, whole + count))
    found.append((rest, np.ones(rest.size), edges.ravel()[rest], last.ravel()[rest]))
    at, share, p, weight = (np.concatenate(v) for v in zip(*found, strict=True))
    sort = np.argsort(at, kind="stable")  # of each part to each edge, in turn
    at, share, p, weight = at[sort], share[sort], p[sort], weight[sort]
    fresh = np.diff(at, prepend=-1) != 0
    end, k = np.divmod(at, count)
    line = order.strip[k]
    low, high = strips.low[line], strips.high[line]
    centre, edge = (low + high) / 2, np.where(end == 1, high, low)
    q = np.where(share == 1, edge, centre + share * (edge - centre))
    p = np.stack((np.where(fresh, middle[k], np.roll(p, 1)), p))
    q = np.stack((np.where(fresh, centre, np.roll(q, 1)), q))
    return [Lines(strips.who[line], p, q, np.where(end == 1, weight, -weight))]


def _parts(cut: Pieces, piece: Ints, line: Ints, strips: Strips, sides: Floats, merged: bool) -> Parts:
    """Pieces where they pass the edges of strips, kept between the light's ``sides``."""
    rises = cut.q[1] > cut.q[0]
    (low, high), (bottom, top) = (np.where(rises, v, v[::-1]) for v in (cut.p, _kept(cut.q, cut.owner)))
    slope = np.divide(high - low, top - bottom, out=np.zeros(low.size), where=top > bottom)
    low, high, bottom, top, slope = (take(v, piece) for v in (low, high, bottom, top, slope))
    end = take(strips.high, line)
    first = low + slope * (take(strips.low, line) - bottom)
    last = np.where(end == top, high, low + slope * (end - bottom))
    if merged or sides[0].any() or not sides[1].all():
        first, last = (np.clip(v, *take(sides[:, k], line)) for k, v in enumerate((first, last)))
    return Parts(line, first, last, take(np.where(rises, 1, -1), piece))


def _kept(q: Floats, owner: Ints) -> Floats:
    """As the ends of strips are kept."""
    return (2.0 * owner + q) - 2.0 * owner


def _runs(parts: Parts, piece: Ints, weights: Ints, strips: Strips) -> Lines:
    """Along pieces, neighbouring parts with the same weight taken as one; ``parts`` are sorted by piece and strip."""
    k = np.flatnonzero(weights)
    piece, line, weight = take(piece, k), take(parts.strip, k), take(weights, k)
    number = take(strips.number, line)
    new = (np.diff(piece) != 0) | (np.diff(number) != 1) | (np.diff(weight) != 0)
    first = np.flatnonzero(np.concatenate((np.ones(min(k.size, 1), dtype=bool), new)))
    last = np.append(first[1:], k.size)[: first.size] - 1
    p = np.stack((take(parts.low, k[first]), take(parts.high, k[last])))
    q = np.stack((take(strips.low, line[first]), take(strips.high, line[last])))
    return Lines(take(strips.who, line[first]), p, q, weight[first])


def _rim(strips: Strips, sides: Floats, left: Ints, right: Ints) -> list[Lines]:
    """Along the light's left and right, and the edges of strips between them where layers overlap on the left."""
    q = np.stack((strips.low, strips.high))
    lines = [Lines(strips.who, sides[0], q, left), Lines(strips.who, sides[1], q, -right)]
    for end, weight in ((0, -left), (1, left)):
        level = np.stack((q[end], q[end]))
        lines.append(Lines(strips.who, sides[:, end], level, np.where(strips.shut[end], weight, 0)))
    return lines


def _edges(strips: Strips, sides: Floats, parts: Parts, weights: Ints) -> list[Lines]:
    """Along those edges of strips that count, from each part to the light's right."""
    lines = []
    for end, at, weight in ((0, parts.low, -weights[0]), (1, parts.high, weights[1])):
        k = np.flatnonzero(take(strips.shut[end], parts.strip) & (weight != 0))
        line = take(parts.strip, k)
        level = take((strips.low, strips.high)[end], line)
        p = np.stack((take(at, k), take(sides[1, end], line)))
        lines.append(Lines(take(strips.who, line), p, np.stack((level, level)), weight[k]))
    return lines


def _sides(x: Floats, n: Floats, frame: LightFrame, strips: Strips) -> Floats:
    """From which p to which the strips' edges lie above the horizon: (2, 2, s), the left and right of both edges."""
    count = strips.who.size
    if above_horizon(x, n, frame):
        return np.stack((np.zeros((2, count)), np.ones((2, count))))
    # No corner and no end of the horizon is inside a strip, but rounding may have one on an edge.
    x, n = take(x, strips.who), take(n, strips.who)
    height = strips.high - strips.low
    near, far = (np.stack(_span(x, n, frame, strips.low + share * height)) for share in (0.25, 0.75))
    step = (far - near) / 2
    return np.clip(np.stack((near - step, far + step), axis=1), 0, 1)


def _span(x: Floats, n: Floats, frame: LightFrame, q: Floats) -> tuple[Floats, Floats]:
    """From which p to which p the line q of the light lies above the horizon; equal if nowhere."""
    level = dot(n, frame.rim[:, :1] - x) + q * dot(n, column(frame.light.ac) + 0 * x)
    slope = dot(n, column(frame.light.ab) + 0 * x)
    at = np.divide(-level, slope, out=np.where(level >= 0, np.inf, -np.inf), where=slope != 0)
    low, high = np.where(slope > 0, at, 0.0), np.where(slope > 0, 1.0, np.where(slope < 0, at, np.sign(at)))
    return np.clip(low, 0, 1), np.clip(high, 0, 1)


def _running(at: Ints, jump: Ints, first: Ints, who: Ints) -> Ints:
    """Sum of the jumps at or before each strip, from its receiver's ``first`` strip on; ``who`` (strips,)."""
    total = np.cumsum(np.bincount(at, jump, minlength=who.size + 1))
    before = np.where(first > 0, total[np.maximum(first, 1) - 1], 0.0)
    return np.rint(total[: who.size] - before[who]).astype(np.int64)
