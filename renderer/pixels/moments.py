"""Exact area, centroid and covariance of every region in every cell that a visible edge crosses.

Along a horizontal line a region gains where the line crosses an edge into it and loses where it leaves; what
the cell starts with is seen at its left border. So with dy the rise of a bit with region L left and R right,

    area of r = (left border seen as r) + sum over bits of (1 - x) dy ([R = r] - [L = r])

and likewise for the higher moments, all polynomials along the bit: two Gauss nodes are exact. No polygon is
assembled, and every cell stands alone. What leaves at the right border is compared with what is seen there;
a cell where the two differ has lost an edge, and is reported.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TypeAlias

import numpy as np

from nusselt.renderer.geometry.ragged import expand
from nusselt.renderer.vectors import Floats, Ints, distinct

from .edge_fragments import Bits, one_by_one
from .regions import Regions

Grid: TypeAlias = tuple[int, int]
"""Cells in a pixel, across and down."""
PIXEL: Grid = (1, 1)
LEAST = 2e-6
"""Areas, in cells, below which a piece is dropped; the others share what it had."""
AGREE = 2e-5
"""Share of a border by which the check may differ: chords of curves are that far from them."""


@dataclass(frozen=True, eq=False)
class Edges:
    """Visible bits with the regions on their two sides, looking along increasing y."""

    bits: Bits
    left: Ints
    right: Ints

    @classmethod
    def joined(cls, *parts: Edges) -> Edges:
        """One after the other."""
        left, right = (np.concatenate([getattr(part, name) for part in parts]) for name in ("left", "right"))
        return cls(Bits.joined(*(part.bits for part in parts)), left, right)

    def take(self, index: Ints) -> Edges:
        """The edges ``index`` (k,)."""
        return Edges(self.bits.take(index), self.left[index], self.right[index])


@dataclass(frozen=True, eq=False)
class Pieces:
    """Regions within cells.

    Parameters
    ----------
    cell, region : (n,) int64
    area, x, y : (n,) float64
        Share of the cell, and centroid in grid units.
    covariance : (3, n) float64
        xx, xy, yy about the centroid, in square grid units.
    """

    cell: Ints
    region: Ints
    area: Floats
    x: Floats
    y: Floats
    covariance: Floats

    @classmethod
    def none(cls) -> Pieces:
        nothing, none = np.zeros(0, dtype=np.int64), np.zeros(0)
        return cls(nothing, nothing, none, none, none, np.zeros((3, 0)))

    def take(self, index: Ints) -> Pieces:
        """The pieces ``index`` (k,)."""
        return Pieces(*(getattr(self, part.name)[..., index] for part in fields(self)))


def upwards(bits: Bits, left: Ints, right: Ints) -> Edges:
    """Visible bits with the regions on their two sides, looking along each; turned to run upwards in y."""
    turned = bits.start[1] > bits.end[1]
    start, end = np.where(turned, bits.end, bits.start), np.where(turned, bits.start, bits.end)
    turned_bits = Bits(start, end, bits.cell, bits.reach)
    return Edges(turned_bits, np.where(turned, right, left), np.where(turned, left, right))


def visible_edges(bits: Bits, regions: Regions) -> Edges:
    """The bits whose two sides show different regions; each upwards in y."""
    d = bits.end - bits.start
    d = d / np.sqrt((d * d).sum(axis=0))
    x, y = (bits.start + bits.end) / 2
    across, down = bits.reach * d[1], bits.reach * d[0]
    left, right = np.split(regions.seen(np.append(x - across, x + across), np.append(y + down, y - down)), 2)
    seen = np.flatnonzero(left != right)
    return upwards(bits.take(seen), left[seen], right[seen])


@dataclass(frozen=True, eq=False)
class Borders:
    """Left and right borders of the cells that edges cross, each once, cut where edges meet them.

    Parameters
    ----------
    cells : (k,) int64
        In order.
    first, count : (2, k) int64
        The parts of the left and of the right border of each cell.
    low, high : (p,) float64
        From where to where a part reaches, from the cell's upper end.
    seen : (p,) int64
        Region in its middle.
    """

    cells: Ints
    first: Ints
    count: Ints
    low: Floats
    high: Floats
    seen: Ints

    @classmethod
    def of(cls, edges: Edges, width: int, scale: Grid, regions: Regions) -> Borders:
        """See `pieces_of`."""
        bits, cells = edges.bits, distinct(edges.bits.cell)
        names = _beside(cells, width)
        borders = distinct(names)
        owners, ys = [np.arange(borders.size)] * 2, [np.zeros(borders.size), np.ones(borders.size)]
        row, column = np.divmod(bits.cell, width)
        for name, at in zip(_beside(bits.cell, width), (column, column + 1), strict=True):
            for end in (bits.start, bits.end):
                on = np.flatnonzero(np.abs(end[0] - at) < 1e-7)
                owners.append(np.searchsorted(borders, name[on]))
                ys.append(np.clip(end[1][on] - row[on], 0, 1))
        who, y = np.concatenate(owners), np.concatenate(ys)
        order = one_by_one(who, y)
        who, y = who[order], y[order]
        kept = np.flatnonzero((who[1:] == who[:-1]) & (y[1:] - y[:-1] > 1e-9))
        who, low, high = who[kept], y[kept], y[kept + 1]
        row, column = np.divmod(borders[who], width + 1)
        seen = regions.seen(column / scale[0], (row + (low + high) / 2) / scale[1])
        which = np.searchsorted(borders, names)
        count = np.bincount(who, minlength=borders.size)
        return cls(cells, (np.cumsum(count) - count)[which], count[which], low, high, seen)

    def parts(self, side: int) -> tuple[Ints, Ints]:
        """Cells and parts of their left (0) or right (1) borders, as pairs (n,)."""
        owner, rank = expand(self.count[side])
        return owner, self.first[side][owner] + rank


def _beside(cells: Ints, width: int) -> Ints:
    """Names (2, k) of the left and of the right border of cells."""
    return np.asarray(cells + cells // width + np.array([[0], [1]]))


def pieces_of(edges: Edges, width: int, scale: Grid, regions: Regions) -> tuple[Pieces, Ints]:
    """Pieces of all cells that hold a visible bit, and the cells whose books do not balance.

    Parameters
    ----------
    width : int
        Cells in a row.
    scale : Grid
        Cells in a pixel, across and down.
    """
    return pieces_between(Borders.of(edges, width, scale, regions), edges, width, scale)


def pieces_between(borders: Borders, edges: Edges, width: int, scale: Grid) -> tuple[Pieces, Ints]:
    """The same, with the cells' borders known."""
    bits, cells = edges.bits, borders.cells
    row, column = np.divmod(bits.cell, width)
    owner = np.searchsorted(cells, bits.cell)
    dy = bits.end[1] - bits.start[1]
    sums = np.zeros((7, bits.cell.size))
    for node in (0.5 - 0.5 / np.sqrt(3), 0.5 + 0.5 / np.sqrt(3)):
        x = bits.start[0] + node * (bits.end[0] - bits.start[0]) - column
        y = bits.start[1] + node * dy - row
        rest, one, two = 1 - x, (1 - x * x) / 2, (1 - x * x * x) / 3
        sums += np.stack((rest, one, y * rest, two, y * one, y * y * rest, np.ones_like(x))) * (dy / 2)
    (who, enters), (far, leaves) = (borders.parts(side) for side in (0, 1))
    low, high = borders.low[enters], borders.high[enters]
    length, middle, square = high - low, (high**2 - low**2) / 2, (high**3 - low**3) / 3
    entering = np.stack((length, length / 2, middle, length / 3, middle / 2, square, length))
    leaving = np.zeros((7, far.size))
    leaving[6] = borders.low[leaves] - borders.high[leaves]
    key = np.concatenate((owner, owner, who, far))
    region = np.concatenate((edges.right, edges.left, borders.seen[enters], borders.seen[leaves]))
    values = np.hstack((sums, -sums, entering, leaving))
    base = int(region.max(initial=0)) + 2
    pair, inverse = np.unique(key * base + region + 1, return_inverse=True)
    total = np.stack([np.bincount(inverse, row, pair.size) for row in values])
    cell_of, region_of = pair // base, pair % base - 1
    area, x, y, xx, xy, yy, balance = total
    curved = np.zeros(cells.size)
    np.maximum.at(curved, owner, bits.reach * max(scale))
    wrong = (np.abs(balance) > AGREE + 4 * curved[cell_of]) | (area < -1e-6 - curved[cell_of])
    bad = cells[distinct(cell_of[wrong])]
    kept = np.flatnonzero(area > LEAST)
    cell, area = cells[cell_of[kept]], area[kept]
    x, y = np.clip(x[kept] / area, 0, 1), np.clip(y[kept] / area, 0, 1)
    covariance = np.stack((xx[kept] / area - x * x, xy[kept] / area - x * y, yy[kept] / area - y * y))
    row, column = np.divmod(cell, width)
    shared = area / np.bincount(cell_of[kept], area, cells.size)[cell_of[kept]]
    return Pieces(cell, region_of[kept], shared, column + x, row + y, covariance), bad
