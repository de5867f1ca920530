"""How wrong the first value of a pixel or piece may be, from the values around it; see `refine` for the rules."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.renderer.vectors import Bools, Floats, Ints

from .moments import Pieces

ROWS = 128
"""Of pixels, handled at once: bounds the memory."""
AROUND = [(dy, dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1)]


def means(centre: Floats, region: Ints) -> Floats:
    """Means over pixels without an edge, in place of their centres: with the Laplacian over 24 of their neighbours.

    Parameters
    ----------
    centre : (3, h, w) float64
        Radiance at the centres; afterwards the means.
    region : (h, w) int64
        Below 0 where there is none.
    """
    height = region.shape[0]
    for out in centre:
        source = out.copy()
        for top in range(0, height, ROWS):
            rows = slice(top, min(top + ROWS, height))
            _add_bends(out[rows], source[rows], region[rows], -1)
            inner = slice(max(top, 1), min(top + ROWS, height - 1))
            around = slice(inner.start - 1, inner.stop + 1)
            _add_bends(out[inner], source[around], region[around], 0)
        np.maximum(out, 0.0, out=out)
    return centre


def _add_bends(out: Floats, source: Floats, region: Ints, axis: int) -> None:
    """Add second differences over 24 along an axis, within regions, to the places ``out`` that have neighbours."""
    before, middle, after = (
        (slice(None),) * (axis % 2) + (part,) for part in (slice(-2), slice(1, -1), slice(2, None))
    )
    here = region[middle]
    same = (here == region[before]) & (here == region[after]) & (here >= 0)
    bend = source[before] + source[after]
    bend -= 2 * source[middle]
    bend /= 24
    place = out[middle] if axis else out
    np.add(place, bend, out=place, where=same)


@dataclass(frozen=True)
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
        base = int(max(region.max(initial=0), pieces.region.max(initial=0))) + 1
        key = pieces.cell * base + pieces.region
        order = np.argsort(key, kind="stable")
        return cls(centre, region, key[order], value[order], base)

    def near(self, pixel: Ints, which: Ints, inside: Bools) -> tuple[Bools, Bools, Floats]:
        """Whether pixels (n,) show given regions as a whole, or as a piece; and the radiance there, else NaN."""
        whole = inside & (self.region.ravel()[pixel] == which)
        value = np.where(whole, self.centre.ravel()[pixel], np.nan)
        if self.key.size == 0:
            return whole, np.zeros(pixel.size, dtype=bool), value
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
    centre, region = known.centre, known.region
    missed, others = np.zeros(pixel.size), np.zeros(pixel.size, dtype=bool)
    predicted = np.zeros((2, pixel.size), dtype=bool)  # from pixels above or below, and from those at the sides
    low, high = np.tile(value, (2, 1)), np.tile(value, (2, 1))
    row, column = np.divmod(pixel, region.shape[1])
    inner = region[row, column] == which
    for dy, dx in AROUND:
        r, c, inside = _inside(row + dy, column + dx, region.shape)
        same, part, near = known.near(r * region.shape[1] + c, which, inside)
        told = np.flatnonzero(same)
        at = r[told], c[told]
        guess = np.full(pixel.size, np.nan)
        guess[told] = centre[at] + _slope(known, *at, 0, 1) * (x[told] - at[1] - 0.5)
        guess[told] += _slope(known, *at, 1, 0) * (y[told] - at[0] - 0.5)
        told = np.isfinite(guess)
        for y2, x2 in ((2 * dy, dx), (dy, 2 * dx)):
            if (y2, x2) != (dy, dx):
                # What comes from a slope that was taken from the item's own row or column agrees with it, whatever
                # that holds: along an edge all may err alike.
                r2, c2, on = _inside(row + y2, column + x2, region.shape)
                told &= ~inner | (on & (region[r2, c2] == which))
        missed = np.maximum(missed, np.where(told, np.abs(value - guess), 0.0))
        others |= (same | part) & bool(dy or dx)
        for axis in np.flatnonzero((dy, dx)):
            predicted[axis] |= told
            low[axis], high[axis] = np.fmin(low[axis], near), np.fmax(high[axis], near)
    spread = high - low
    missed = np.maximum(missed, np.where(predicted, 0.0, spread).max(axis=0))
    return np.where(others, missed / 8, np.abs(value)), high.max(axis=0)


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
