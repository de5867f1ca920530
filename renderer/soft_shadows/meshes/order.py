"""The order in which pieces stand side by side in strips of the light, the layers between them, and their crossings.

Pieces are sorted by where they pass a strip's middle. Where they stand in that order on both of its edges, no two
cross inside. Elsewhere neighbours change places, from the middle towards either edge, until all are in the edge's
order: the soonest crossing first among neighbours. Both pieces of a pair pass the point where they change exactly, so
that what is summed along them stays closed whatever rounding does.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nusselt.renderer.geometry.ragged import take
from nusselt.renderer.vectors import Bools, Floats, Ints


@dataclass(frozen=True, eq=False)
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


@dataclass(frozen=True, eq=False)
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
        index = _by_place(parts.strip, (parts.low + parts.high) / 2, left.size)
        strip, low, high, step = (take(v, index) for v in (parts.strip, parts.low, parts.high, parts.step))
        total = np.cumsum(step)
        opening = np.flatnonzero(np.diff(strip, prepend=-1))
        before = (total - step)[opening] - left[strip[opening]]
        right = total - np.repeat(before, np.diff(np.append(opening, total.size)))
        return cls(index, strip, low, high, step, right)

    def disordered(self) -> Order:
        """Those in strips on whose edges they stand in another order."""
        past = (self.low[1:] < self.low[:-1]) | (self.high[1:] < self.high[:-1])
        pair = np.flatnonzero(past & (self.strip[1:] == self.strip[:-1]))
        bad = np.zeros(int(self.strip.max(initial=0)) + 1, dtype=bool)
        bad[self.strip[pair]] = True
        k = np.flatnonzero(take(bad, self.strip))
        return Order(*(take(v, k) for v in (self.index, self.strip, self.low, self.high, self.step, self.right)))

    def groups(self, edge: Floats) -> tuple[Ints, Ints]:
        """Parts that may change places before the ``edge`` (m,) of their strips, and to where the order matters.

        Groups are as small as nobody passes from one to another. Where even all the steps down of a group together
        leave a layer, the order in it has no part in (w - 1)+.

        Returns
        -------
        k : (g,) int64
            Positions.
        group : (g,) int64
            The first position of each one's group.
        """
        along = 2.0 * self.strip + edge
        slack = 2.0**-50 * (2 + float(along[-1]))
        to_left = np.maximum.accumulate(along)
        to_right = np.minimum.accumulate(along[::-1])[::-1]
        opening = np.flatnonzero(np.append(True, to_left[:-1] < to_right[1:] - slack))
        size = np.diff(np.append(opening, edge.size))
        down = np.add.reduceat((self.step < 0).astype(np.int64), opening)
        wanted = (size > 1) & ((self.right - self.step)[opening] - down < 1)
        group = np.repeat(np.where(wanted, opening, -1), size)
        k = np.flatnonzero(group >= 0)
        return k, group[k]


def _by_place(owner: Ints, p: Floats, count: int) -> Ints:
    """Order by owner, of ``count``, and by p in [0, 1], to 2^-40 or less.

    Both in one integer, which is sorted several times as fast. What is told apart too coarsely changes places at once.
    """
    bits = 62 - int(count).bit_length()
    return np.argsort((owner << bits) + (p * (1 << (bits - 1))).astype(np.int64))


def change(right: Ints, step: Ints) -> Ints:
    """What (w - 1)+ is more to the right of parts than to their left."""
    found: Ints = np.maximum(right - 1, 0) - np.maximum(right - step - 1, 0)
    return found


BANDS = (1, 6, 24, 96, 384)
"""Try after try for groups with crossings out of turn: one part in eight the first time, one in a hundred the third, at
last those where three pieces meet in one point, to rounding."""


@dataclass(frozen=True, eq=False)
class Swaps:
    """How parts change places between their order at the beginning and that at the end of their ways.

    Parameters
    ----------
    part : (k,) int64
        Of each change of weight, in turn for each part: which.
    share, p : (k,) float64
        How far on its way, and where across the light.
    before : (k,) int64
        Its weight until there: what (w - 1)+ was more to its right.
    last : (g,) int64
        The weights at the end.
    late : (g,) bool
        Of a part whose crossing comes before the last one at which it or the other changed places: out of turn.
        Swaps of different parts may come in any order, so that if none is late all is as it was in turn.
    """

    part: Ints
    share: Floats
    p: Floats
    before: Ints
    last: Ints
    late: Bools


def swaps(begin: Floats, end: Floats, step: Ints, right: Ints, group: Ints) -> Swaps:
    """Of parts (g,) sorted by group and by where they begin; ``right`` of each are so many layers."""
    way, count = end - begin, begin.size
    # By position: which part stands there, its end, its step, and layers to the right; one more ends the last group.
    who, to, step, right = np.arange(count + 1), np.append(end, np.inf), step.copy(), right.copy()
    apart = np.append(np.diff(group) != 0, (True, True))
    latest, late = np.zeros(count), np.zeros(count, dtype=bool)
    soonest = np.full(count + 2, np.inf)  # of the pair that begins at each position; an empty one on either side
    pairs = np.flatnonzero(~apart[:-1] & (to[1:] < to[:-1]))
    found: list[tuple[Any, ...]] = []
    while pairs.size:
        first, second = who[pairs], who[pairs + 1]
        gap = np.maximum(begin[second] - begin[first], 0)
        when = gap / (gap + (end[first] - end[second]))
        soonest[pairs + 1] = when
        chosen = (when < soonest[pairs]) & (when <= soonest[pairs + 2])
        soonest[pairs + 1] = np.inf
        at, when, first, second = pairs[chosen], when[chosen], first[chosen], second[chosen]
        late[first] |= when < np.maximum(latest[first], latest[second])
        latest[first] = latest[second] = when
        before = change(right[at], step[at]), change(right[at + 1], step[at + 1])
        right[at] += step[at + 1] - step[at]
        for v in (who, to, step):
            v[at], v[at + 1] = v[at + 1], v[at]
        # Where layers lie over layers the order does not matter.
        k = np.flatnonzero(before[0] != change(right[at + 1], step[at + 1]))
        when, first, second = when[k], first[k], second[k]
        flat = np.where(np.abs(way[first]) <= np.abs(way[second]), first, second)  # they meet where the flatter one is
        meet = begin[flat] + when * way[flat]
        found += [(first, when, meet, before[0][k]), (second, when, meet, before[1][k])]
        pairs = np.concatenate((pairs[~chosen], np.maximum(at - 1, 0), at + 1))
        pairs.sort()
        pairs = pairs[(np.diff(pairs, prepend=-1) > 0) & ~apart[pairs]]
        pairs = pairs[to[pairs + 1] < to[pairs]]
    last = np.empty(count, dtype=np.int64)
    last[who[:-1]] = change(right, step)
    none = np.empty(0)
    found.append((none.astype(np.int64), none, none, none.astype(np.int64)))
    part, when, meet, weight = (np.concatenate(v) for v in zip(*found, strict=True))
    sort = np.argsort(part, kind="stable")
    return Swaps(part[sort], when[sort], meet[sort], weight[sort], last, late)


def swaps_in_bands(begin: Floats, end: Floats, step: Ints, right: Ints, group: Ints, bands: int) -> Swaps:
    """The same, with the ways cut into ``bands``, at whose beginnings parts are sorted anew; late are whole groups."""
    count = begin.size
    opening = np.flatnonzero(np.diff(group, prepend=-1))
    number = np.repeat(np.arange(opening.size), np.diff(np.append(opening, count)))
    out_of_turn = np.zeros(opening.size, dtype=bool)
    if bands == 1:
        found = swaps(begin, end, step, right, group)
        out_of_turn[number[found.late]] = True
        return replace(found, late=out_of_turn[number])
    p = begin + np.arange(bands + 1)[:, None] / bands * (end - begin)
    p[-1] = end
    band, part = np.divmod(np.arange(bands * count), count)
    sort = _by_place(band * opening.size + number[part], p[:-1].ravel(), bands * opening.size)
    band, part = band[sort], part[sort]
    steps = step[part]
    total = np.cumsum(steps).reshape(bands, count)
    ahead = (total - steps.reshape(bands, count))[:, opening] - (right - step)[opening]
    layers = (total - ahead[:, number]).ravel()
    found = swaps(p[band, part], p[band + 1, part], steps, layers, band * opening.size + number[part])
    first, last = np.empty((2, bands, count), dtype=np.int64)
    first[band, part], last[band, part] = change(layers, steps), found.last
    # Of two in one place either may be the first, here or there: one that ends a band and begins the next otherwise.
    other, whose = np.nonzero(last[:-1] != first[1:])
    which = np.concatenate((part[found.part], whose))
    at = np.concatenate((band[found.part] + found.share, other + 1.0))
    in_band = np.concatenate((band[found.part], other))
    where = np.concatenate((found.p, p[other + 1, whose]))
    before = np.concatenate((found.before, last[other, whose]))
    sort = np.lexsort((in_band, which))  # stable: in a band in turn, and at its end last
    out_of_turn[number[part[found.late]]] = True
    return Swaps(which[sort], at[sort] / bands, where[sort], before[sort], last[-1], out_of_turn[number])
