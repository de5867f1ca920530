"""Radiance at pixel centres and in pieces of pixels, evaluated where it must be and interpolated where it is smooth.

Centres are taken far apart, then half as far, down to 2. A square of pixels between four of them that shows one region
throughout, and whose fourth differences are small (see `interpolation`), is filled by cubic interpolation. Of a square
that an edge or the image's border crosses every region stands for itself: what it shows there, pieces of pixels
included, is filled from the nearest 4 x 4 nodes of that region, from one side if it must be, once the point farthest
from them is evaluated and found where it was expected. Any other square is divided.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nusselt.renderer.vectors import Bools, Floats, Ints

from .interpolation import BETWEEN, cubic, cubic_bend, cubic_slope, error_bound
from .moments import Pieces

NODES = 32
"""Centres at least across the image, at first."""
SQUARES = 1024
"""Squares, of those that err most, that may spend what all may."""
CAREFUL = 3.0
"""How much less than differences allow is believed where one point was tried."""
MOST = 8.0
"""Of what values may err by in the mean, that one may."""
SHIFTS = np.array([(up, back) for up in (1, 0, 2, 3, -1, 4) for back in (1, 0, 2, 3, -1, 4)])
"""Of a square within, or one beside, the three by three between its nodes; the middle first."""
WITHIN_NODES = np.flatnonzero((SHIFTS >= 0).all(axis=1) & (SHIFTS <= 2).all(axis=1))

Evaluate = Callable[[Ints, Ints], Floats]
"""From numbers of pixels (n,) and of pieces (m,) to radiance (3, n + m)."""


@dataclass
class Filled:
    """What is known of an image's pixels and pieces.

    Parameters
    ----------
    value : (3, h, w) float64
        Radiance at the centres; NaN where nothing is to be known.
    bound : (h, w) float32
        Of its error, where it was interpolated; else 0.
    piece : (3, n) float64
        Radiance of the pieces: at their centroids, or their means where interpolated.
    piece_bound : (n,) float64
    """

    value: Floats
    bound: Floats
    piece: Floats
    piece_bound: Floats


@dataclass(frozen=True)
class Parts:
    """Pieces of regions that reflect.

    Parameters
    ----------
    pieces : Pieces
    alone, asked : (n,) bool
        Those that others tell nothing of; those that are evaluated in any case.
    """

    pieces: Pieces
    alone: Bools
    asked: Bools


TINY = 1e-30
"""Of a bound that is told from none."""


@dataclass
class _Budget:
    """Of the sum of squared errors.

    Parameters
    ----------
    left : float
    each : float
        What one square may take: a square of any size costs as much to divide.
    most : float
        Error that no value may have.
    """

    left: float
    each: float
    most: float

    @classmethod
    def of(cls, limit: float, values: int) -> _Budget:
        square = limit**2 * values
        return cls(square, square / SQUARES, MOST * limit)

    def possible(self, error: Floats, count: Floats | int) -> Bools:
        """Which errors of ``count`` values each may be accepted."""
        return np.asarray((error <= self.most) & (error**2 * count <= self.each))

    def takes(self, error: Floats, count: Floats | int) -> Bools:
        """Which errors of ``count`` values each are accepted; they are spent."""
        square = error**2 * count
        order = np.argsort(square, kind="stable")
        spent = np.cumsum(square[order])
        good = np.zeros(error.size, dtype=bool)
        good[order] = (spent <= self.left) & (square[order] <= self.each)
        good &= error <= self.most
        self.left -= float(square[good].sum())
        return good


@dataclass(frozen=True)
class _Groups:
    """What squares show of one region each, and the 4 x 4 nodes that speak for it."""

    square: Ints
    region: Ints
    row: Ints
    column: Ints
    top: Ints
    left: Ints
    rough: Floats

    def take(self, index: Ints) -> _Groups:
        return _Groups(*(getattr(self, name)[index] for name in self.__dataclass_fields__))

    def joined(self, other: _Groups) -> _Groups:
        return _Groups(*(np.append(getattr(self, name), getattr(other, name)) for name in self.__dataclass_fields__))


@dataclass(frozen=True)
class _Members:
    """Groups, and the pieces that belong to some: their numbers, and of which."""

    groups: _Groups
    piece: Ints
    of_piece: Ints


@dataclass(frozen=True)
class _Shares:
    """Groups, which of their square's pixels (k, step, step) belong to each, their pieces, and how many values."""

    groups: _Groups
    pixels: Bools
    piece: Ints
    of_piece: Ints
    count: Floats

    @classmethod
    def of(cls, groups: _Groups, pixels: Bools, members: _Members, area: Floats) -> _Shares:
        number = np.full(members.groups.row.size, -1)
        number[groups.square] = np.arange(groups.row.size)
        of_piece = number[members.of_piece]
        mine = np.flatnonzero(of_piece >= 0)
        piece, of_piece = members.piece[mine], of_piece[mine]
        count = pixels.sum(axis=(1, 2)) + np.bincount(of_piece, area[piece], groups.row.size)
        return cls(groups, pixels, piece, of_piece, count)

    def take(self, index: Ints) -> _Shares:
        number = np.full(self.groups.row.size, -1)
        number[index] = np.arange(index.size)
        of_piece = number[self.of_piece]
        mine = np.flatnonzero(of_piece >= 0)
        return _Shares(self.groups.take(index), self.pixels[index], self.piece[mine], of_piece[mine], self.count[index])


