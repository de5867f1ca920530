"""How wrong the first value of a pixel or piece may be, from the values around it; see `refine` for the rules."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nusselt.renderer.vectors import Bools, Floats, Ints

from .moments import Pieces

ROWS = 128
"""Of pixels, handled at once: bounds the memory."""
ITEMS = 1 << 14
"""The same."""
STEEPER = 2.0
"""Times the change on one side of an item that the change on the other may be."""
AROUND = np.arange(9)[:, None] // 3 - 1, np.arange(9)[:, None] % 3 - 1
"""Rows and columns (9, 1) from a pixel to itself and to those around it."""


def means(centre: Floats, region: Ints) -> Floats:
    """Means over pixels without an edge, in place of their centres: with the Laplacian over 24 of their neighbours.

    Parameters
    ----------
    centre : (c, h, w) float64
        Radiance at the centres; afterwards the means.
    region : (h, w) int64
        Below 0 where there is none.
    """
    height = region.shape[0]
    source = centre.copy()
    for top in range(0, height, ROWS):
        rows = slice(top, min(top + ROWS, height))
        _add_bends(centre[:, rows], source[:, rows], region[rows], -1)
        inner = slice(max(top, 1), min(top + ROWS, height - 1))
        around = slice(inner.start - 1, inner.stop + 1)
        _add_bends(centre[:, inner], source[:, around], region[around], 0)
    return np.maximum(centre, 0.0, out=centre)


def _add_bends(out: Floats, source: Floats, region: Ints, axis: int) -> None:
    """Add second differences over 24 along an axis, within regions, to the places ``out`` that have neighbours."""
    before, middle, after = (
        (slice(None),) * (axis % 2) + (part,) for part in (slice(-2), slice(1, -1), slice(2, None))
    )
    here = region[middle]
    same = (here == region[before]) & (here == region[after]) & (here >= 0)
    for place, values in zip(out, source, strict=True):
        bend = values[before] + values[after]
        bend -= 2 * values[middle]
        bend /= 24
        inner = place[middle] if axis else place
        np.add(inner, bend, out=inner, where=same)


def summed(radiance: Floats) -> Floats:
    """Three channels (c, ...) summed: those of a grey, where one number stands for them."""
    return radiance.sum(axis=0) if radiance.shape[0] == 3 else math.sqrt(3) * radiance[0]


@dataclass(frozen=True, eq=False)
class Known:
    """First values: of whole pixels, and of pieces in the order of their pixel and region.

    Parameters
    ----------
    centre : (h, w) float64
        Radiance at whole pixels' centres, channels summed.
    region : (h, w) int64
    key : (n,) int64
        Of the pieces, ascending.
    value : (n,) float64
    base : int
    """

    centre: Floats
    region: Ints
    key: Ints
    value: Floats
    base: int

    @classmethod
    def of(cls, centre: Floats, region: Ints, pieces: Pieces, value: Floats) -> Known:
        """From radiance (c, h, w) and (c, n)."""
        base = int(max(region.max(initial=0), pieces.region.max(initial=0))) + 1
        key = pieces.cell * base + pieces.region
        order = np.argsort(key, kind="stable")
        return cls(summed(centre), region, key[order], summed(value)[order], base)

    def near(self, pixel: Ints, which: Ints, inside: Bools) -> tuple[Bools, Bools, Floats]:
        """Whether pixels (n,) show given regions as a whole, or as a piece; and the radiance there, else NaN."""
        whole = inside & (self.region.ravel()[pixel] == which)
        value = np.where(whole, self.centre.ravel()[pixel], np.nan)
        if self.key.size == 0:
            return whole, np.zeros(pixel.shape, dtype=bool), value
        key = pixel * self.base + which
        place = np.minimum(np.searchsorted(self.key, key), self.key.size - 1)
        part = inside & (self.key[place] == key)
        return whole, part, np.where(part, self.value[place], value)


def first_estimates(
    known: Known, pixel: Ints, which: Ints, x: Floats, y: Floats, value: Floats
) -> tuple[Floats, Floats]:
    """Estimates (n,) for items whose neighbourhood is broken by edges; the largest radiance (n,) of each region near.

    Parameters
    ----------
    known : Known
    pixel, which : (n,) int64
        Pixel and region of each item.
    x, y, value : (n,) float64
        Its place, and its radiance there.
    """
    found = np.zeros((2, pixel.size))
    for start in range(0, pixel.size, ITEMS):
        some = slice(start, start + ITEMS)
        found[:, some] = _estimates(known, pixel[some], which[some], x[some], y[some], value[some])
    return found[0], found[1]


def _estimates(known: Known, pixel: Ints, which: Ints, x: Floats, y: Floats, value: Floats) -> tuple[Floats, Floats]:
    centre, region, (dy, dx) = known.centre, known.region, AROUND
    row, column = np.divmod(pixel, region.shape[1])
    inner = region[row, column] == which
    r, c, inside = _inside(row + dy, column + dx, region.shape)
    same, part, near = known.near(r * region.shape[1] + c, which, inside)
    item = np.nonzero(same)[1]
    at = r[same], c[same]
    guess = np.full(same.shape, np.nan)
    guess[same] = centre[at] + _slope(known, *at, 0, 1) * (x[item] - at[1] - 0.5)
    guess[same] += _slope(known, *at, 1, 0) * (y[item] - at[0] - 0.5)
    told = np.isfinite(guess)
    for y2, x2 in ((2 * dy, dx), (dy, 2 * dx)):
        # What comes from a slope that was taken from the item's own row or column agrees with it, whatever that holds:
        # along an edge all may err alike.
        r2, c2, on = _inside(row + y2, column + x2, region.shape)
        told &= ~inner | (on & (region[r2, c2] == which)) | ((y2 == dy) & (x2 == dx))
    missed = np.where(told, np.abs(value - guess), 0.0).max(axis=0)
    others = ((same | part) & ((dy != 0) | (dx != 0))).any(axis=0)
    highest = value
    for axis in (dy[:, 0], dx[:, 0]):  # from pixels above and below, and from those at the sides
        low, high, heard = np.zeros((2, value.size)), np.zeros((2, value.size)), np.zeros((2, value.size), dtype=bool)
        for side, beside in enumerate((axis < 0, axis > 0)):
            low[side], high[side] = (f(value, f.reduce(near[beside])) for f in (np.fmin, np.fmax))
            heard[side] = told[beside].any(axis=0)
        span = high - low
        missed = np.maximum(missed, np.where(heard.any(axis=0), 0.0, high.max(axis=0) - low.min(axis=0)))
        # Where only one side tells, the other's change is to be like its: there may be a peak beside the edge.
        missed = np.maximum(missed, np.where(heard, 0.0, span - STEEPER * span[::-1]).max(axis=0))
        highest = np.maximum(highest, high.max(axis=0))
    return np.where(others, missed / 8, np.abs(value)), highest


def _inside(r: Ints, c: Ints, shape: tuple[int, ...]) -> tuple[Ints, Ints, Bools]:
    inside = (r >= 0) & (r < shape[0]) & (c >= 0) & (c < shape[1])
    return np.where(inside, r, 0), np.where(inside, c, 0), inside


def _slope(known: Known, r: Ints, c: Ints, dy: int, dx: int) -> Floats:
    """Central difference at pixels within one region, one-sided where it ends, NaN where it is a single pixel wide."""
    own, value = known.region[r, c], known.centre[r, c]

    def step(sign: int) -> Floats:
        r2, c2, on = _inside(r + sign * dy, c + sign * dx, known.region.shape)
        same = on & (own >= 0) & (known.region[r2, c2] == own)
        return np.where(same, sign * (known.centre[r2, c2] - value), np.nan)

    ahead, behind = step(1), step(-1)
    both = (ahead + behind) / 2
    return np.where(np.isfinite(both), both, np.where(np.isfinite(ahead), ahead, behind))
