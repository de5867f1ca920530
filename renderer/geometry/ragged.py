"""Pair lists: which of many boxes hold which of many points of the plane, without a loop over either.

The points are sorted into the unit cells of the plane once; a box is the rectangle of cells it touches, and
holds the runs of points in them. Where all points lie near their cells' centres, as pixel centres do, a box
touches a cell only if it reaches that part: most small boxes then touch none, and cost nothing more. Lists are
made a block at a time: the memory is the block's.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.vectors import Bools, Floats, Ints

BLOCK = 1 << 18
"""Pairs handled at once: bounds the memory, and fits the cache."""

MAX_CELLS = 1 << 20


def expand(counts: Ints) -> tuple[Ints, Ints]:
    """For counts (m,): the owner of each of sum(counts) entries, and its number among the owner's."""
    owner = np.repeat(np.arange(counts.size), counts)
    return owner, np.arange(owner.size) - np.repeat(np.cumsum(counts) - counts, counts)


def take(values: NDArray[Any], index: Ints) -> Any:
    """values[..., index], three times as fast: indices are not checked, only clipped."""
    return np.take(values, index, axis=-1, mode="clip")


@dataclass(frozen=True, eq=False)
class Cells:
    """Points of the plane, sorted into unit cells.

    Parameters
    ----------
    low : (2,) float64
        Corner of the first cell: a whole number.
    shape : tuple of int
        Cells along x and y.
    inner : (4,) float64
        Which part of their cells the points lie in: least and greatest offset along x, then along y.
    order : (n,) int64
        Points, cell by cell, row by row.
    start : (cells + 1,) int64
        Where each cell's run begins in ``order``.
    """

    low: Floats
    shape: tuple[int, int]
    inner: Floats
    order: Ints
    start: Ints

    @classmethod
    def of(cls, x: Floats, y: Floats) -> Cells | None:
        """Cells of the points (x, y), each (n,); None where they would be too many."""
        low = np.floor([x.min(), y.min()])
        width, height = (np.floor([x.max(), y.max()]) - low + 1).astype(float).tolist()
        if not width * height <= MAX_CELLS:
            return None
        x, y = x - low[0], y - low[1]
        column, row = np.floor(x), np.floor(y)
        inner = np.array([(x - column).min(), (x - column).max(), (y - row).min(), (y - row).max()])
        cell = (row * width + column).astype(np.int64)
        count = np.bincount(cell, minlength=int(width * height))
        narrow = cell.astype(np.uint16) if count.size <= 1 << 16 else cell  # two bytes are sorted by radix
        start = np.concatenate(([0], np.cumsum(count)))
        return cls(low, (int(width), int(height)), inner, np.argsort(narrow, kind="stable"), start)

    def in_boxes(self, x0: Floats, x1: Floats, y0: Floats, y1: Floats) -> Iterator[tuple[Ints, Ints]]:
        """Pairs (box, point) of all points in the closed boxes [x0, x1] x [y0, y1], and of some near them.

        Boxes come in rising order. Bounds are (m,) and may be infinite.
        """
        left, wide = self._touched(x0, x1, 0)
        bottom, high = self._touched(y0, y1, 1)
        box = np.flatnonzero((wide > 0) & (high > 0))
        left, wide, bottom, high = (v[box] for v in (left, wide, bottom, high))
        total = np.cumsum(wide * high)
        begin = 0
        while begin < box.size:
            end = int(np.searchsorted(total, (total[begin - 1] if begin else 0) + BLOCK, side="right"))
            part = slice(begin, max(end, begin + 1))
            run, row = expand(high[part])  # cells of a row stand together, and so do their points
            cell = (bottom[part][run] + row) * self.shape[0] + left[part][run]
            first = self.start[cell]
            again, offset = expand(self.start[cell + wide[part][run]] - first)
            yield box[part][run][again], self.order[first[again] + offset]
            begin = part.stop

    def in_frames(self, at: Floats, x0: Floats, x1: Floats, y0: Floats, y1: Floats) -> Iterator[tuple[Ints, Ints]]:
        """The same of places ``at`` (2, frames, n) instead of the points, frame by frame: all near their points.

        Points are then numbered through all frames.
        """
        whole = replace(self, inner=np.array([0.0, 1.0, 0.0, 1.0]))
        box, point = (np.concatenate(v) for v in zip(*whole.in_boxes(x0, x1, y0, y1), strict=True))
        cell = np.floor(at[:, 0]) - self.low[:, None]
        reach = 1e-9 * (1 + max(self.shape))
        (left, right), (bottom, top) = (
            (take(v[0], box) - take(corner, point) - reach, take(v[1], box) - take(corner, point) + reach)
            for v, corner in (((x0, x1), cell[0] + self.low[0]), ((y0, y1), cell[1] + self.low[1]))
        )
        for number in range(at.shape[1]):
            inner = at[:, number] - self.low[:, None] - cell
            (least_x, least_y), (most_x, most_y) = inner.min(axis=1), inner.max(axis=1)
            k = np.flatnonzero((left <= most_x) & (right >= least_x) & (bottom <= most_y) & (top >= least_y))
            yield take(box, k), take(point, k) + number * at.shape[2]

    def _touched(self, low: Floats, high: Floats, axis: int) -> tuple[Ints, Ints]:
        """First cell and number of cells whose points the intervals can hold."""
        least, most = self.inner[2 * axis], self.inner[2 * axis + 1]
        slack = 1e-9 * (1 + self.shape[axis])  # of low - self.low, in cells
        first = np.maximum(np.ceil(low - (self.low[axis] + most + slack)), 0)
        last = np.minimum(np.floor(high - (self.low[axis] + least - slack)), self.shape[axis] - 1)
        first, last = np.minimum(first, 1e6), np.maximum(last, -1e6)  # bounds may be infinite
        return first.astype(np.int64), (last - first).astype(np.int64) + 1


def any_within(count: Ints, x0: Ints, x1: Ints, y0: Ints, y1: Ints) -> Bools:
    """Whether rectangles (n,) of cells, x0 to x1 and y0 to y1 without those, hold any counted in a grid (h, w)."""
    total = np.zeros(np.add(count.shape, 1), dtype=np.int64)
    total[1:, 1:] = count.cumsum(axis=0).cumsum(axis=1)
    return np.asarray(total[y1, x1] - total[y0, x1] - total[y1, x0] + total[y0, x0] > 0)
