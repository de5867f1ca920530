"""The order in which pieces stand side by side in strips of the light, the layers between them, and their crossings.

Pieces are sorted by where they pass a strip's middle. Where they stand in that order on both of its edges, no two
cross inside. Elsewhere neighbours change places, from the middle towards either edge, until all are in the edge's
order: the soonest crossing first among neighbours. Both pieces of a pair pass the point where they change exactly, so
that what is summed along them stays closed whatever rounding does.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..geometry import Ints
from ..pairs import take
from ..vectors import Floats


@dataclass(frozen=True)
class Parts:
    """The parts of pieces in strips, each from its strip's lower edge to its upper one.

    Parameters
    ----------
    strip : (m,) int64
    low, high : (m,) float64
        Where on the strip's edges, of the light's p.
    step : (m,) int64
        1 if there is a layer more to the right than to the left, else -1.
    """

    strip: Ints
    low: Floats
    high: Floats
    step: Ints


@dataclass(frozen=True)
class Order:
    """Parts sorted by strip, and in each from left to right at its middle.

    Parameters
    ----------
    index : (m,) int64
        Which part.
    strip, step : (m,) int64
    low, high : (m,) float64
        As in `Parts`.
    right : (m,) int64
        Layers to the right of each.
    """

    index: Ints
    strip: Ints
    low: Floats
    high: Floats
    step: Ints
    right: Ints

    @classmethod
    def of(cls, parts: Parts, left: Ints) -> Order:
        """Of parts whose strips have ``left`` (s,) layers on the light's left."""
        # Strip and p in one integer: what is told apart too coarsely changes places later, like what crosses.
        bits = 62 - int(left.size).bit_length()
        middle = ((parts.low + parts.high) * (1 << (bits - 2))).astype(np.int64)
        index = np.argsort((parts.strip << bits) + middle)
        strip, low, high, step = (take(v, index) for v in (parts.strip, parts.low, parts.high, parts.step))
        total = np.cumsum(step)
        opening = np.flatnonzero(np.diff(strip, prepend=-1))
        before = (total - step)[opening] - left[strip[opening]]
        right = total - np.repeat(before, np.diff(np.append(opening, total.size)))
        return cls(index, strip, low, high, step, right)

    def disordered(self) -> Ints:
        """Those in strips on whose edges they stand in another order."""
        past = (self.low[1:] < self.low[:-1]) | (self.high[1:] < self.high[:-1])
        pair = np.flatnonzero(past & (self.strip[1:] == self.strip[:-1]))
        bad = np.zeros(int(self.strip.max(initial=0)) + 1, dtype=bool)
        bad[self.strip[pair]] = True
        return np.flatnonzero(take(bad, self.strip))

    def taken(self, k: Ints) -> Order:
        """The parts at positions k."""
        return Order(*(take(v, k) for v in (self.index, self.strip, self.low, self.high, self.step, self.right)))


def change(right: Ints, step: Ints) -> Ints:
    """What (w - 1)+ is more to the right of parts than to their left."""
    found: Ints = np.maximum(right - 1, 0) - np.maximum(right - step - 1, 0)
    return found


TRIES = (1, 4, 16, None)
"""Within how many places pairs change in turn, try after try; at last all of a strip's. Hardly one strip in a hundred
is left after the second."""


@dataclass(frozen=True)
class Walk:
    """What m parts pass through from the middle of their strips to both edges: first all downwards, then all upwards.

    Parameters
    ----------
    part, weight : (k,) int64
        Of each stretch along which something ended: which of the 2 m, and what (w - 1)+ was more to its right.
    share, p : (2, k) float64
        Where it began and ended: how far towards the edge, and across the light.
    begin, start : (2 m,) float64
        Where the last stretch of each begins, alike: 0 for those whose weight never changed.
    edge : (2 m,) float64
        Where each reaches the edge.
    last : (2 m,) int64
        And with what weight.
    moved : (m,) bool
        Whether the weight of a part changes anywhere.
    late : (m,) bool
        Whether it is in a strip in which some part changed places at a crossing before its last one: out of turn.
    """

    part: Ints
    weight: Ints
    share: Floats
    p: Floats
    begin: Floats
    start: Floats
    edge: Floats
    last: Ints
    moved: NDArray[np.bool_]
    late: NDArray[np.bool_]


