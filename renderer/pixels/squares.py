"""What squares of pixels show of each region: who is in them, and which point tells most."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from nusselt.renderer.vectors import Bools, Floats, Ints

from .moments import Pieces


@dataclass(frozen=True, eq=False)
class Groups:
    """What squares show of one region each, and the 4 x 4 nodes that speak for it."""

    square: Ints
    region: Ints
    row: Ints
    column: Ints
    top: Ints
    left: Ints

    @classmethod
    def of(cls, region: Ints, row: Ints, column: Ints) -> Groups:
        """Regions (k,) in squares, before nodes are looked for."""
        nothing = np.zeros(row.size, dtype=np.int64)
        return cls(np.arange(row.size), region, row, column, nothing, nothing)

    def take(self, index: Ints) -> Groups:
        return Groups(*(getattr(self, part.name)[index] for part in fields(self)))


@dataclass(frozen=True, eq=False)
class Members:
    """Groups, and the pieces that belong to some: their numbers, and of which."""

    groups: Groups
    piece: Ints
    of_piece: Ints


@dataclass(frozen=True, eq=False)
class Shares:
    """Groups, which of their square's pixels (k, step, step) belong to each, their pieces, and how many values."""

    groups: Groups
    pixels: Bools
    piece: Ints
    of_piece: Ints
    count: Floats

    @classmethod
    def of(cls, groups: Groups, pixels: Bools, members: Members, area: Floats) -> Shares:
        number = np.full(members.groups.row.size, -1)
        number[groups.square] = np.arange(groups.row.size)
        of_piece = number[members.of_piece]
        mine = np.flatnonzero(of_piece >= 0)
        piece, of_piece = members.piece[mine], of_piece[mine]
        count = pixels.sum(axis=(1, 2)) + np.bincount(of_piece, area[piece], groups.row.size)
        return cls(groups, pixels, piece, of_piece, count)

    def take(self, index: Ints) -> Shares:
        number = np.full(self.groups.row.size, -1)
        number[index] = np.arange(index.size)
        of_piece = number[self.of_piece]
        mine = np.flatnonzero(of_piece >= 0)
        return Shares(self.groups.take(index), self.pixels[index], self.piece[mine], of_piece[mine], self.count[index])


@dataclass(frozen=True, eq=False)
class Trials:
    """One point of each share, at which interpolation is worst: pixels and then pieces, and of which group each is."""

    shares: Shares
    group: Ints
    row: Ints
    column: Ints
    piece: Ints
    x: Floats
    y: Floats

    @classmethod
    def of(cls, shares: Shares, pieces: Pieces, step: int) -> Trials:
        groups, piece, of_piece = shares.groups, shares.piece, shares.of_piece
        count = groups.row.size
        inner = np.arange(step) / step
        down, across = (
            _remainder(place[:, None] + inner - first[:, None])
            for place, first in ((groups.row, groups.top), (groups.column, groups.left))
        )
        far = np.where(shares.pixels, down[:, :, None] + across[:, None, :], -1.0).reshape(count, step * step)
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
        return cls(shares, np.append(group, of_piece[last]), row, column, piece[last], x, y)


def _remainder(t: Floats) -> Floats:
    """Error of cubic interpolation between 0, 1, 2, 3 at t, but for the fourth derivative."""
    return np.abs(t * (t - 1) * (t - 2) * (t - 3)) / 24