@dataclass(frozen=True)
class _Trials:
    """One point of each share, at which interpolation is worst: pixels and then pieces, and of which group each is."""

    shares: _Shares
    step: int
    group: Ints
    row: Ints
    column: Ints
    piece: Ints
    x: Floats
    y: Floats

    @classmethod
    def none(cls) -> _Trials:
        nothing, none = np.zeros(0, dtype=np.int64), np.zeros(0)
        shares = _Shares(_Groups(*(nothing,) * 7), np.zeros((0, 1, 1), dtype=bool), nothing, nothing, none)
        return cls(shares, 1, nothing, nothing, nothing, nothing, none, none)

    @classmethod
    def of(cls, shares: _Shares, pieces: Pieces, step: int) -> _Trials:
        groups, piece, of_piece = shares.groups, shares.piece, shares.of_piece
        count = groups.row.size
        if count == 0:
            return cls.none()
        inner = np.arange(step) / step
        down, across = (
            _remainder(place[:, None] + inner - first[:, None])
            for place, first in ((groups.row, groups.top), (groups.column, groups.left))
        )
        far = np.where(shares.pixels, down[:, :, None] + across[:, None, :], -1.0).reshape(count, -1)
        pixel, away = far.argmax(axis=1), far.max(axis=1)
        x, y = pieces.x[piece], pieces.y[piece]
        apart = _remainder((y - 0.5) / step - groups.top[of_piece]) + _remainder(
            (x - 0.5) / step - groups.left[of_piece]
        )
        order = np.lexsort((apart, of_piece))
        last = order[np.flatnonzero(np.diff(of_piece[order], append=-1))]
        last = last[apart[last] >= away[of_piece[last]]]
        by_pixel = np.ones(count, dtype=bool)
        by_pixel[of_piece[last]] = False
        group = np.flatnonzero(by_pixel)
        i, j = np.divmod(pixel[group], step)
        row, column = groups.row[group] * step + i, groups.column[group] * step + j
        x, y = np.append(column + 0.5, x[last]), np.append(row + 0.5, y[last])
        return cls(shares, step, np.append(group, of_piece[last]), row, column, piece[last], x, y)


def fill_centres(
    region: Ints, evaluate: Callable[[Ints], Floats], allowed: Callable[[Floats], float]
) -> tuple[Floats, Floats, Bools]:
    """Radiance (3, h, w) at all centres whose region is at least 0, a bound (h, w) of its error, and which pixels were
    interpolated; see `fill`.
    """
    nothing = np.zeros(0, dtype=bool)
    parts = Parts(Pieces.none(), nothing, nothing)
    found = fill(region, parts, lambda pixel, piece: evaluate(pixel), allowed, np.zeros(region.shape, dtype=bool))
    return found.value, found.bound, found.bound > 0