def walk(order: Order, far: int | None) -> Walk:
    """Of whole strips, with the crossings of pairs in turn that are ``far`` places or less apart; None for all.

    Swaps of different parts may come in any order. So if every part has its own in turn, all is as it was in turn.
    """
    middle, edge = np.tile((order.low + order.high) / 2, 2), np.concatenate((order.low, order.high))
    way = edge - middle
    count = middle.size
    # By position: which part stands there, its edge, its step, and layers to the right; one more ends the last strip.
    who = np.arange(count + 1)
    at_edge, step, right = np.append(edge, np.inf), np.tile(order.step, 2), np.tile(order.right, 2)
    apart = np.tile(np.append(np.diff(order.strip) != 0, True), 2)
    # By part: where its present stretch began.
    begin, start, moved = np.zeros(count), middle.copy(), np.zeros(count, dtype=bool)
    latest, late = np.zeros(count), np.zeros(count, dtype=bool)
    strip = np.concatenate((2 * order.strip, 2 * order.strip + 1))
    soonest = np.full(
        count + 2 * (far or 1), np.inf
    )  # of the pair that begins at each position; empty ones on either side
    pairs = np.flatnonzero(~apart & (at_edge[1:] < at_edge[:-1]))
    found: list[tuple[Any, ...]] = []
    while pairs.size:
        first, second = who[pairs], who[pairs + 1]
        gap = np.maximum(middle[second] - middle[first], 0)
        when = gap / (gap + (edge[first] - edge[second]))
        soonest[pairs + (far or 1)] = when
        chosen = _soonest_of_all(strip[pairs], when) if far is None else _soonest_near(soonest, pairs, far)
        soonest[pairs + (far or 1)] = np.inf
        at, when, first, second = pairs[chosen], when[chosen], first[chosen], second[chosen]
        late[first[when < np.maximum(latest[first], latest[second])]] = True
        latest[first] = latest[second] = when
        old = change(right[at], step[at]), change(right[at + 1], step[at + 1])
        right[at] += step[at + 1] - step[at]
        for v in (who, at_edge, step):
            v[at], v[at + 1] = v[at + 1], v[at]
        new = change(right[at + 1], step[at + 1]), change(right[at], step[at])
        # Where layers lie over layers the order does not matter.
        k = np.flatnonzero(old[0] != new[0])
        when, first, second = when[k], first[k], second[k]
        flat = np.where(np.abs(way[first]) <= np.abs(way[second]), first, second)  # they meet where the flatter one is
        meet = middle[flat] + when * way[flat]
        for one, weight in ((first, old[0][k]), (second, old[1][k])):
            found.append((one, weight, begin[one], when, start[one], meet))
            begin[one], start[one], moved[one] = when, meet, True
        pairs = np.concatenate((pairs[~chosen], np.maximum(at - 1, 0), at + 1))
        pairs.sort()
        pairs = pairs[(np.diff(pairs, prepend=-1) > 0) & (at_edge[pairs + 1 - (pairs == count)] < at_edge[pairs])]
        pairs = pairs[~apart[pairs]]
    last = np.empty(count, dtype=np.int64)
    last[who[:-1]] = change(right, step)
    none = np.empty(0, dtype=np.int64)
    joined = [np.concatenate((none, *v)) for v in zip(*found, strict=True)] or [none] * 6
    part, weight, *ends = joined
    share, p = np.stack(ends[:2]), np.stack(ends[2:])
    half = count // 2
    strips = np.zeros(int(order.strip.max()) + 1, dtype=bool)
    strips[order.strip[late[:half] | late[half:]]] = True
    moved = moved[:half] | moved[half:]
    return Walk(part.astype(np.int64), weight, share, p, begin, start, edge, last, moved, strips[order.strip])


def _soonest_near(when: Floats, pairs: Ints, far: int) -> NDArray[np.bool_]:
    """Which ``pairs`` change before all within ``far`` places, the first of equals; ``when`` begins ``far`` early."""
    own = when[pairs + far]
    chosen: NDArray[np.bool_] = own < when[pairs + far - 1]
    for away in range(-far, far + 1):
        if away not in (0, -1):
            chosen &= own <= when[pairs + far + away]
    return chosen


def _soonest_of_all(strip: Ints, when: Floats) -> NDArray[np.bool_]:
    """The first of the soonest pairs of each strip, which stand together."""
    opening = np.flatnonzero(np.diff(strip, prepend=-1))
    which = np.repeat(np.arange(opening.size), np.diff(np.append(opening, strip.size)))
    ties = np.flatnonzero(when == np.minimum.reduceat(when, opening)[which])
    chosen = np.zeros(strip.size, dtype=bool)
    chosen[ties[np.diff(which[ties], prepend=-1) > 0]] = True
    return chosen
