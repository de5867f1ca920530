"""The state of filling an image: what is known, what is planned, what is tried."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from nusselt.renderer.vectors import Bools, Floats, Ints, distinct

from .error_budget import CAREFUL, Budget
from .lattice import Lattice
from .moments import Pieces
from .squares import Groups, Members, Shares, Trials

FEW = 64
"""Regions that are not numbered anew."""
TINY = 1e-30
"""Of a bound that is told from none."""

Evaluate = Callable[[Ints, Ints], Floats]
"""From numbers of pixels (n,) and of pieces (m,) to radiance (c, n + m)."""


@dataclass
class Filled:
    """What is known of an image's pixels and pieces.

    Parameters
    ----------
    value : (c, h, w) float64
        Radiance at the centres; NaN where nothing is to be known.
    bound : (h, w) float32
        Of its error, where it was interpolated; else 0.
    piece : (c, n) float64
        Radiance of the pieces: at their centroids, or their means where interpolated.
    piece_bound : (n,) float64
    """

    value: Floats
    bound: Floats
    piece: Floats
    piece_bound: Floats


@dataclass(frozen=True, eq=False)
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


@dataclass(frozen=True, eq=False)
class Reach:
    """How far apart values may be, in pixels, to tell of a pixel (h, w), and of a piece (n,)."""

    pixel: Floats
    piece: Floats


@dataclass(frozen=True)
class Plan:
    """Squares to be interpolated from a lattice, and what is to be tried of others."""

    lattice: Lattice
    squares: Groups
    trials: Trials


class Filling:
    """An image being filled; arrays of pixels are padded to whole squares of the first step.

    ``known`` are pixels that need nothing more; see `fill`.
    """

    def __init__(
        self,
        region: Ints,
        parts: Parts,
        evaluate: Evaluate,
        alone: Bools,
        channels: int,
        step: int,
        reach: Reach | None,
    ) -> None:
        pieces, self.alone = parts.pieces, parts.alone
        self.shape, self.pieces, self.evaluate, self.step = region.shape, pieces, evaluate, step
        room = [(0, -size % self.step) for size in region.shape]
        self.kinds, dense = _dense(region, pieces.region)
        self.region = np.pad(dense[0], room, constant_values=-1)
        self.of_piece = dense[1]
        self.apart = np.where(np.pad(alone, room), -1, self.region) if alone.any() else self.region
        self.reach = reach if reach is None else Reach(np.pad(reach.pixel, room), reach.piece)
        self.value = np.full((channels, *self.region.shape), np.nan)
        self.known = self.region < 0
        self.bound = np.zeros(self.region.shape, dtype=np.float32)
        self.piece = np.full((channels, pieces.cell.size), np.nan)
        self.piece_bound = np.zeros(pieces.cell.size)
        self.waits = ~parts.asked
        low, high = self.apart, self.region
        self.extent = {}
        size = 1
        while size < self.step:
            low, high, size = _halved(low, np.minimum), _halved(high, np.maximum), 2 * size
            self.extent[size] = low if reach is None else self._least(size), high

    def usable(self, step: int) -> Ints:
        """Regions of pixels, -1 for those that centres ``step`` apart tell nothing of."""
        return self.apart if self.reach is None else np.where(self.reach.pixel < step, -1, self.apart)

    def _least(self, step: int) -> Ints:
        """The least of them in each square."""
        low = self.usable(step)
        for _ in range(step.bit_length() - 1):
            low = _halved(low, np.minimum)
        return np.asarray(low)

    def finished(self) -> Filled:
        h, w = self.shape
        # Whole arrays, not windows into padded ones: what is written to a reshaped window is lost.
        value, bound = (np.ascontiguousarray(v[..., :h, :w]) for v in (self.value, self.bound))
        return Filled(value, bound, self.piece, self.piece_bound)

    def ask(self, step: int, trials: Trials | None = None) -> Floats:
        """Evaluate what is not known of the centres ``step`` apart, and what is to be tried: their radiance.

        With the step 1, all other pieces too.
        """
        row, column = np.nonzero(~self.known[::step, ::step])
        width = self.region.shape[1]
        place: Ints = row * step * width + column * step
        piece: Ints = np.flatnonzero(np.isnan(self.piece[0]) & (step == 1))
        if trials:
            place, piece = np.append(place, trials.row * width + trials.column), trials.piece
        r, c = np.divmod(place, width)
        value = self.evaluate(r * self.shape[1] + c, piece)
        for out, found in zip(self.value.reshape(len(self.value), -1), value, strict=True):
            out[place] = found[: place.size]
        self.piece[:, piece] = value[:, place.size :]
        self.known.reshape(-1)[place] = True
        self.waits[piece] = False
        return value

    @property
    def left(self) -> int:
        """How many values are not known."""
        return int(np.count_nonzero(~self.known)) + int(np.count_nonzero(np.isnan(self.piece[0])))

    def planned(self, step: int) -> Plan:
        """What may be interpolated from the centres ``step`` apart, once those are known."""
        lattice = Lattice(self.value[:, ::step, ::step], self.usable(step)[::step, ::step], step)
        squares = self._squares(lattice)
        members = self._members(step, squares)
        groups = lattice.spoken_for(members.groups, False)
        pixels = self._blocks(self.region, groups, step) == groups.region[:, None, None]
        pixels &= ~self._blocks(self.known, groups, step)
        pixels[:, 0, 0] = False
        shares = Shares.of(groups, pixels, members, self.pieces.area)
        return Plan(lattice, squares, Trials.of(shares.take(np.flatnonzero(shares.count > 0)), self.pieces, step))

    def fill(self, plan: Plan, budget: Budget) -> None:
        """Interpolate in squares of one region that are smooth enough, and in what other squares show of one region
        each if the point asked there is where it was expected.
        """
        lattice, trials, step = plan.lattice, plan.trials, plan.lattice.step
        rough = lattice.rough(plan.squares)
        good = np.flatnonzero(budget.takes(rough, step * step))
        self._fill_squares(lattice, plan.squares.take(good), rough[good])
        groups = trials.shares.groups
        value = np.hstack((self.value[:, trials.row, trials.column], self.piece[:, trials.piece]))
        missed = value - lattice.at(groups.take(trials.group), trials.x, trials.y)
        error = lattice.rough(groups) / CAREFUL
        error[trials.group] = np.maximum(error[trials.group], np.sqrt((missed**2).sum(axis=0)))
        good = np.flatnonzero(budget.takes(error, trials.shares.count))
        self._fill_shares(lattice, trials.shares.take(good), error[good])

    def _squares(self, lattice: Lattice) -> Groups:
        """Squares that show one region, and have nodes around them."""
        low, high = self.extent[lattice.step]
        half = lattice.step // 2
        row, column = np.nonzero((low == high) & (low >= 0) & ~self.known[half :: lattice.step, half :: lattice.step])
        return lattice.spoken_for(Groups.of(low[row, column], row, column), True)

    def _fill_squares(self, lattice: Lattice, squares: Groups, rough: Floats) -> None:
        step = lattice.step
        rows, width = self.region.shape[0] // step, self.region.shape[1] // step
        patch = lattice.patches(squares)
        for out, values in zip(self.value, patch, strict=True):
            out.reshape(rows, step, width, step)[squares.row, :, squares.column] = values
        for flags, new in ((self.known, True), (self.bound, rough[:, None, None] + TINY)):
            flags.reshape(rows, step, width, step)[squares.row, :, squares.column] = new

    def _fill_shares(self, lattice: Lattice, shares: Shares, error: Floats) -> None:
        groups, step = shares.groups, lattice.step
        patch = lattice.patches(groups)
        k, i, j = np.nonzero(shares.pixels)
        place = (groups.row[k] * step + i) * self.region.shape[1] + groups.column[k] * step + j
        for out, values in zip(self.value.reshape(len(self.value), -1), patch, strict=True):
            out[place] = values[k, i, j]
        self.known.reshape(-1)[place] = True
        self.bound.reshape(-1)[place] = error[k] + TINY
        piece, of_piece = shares.piece, shares.of_piece
        self.piece[:, piece] = lattice.at_pieces(groups.take(of_piece), self.pieces.take(piece))
        self.piece_bound[piece] = error[of_piece] + TINY
        self.waits[piece] = False

    def _members(self, step: int, squares: Groups) -> Members:
        """What the squares that are not filled, nor among ``squares``, show of each region."""
        low, high = self.extent[step]
        half = step // 2
        open_ = (high >= 0) & ((low != high) | ~self.known[half::step, half::step])
        open_[squares.row, squares.column] = False
        row, column = np.nonzero(open_)
        number = np.full(open_.shape, -1)
        number[row, column] = np.arange(row.size)
        square, across = divmod(self.pieces.cell, self.shape[1])
        of_piece = number[square // step, across // step]
        mine = np.flatnonzero(of_piece >= 0)
        piece_key = np.full(of_piece.size, -1)
        piece_key[mine] = of_piece[mine] * self.kinds + self.of_piece[mine]
        here = Groups.of(number[row, column], row, column)
        region, known, usable = (self._blocks(v, here, step) for v in (self.region, self.known, self.usable(step)))
        key = np.arange(row.size)[:, None, None] * self.kinds + region
        present = np.zeros(row.size * self.kinds, dtype=bool)
        waiting = np.flatnonzero(self.waits & (of_piece >= 0))
        present[key[~known]] = True
        present[piece_key[waiting]] = True
        present[key[usable != region]] = False
        alone = self.alone if self.reach is None else self.alone | (self.reach.piece < step)
        present[piece_key[alone & (of_piece >= 0)]] = False
        group = np.flatnonzero(present)
        place = np.full(present.size, -1)
        place[group] = np.arange(group.size)
        where, kind = np.divmod(group, self.kinds)
        of = place[piece_key[waiting]]
        return Members(Groups.of(kind, row[where], column[where]), waiting[of >= 0], of[of >= 0])

    def _blocks(self, array: Any, groups: Groups, step: int) -> Any:
        """(k, step, step) of an image's squares."""
        h, w = array.shape
        return array.reshape(h // step, step, w // step, step)[groups.row, :, groups.column]


def first_step(region: Ints, nodes: int) -> int:
    """Pixels between centres that are so many at least across an image (h, w), or two."""
    step = 2
    while step * 2 * nodes <= min(region.shape):
        step *= 2
    return step


def _halved(array: Any, take: np.ufunc) -> Any:
    """Least or largest of each two by two."""
    rows = take(array[::2], array[1::2])
    return take(rows[:, ::2], rows[:, 1::2])


def _dense(*regions: Ints) -> tuple[int, list[Ints]]:
    """How many regions there are at most, and arrays of their numbers, in order if they are many; -1 stays."""
    most = max(int(region.max(initial=-1)) for region in regions)
    if most < FEW:
        return most + 1, [np.maximum(region, -1).astype(np.int32) for region in regions]
    if most > sum(region.size for region in regions):
        kinds = distinct(np.concatenate([region[region >= 0].ravel() for region in regions]))
        return kinds.size, [
            np.where(region < 0, -1, np.searchsorted(kinds, region)).astype(np.int32) for region in regions
        ]
    seen = np.zeros(most + 2, dtype=bool)
    for region in regions:
        seen[np.maximum(region, -1)] = True
    seen[-1] = False
    number = np.where(seen, np.cumsum(seen) - 1, -1).astype(np.int32)
    return int(seen.sum()), [number[np.maximum(region, -1)] for region in regions]  # the last is -1