def fill(region: Ints, parts: Parts, evaluate: Evaluate, allowed: Callable[[Floats], float], alone: Bools) -> Filled:
    """Radiance at all centres whose region is at least 0, and of all pieces.

    Parameters
    ----------
    region : (h, w) int64
        Below 0 for pixels that are not to be filled.
    parts : Parts
    evaluate : callable
    allowed : callable
        From the first values (3, n) to the error that an interpolated value may have (sum of the channels).
    alone : (h, w) bool
        Pixels that others tell nothing of: no square that shows one is filled with its region.
    """
    work = _Work(region, parts, evaluate, alone)
    budget, step = None, work.step
    while step >= 2:
        values = work.ask(step)
        if budget is None:
            budget = _Budget.of(allowed(values), int((~work.known).sum()) + parts.pieces.cell.size)
        kept = budget.left * (0.5 if step > 2 else 0)
        budget.left -= kept
        work.judge_shares(budget)
        work.fill_squares(step, budget)
        work.try_shares(step, budget)
        budget.left += kept
        step //= 2
    if budget is not None:
        work.ask(1)
        work.judge_shares(budget)
    work.ask(1)
    return work.finished()


class _Work:
    def __init__(self, region: Ints, parts: Parts, evaluate: Evaluate, alone: Bools) -> None:
        pieces, self.own = parts.pieces, parts.alone
        self.shape, self.pieces, self.evaluate = region.shape, pieces, evaluate
        self.step = 2
        while self.step * 2 * NODES <= min(region.shape):
            self.step *= 2
        room = [(0, -size % self.step) for size in region.shape]
        self.kinds, dense = _dense(region, pieces.region)
        self.region = np.pad(dense[0], room, constant_values=-1)
        self.of_piece = dense[1]
        self.usable = np.where(np.pad(alone, room), -1, self.region) if alone.any() else self.region
        self.value = np.full((3, *self.region.shape), np.nan)
        self.known = self.region < 0
        self.bound = np.zeros(self.region.shape, dtype=np.float32)
        self.piece = np.full((3, pieces.cell.size), np.nan)
        self.piece_bound = np.zeros(pieces.cell.size)
        self.waits = ~parts.asked
        self.held, self.trials = np.zeros(self.region.shape, dtype=bool), _Trials.none()
        low, high = self.usable, self.region
        self.extent = {}
        size = 1
        while size < self.step:
            low, high, size = _halved(low, np.minimum), _halved(high, np.maximum), 2 * size
            self.extent[size] = low, high

    def finished(self) -> Filled:
        h, w = self.shape
        return Filled(self.value[:, :h, :w], self.bound[:h, :w], self.piece, self.piece_bound)

    def ask(self, step: int) -> Floats:
        """Evaluate what is not known of the centres ``step`` apart, and what is to be tried: the latter's radiance.

        With the step 1, all other pieces too.
        """
        row, column = np.nonzero(~(self.known | self.held)[::step, ::step])
        trials, width = self.trials, self.region.shape[1]
        place = np.append(row * step * width + column * step, trials.row * width + trials.column)
        piece = trials.piece
        if step == 1:
            waits = np.isnan(self.piece[0])
            waits[trials.shares.piece] = False
            piece = np.append(piece, np.flatnonzero(waits))
        r, c = np.divmod(place, width)
        value = self.evaluate(r * self.shape[1] + c, piece)
        for out, found in zip(self.value.reshape(3, -1), value, strict=True):
            out[place] = found[: place.size]
        self.piece[:, piece] = value[:, place.size :]
        self.known.reshape(-1)[place] = True
        return value

    def fill_squares(self, step: int, budget: _Budget) -> None:
        """Interpolate in squares of one region that are smooth enough."""
        squares = self._squares(step)
        self._fill_squares(squares.take(np.flatnonzero(budget.takes(squares.rough, step * step))), step)

    def try_shares(self, step: int, budget: _Budget) -> None:
        """What other squares show of one region each and may be smooth enough: one point of it is to be asked next."""
        shares = self._shares(step, budget)
        group, i, j = np.nonzero(shares.pixels)
        row, column = shares.groups.row[group] * step + i, shares.groups.column[group] * step + j
        self.held.reshape(-1)[row * self.region.shape[1] + column] = True
        self.trials = _Trials.of(shares, self.pieces, step)

    def judge_shares(self, budget: _Budget) -> None:
        """Interpolate in what was tried, if the points asked are where they were expected."""
        trials, step = self.trials, self.trials.step
        if trials.group.size == 0:
            return
        self.held[...] = False
        groups = trials.shares.groups
        value = np.hstack((self.value[:, trials.row, trials.column], self.piece[:, trials.piece]))
        missed = value - self._at(groups.take(trials.group), trials.x, trials.y, step)
        error = groups.rough / CAREFUL
        error[trials.group] = np.maximum(error[trials.group], np.sqrt((missed**2).sum(axis=0)))
        good = np.flatnonzero(budget.takes(error, trials.shares.count))
        self._fill_shares(replace(trials.shares, groups=replace(groups, rough=error)).take(good), step)
        self.trials = _Trials.none()

    def _squares(self, step: int) -> _Groups:
        """Squares that show one region, and have nodes."""
        low, high = self.extent[step]
        half = step // 2
        row, column = np.nonzero((low == high) & (low >= 0) & ~self.known[half::step, half::step])
        nothing = np.zeros(row.size, dtype=np.int64)
        squares = _Groups(nothing, low[row, column], row, column, nothing, nothing, nothing)
        return self._spoken_for(squares, step, WITHIN_NODES)

    def _fill_squares(self, squares: _Groups, step: int) -> None:
        rows, width = self.region.shape[0] // step, self.region.shape[1] // step
        patch = self._patches(squares, step)
        for out, values in zip(self.value, patch, strict=True):
            out.reshape(rows, step, width, step)[squares.row, :, squares.column] = values
        for flags, new in ((self.known, True), (self.bound, squares.rough[:, None, None] + TINY)):
            flags.reshape(rows, step, width, step)[squares.row, :, squares.column] = new

    def _shares(self, step: int, budget: _Budget) -> _Shares:
        """What other squares show of each region that has nodes."""
        members = self._members(step)
        groups = self._spoken_for(members.groups, step, np.arange(len(SHIFTS)))
        pixels = self._blocks(self.region, groups, step) == groups.region[:, None, None]
        pixels &= ~self._blocks(self.known, groups, step)
        shares = _Shares.of(groups, pixels, members, self.pieces.area)
        return shares.take(np.flatnonzero(budget.possible(groups.rough / CAREFUL, shares.count)))

    def _fill_shares(self, shares: _Shares, step: int) -> None:
        groups = shares.groups
        patch = self._patches(groups, step)
        k, i, j = np.nonzero(shares.pixels)
        place = (groups.row[k] * step + i) * self.region.shape[1] + groups.column[k] * step + j
        for out, values in zip(self.value.reshape(3, -1), patch, strict=True):
            out[place] = values[k, i, j]
        self.known.reshape(-1)[place] = True
        self.bound.reshape(-1)[place] = groups.rough[k] + TINY
        piece, of_piece = shares.piece, shares.of_piece
        self.piece[:, piece] = self._at_pieces(groups.take(of_piece), piece, step, self.pieces.covariance[:, piece])
        self.piece_bound[piece] = groups.rough[of_piece] + TINY
        self.waits[piece] = False

    def _members(self, step: int) -> _Members:
        """What the squares that are not filled show of each region."""
        low, high = self.extent[step]
        half = step // 2
        open_ = (high >= 0) & ((low != high) | ~self.known[half::step, half::step])
        row, column = np.nonzero(open_)
        number = np.full(open_.shape, -1)
        number[row, column] = np.arange(row.size)
        square, across = divmod(self.pieces.cell, self.shape[1])
        of_piece = number[square // step, across // step]
        region, known = (
            self._blocks(self.region, _at(row, column), step),
            self._blocks(self.known, _at(row, column), step),
        )
        key = np.arange(row.size)[:, None, None] * self.kinds + region
        present = np.zeros(row.size * self.kinds, dtype=bool)
        present[key[~known]] = True
        waiting = np.flatnonzero(self.waits & (of_piece >= 0))
        present[of_piece[waiting] * self.kinds + self.of_piece[waiting]] = True
        banned = self._blocks(self.usable, _at(row, column), step) != region
        present[key[banned]] = False
        lone = np.flatnonzero(self.own & (of_piece >= 0))
        present[of_piece[lone] * self.kinds + self.of_piece[lone]] = False
        group = np.flatnonzero(present)
        place = np.full(present.size, -1)
        place[group] = np.arange(group.size)
        where, kind = np.divmod(group, self.kinds)
        of = place[of_piece[waiting] * self.kinds + self.of_piece[waiting]]
        nothing = np.zeros(group.size, dtype=np.int64)
        groups = _Groups(np.arange(group.size), kind, row[where], column[where], nothing, nothing, nothing)
        return _Members(groups, waiting[of >= 0], of[of >= 0])

    def _blocks(self, array: Any, groups: _Groups, step: int) -> Any:
        """(k, step, step) of an image's squares."""
        h, w = array.shape
        return array.reshape(h // step, step, w // step, step)[groups.row, :, groups.column]

    def _nodes(self, step: int) -> tuple[Floats, Ints]:
        known = self.known[::step, ::step]
        return self.value[:, ::step, ::step], np.where(known, self.usable[::step, ::step], -1)

    def _spoken_for(self, groups: _Groups, step: int, shifts: Ints) -> _Groups:
        """Those that have 4 x 4 nodes of their region, with these, and what differences there allow."""
        value, region = self._nodes(step)
        label = _label(region)
        if label.size == 0:
            return groups.take(np.zeros(0, dtype=np.int64))
        up, back = SHIFTS[shifts].T[:, :, None]
        top, left = groups.row - up, groups.column - back
        inside = (top >= 0) & (top < label.shape[0]) & (left >= 0) & (left < label.shape[1])
        fits = inside & (label[np.where(inside, top, 0), np.where(inside, left, 0)] == groups.region)
        first = fits.argmax(axis=0)
        kept = np.flatnonzero(fits.any(axis=0))
        groups = groups.take(kept)
        top, left = top[first[kept], kept], left[first[kept], kept]
        r, c = top + np.clip(groups.row - top, 0, 2), left + np.clip(groups.column - left, 0, 2)
        corners = [(r + dy) * region.shape[1] + c + dx for dy in (0, 1) for dx in (0, 1)]
        needed = np.zeros(region.size, dtype=bool)
        for corner in corners:
            needed[corner] = True
        index = np.flatnonzero(needed)
        bound = np.zeros(region.size)
        bound[index] = error_bound(value.sum(axis=0), region, BETWEEN, index)
        # Differences are those of the channels' sum; the error is the norm.
        sum_, norm = (
            f(value.reshape(3, -1)[:, index]) for f in (lambda v: v.sum(axis=0), lambda v: np.sqrt((v * v).sum(axis=0)))
        )
        bound[index] *= np.where(sum_ > 0, norm / np.where(sum_ > 0, sum_, 1.0), 1.0)
        rough = np.maximum.reduce([bound[corner] for corner in corners])
        return replace(groups, top=top, left=left, rough=rough)

    def _stencils(self, groups: _Groups, step: int) -> Floats:
        """Values (3, k, 4, 4) at the groups' nodes."""
        value, _ = self._nodes(step)
        i = np.arange(4)
        return value[:, groups.top[:, None, None] + i[:, None], groups.left[:, None, None] + i]

    def _patches(self, groups: _Groups, step: int) -> Floats:
        """Interpolated values (3, k, step, step) at all centres of the groups' squares."""
        weights = cubic(np.arange(step) / step + np.arange(-1, 5)[:, None])  # by the square's place among its nodes
        nodes = self._stencils(groups, step).reshape(3, -1, 16)
        out = np.empty((3, groups.row.size, step * step))
        place = (groups.row - groups.top + 1) * 6 + groups.column - groups.left + 1
        for which in np.flatnonzero(np.bincount(place, minlength=1)).tolist():
            down, across = weights[which // 6], weights[which % 6]
            both = (down[:, None, :, None] * across[:, None, :]).reshape(step * step, 16)
            mine = np.flatnonzero(place == which)
            out[:, mine] = nodes[:, mine] @ both.T
        return np.maximum(out, 0.0).reshape(3, -1, step, step)  # radiance; cubics overshoot

    def _at(self, groups: _Groups, x: Floats, y: Floats, step: int) -> Floats:
        """Interpolated values (3, k) at one point of each group."""
        down, across = cubic((y - 0.5) / step - groups.top), cubic((x - 0.5) / step - groups.left)
        return np.einsum("ckij,ki,kj->ck", self._stencils(groups, step), down, across)

    def _at_pieces(self, groups: _Groups, piece: Ints, step: int, covariance: Floats) -> Floats:
        """Interpolated means (3, k) over pieces, each of its group: to second order about their centroids."""
        v, u = (self.pieces.y[piece] - 0.5) / step - groups.top, (self.pieces.x[piece] - 0.5) / step - groups.left
        xx, xy, yy = covariance / step**2
        down, across = cubic(v), cubic(u)
        weight = down[:, :, None] * across[:, None, :]
        weight += (xx / 2)[:, None, None] * down[:, :, None] * cubic_bend(u)[:, None, :]
        weight += (yy / 2)[:, None, None] * cubic_bend(v)[:, :, None] * across[:, None, :]
        weight += xy[:, None, None] * cubic_slope(v)[:, :, None] * cubic_slope(u)[:, None, :]
        return np.maximum(np.einsum("ckij,kij->ck", self._stencils(groups, step), weight), 0.0)


def _at(row: Ints, column: Ints) -> _Groups:
    return _Groups(row, row, row, column, row, row, row)


def _remainder(t: Floats) -> Floats:
    """Error of cubic interpolation between 0, 1, 2, 3 at t, but for the fourth derivative."""
    return np.abs(t * (t - 1) * (t - 2) * (t - 3)) / 24


def _halved(array: Any, take: np.ufunc) -> Any:
    """Least or largest of each two by two."""
    rows = take(array[::2], array[1::2])
    return take(rows[:, ::2], rows[:, 1::2])


def _label(region: Ints) -> Ints:
    """The region of each 4 x 4 of nodes, by its first; -1 where they show several, or none."""
    low = high = region
    for axis in (0, 1):
        size = region.shape[axis] - 3
        if size < 1:
            return np.zeros((0, 0), dtype=np.int64)
        cuts = [(slice(k, k + size),) if axis == 0 else (slice(None), slice(k, k + size)) for k in range(4)]
        low, high = np.minimum.reduce([low[cut] for cut in cuts]), np.maximum.reduce([high[cut] for cut in cuts])
    return np.where(low == high, low, -1)


def _dense(*regions: Ints) -> tuple[int, list[Ints]]:
    """How many regions there are, and arrays of their numbers in order; -1 stays."""
    most = max(int(region.max(initial=-1)) for region in regions)
    if most > sum(region.size for region in regions):
        kinds = np.unique(np.concatenate([region[region >= 0].ravel() for region in regions]))
        return kinds.size, [np.where(region < 0, -1, np.searchsorted(kinds, region)) for region in regions]
    seen = np.zeros(most + 2, dtype=bool)
    for region in regions:
        seen[np.maximum(region, -1)] = True
    seen[-1] = False
    number = np.where(seen, np.cumsum(seen) - 1, -1)
    return int(seen.sum()), [number[np.maximum(region, -1)] for region in regions]
