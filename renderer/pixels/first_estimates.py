"""How wrong the first value of a pixel or piece may be, from the values around it; see `refine` for the rules."""

from __future__ import annotations

import numpy as np

from nusselt.renderer.vectors import Bools, Floats, Ints

from .interpolation import shifted

ELSEWHERE = -2
"""A region that no pixel is of."""
AROUND = [(dy, dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1)]


def means(centre: Floats, region: Ints) -> Floats:
    """Means (3, h, w) over pixels without an edge: the centre, and the Laplacian over 24 of its neighbours.

    Parameters
    ----------
    centre : (3, h, w) float64
        Radiance at the centres.
    region : (h, w) int64
        Below 0 where there is none.
    """
    value = centre.copy()
    across = (region[:, 1:-1] == region[:, 2:]) & (region[:, 1:-1] == region[:, :-2]) & (region[:, 1:-1] >= 0)
    down = (region[1:-1] == region[2:]) & (region[1:-1] == region[:-2]) & (region[1:-1] >= 0)
    for source, out in zip(centre, value, strict=True):
        bend = source[:, 2:] - 2 * source[:, 1:-1] + source[:, :-2]
        np.add(out[:, 1:-1], bend / 24, out=out[:, 1:-1], where=across)
        bend = source[2:] - 2 * source[1:-1] + source[:-2]
        np.add(out[1:-1], bend / 24, out=out[1:-1], where=down)
    return value


def first_estimates(
    centre: Floats, region: Ints, pixel: Ints, which: Ints, x: Floats, y: Floats, value: Floats
) -> tuple[Floats, Floats]:
    """Estimates (n,) for items whose neighbourhood is broken by edges; the largest radiance (n,) of each region near.

    Parameters
    ----------
    centre : (h, w) float64
        Radiance at whole pixels' centres, channels summed.
    region : (h, w) int64
    pixel, which : (n,) int64
        Pixel and region of each item.
    x, y, value : (n,) float64
        Its place, and its radiance there.
    """
    slopes = _slope(centre, region, 0, 1), _slope(centre, region, 1, 0)
    predicted, missed = np.zeros(pixel.size, dtype=bool), np.zeros(pixel.size)
    low, high, others = value.copy(), value.copy(), np.zeros(pixel.size, dtype=bool)
    lookup = _Lookup.of(pixel, which)
    row, column = np.divmod(pixel, region.shape[1])
    for dy, dx in AROUND:
        r, c, inside = _inside(row + dy, column + dx, region.shape)
        same = inside & (region[r, c] == which)
        guess = centre[r, c] + slopes[0][r, c] * (x - c - 0.5) + slopes[1][r, c] * (y - r - 0.5)
        told = same & np.isfinite(guess)
        if (dy == 0) != (dx == 0):
            # What comes from a slope that was taken from the item's own value alone agrees with it, whatever it is.
            r2, c2, on = _inside(row + 2 * dy, column + 2 * dx, region.shape)
            told &= (region[row, column] != which) | (on & (region[r2, c2] == which))
        missed = np.maximum(missed, np.where(told, np.abs(value - guess), 0.0))
        predicted |= told & bool(dy or dx)
        item, found = lookup.find(r * region.shape[1] + c, which, inside)
        near = np.where(same, centre[r, c], np.where(found, value[item], value))
        low, high = np.minimum(low, near), np.maximum(high, near)
        others |= (same | found) & bool(dy or dx)
    return np.where(predicted, missed / 8, np.where(others, (high - low) / 8, np.abs(value))), high


def _inside(r: Ints, c: Ints, shape: tuple[int, ...]) -> tuple[Ints, Ints, Bools]:
    inside = (r >= 0) & (r < shape[0]) & (c >= 0) & (c < shape[1])
    return np.where(inside, r, 0), np.where(inside, c, 0), inside


def _slope(value: Floats, region: Ints, dy: int, dx: int) -> Floats:
    """Central difference within one region, one-sided where it ends, NaN where it is a single pixel wide."""

    def step(sign: int) -> Floats:
        same = shifted(region, sign * dy, sign * dx, ELSEWHERE) == region
        return np.where(same & (region >= 0), sign * (shifted(value, sign * dy, sign * dx, np.nan) - value), np.nan)

    ahead, behind = step(1), step(-1)
    both = (ahead + behind) / 2
    return np.where(np.isfinite(both), both, np.where(np.isfinite(ahead), ahead, behind))


class _Lookup:
    """Items by pixel and region."""

    def __init__(self, keys: Ints, order: Ints, base: int) -> None:
        self._keys, self._order, self._base = keys, order, base

    @classmethod
    def of(cls, pixel: Ints, which: Ints) -> _Lookup:
        base = int(which.max(initial=0)) + 1
        order = np.argsort(pixel * base + which, kind="stable")
        return cls((pixel * base + which)[order], order, base)

    def find(self, pixel: Ints, which: Ints, wanted: Bools) -> tuple[Ints, Bools]:
        key = pixel * self._base + which
        place = np.minimum(np.searchsorted(self._keys, key), max(self._keys.size - 1, 0))
        return self._order[place], wanted & (self._keys[place] == key)
