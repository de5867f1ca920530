"""Cubic interpolation between values on a grid, and how wrong it may be, from their differences.

A kink of slope change s between values a distance h apart gives fourth differences of h s/2 at least, and an error of
at most 3/8 h s/2. Where the function is smooth the error is 3/128 of the fourth difference.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.geometry.ragged import take
from nusselt.renderer.vectors import Floats, Ints


@dataclass(frozen=True)
class Rule:
    """Weights of differences in an error bound: the smaller of one that holds at kinks, and one that also sees
    sixth differences, which are small where the function is smooth and six times the kink where it is not.

    Parameters
    ----------
    rough : float
        Of the fourth difference alone.
    smooth, kink : float
        Of the fourth and the sixth together.
    border : float
        Of the third difference, at nodes that have no fourth of their own: one beside them may vanish by chance.
    outward : bool
        Whether the second difference next to a node may speak for it.
    diagonal : bool
        Whether differences along diagonals have a say.
    """

    rough: float
    smooth: float
    kink: float
    border: float
    outward: bool
    diagonal: bool


BETWEEN = Rule(0.16, 0.03, 0.03, 0.0, True, False)
"""Of cubic interpolation between nodes, the RMS over the square of four of them, of which the largest speaks. Over
sums of waves 7 to 50 nodes long, kinks, and kinks of the slope, of all places and directions, it was twice to five
times the RMS error of each kind, and for single squares half of the error at least. Half of it misses a highlight that
passes between nodes beside a light."""
WITHIN = Rule(1 / 48, 1 / 400, 1 / 160, 1 / 12, False, True)
"""Of a pixel's centre plus Laplacian over 24. Over kinks of all directions, two pixels away at most, its RMS was twice
that of the error, which a kink leaves in few of the pixels that see one; over kinks of the slope, five times. For
single pixels it was half of the error at least."""


def error_bound(value: Floats, region: Ints, rule: Rule, index: Ints) -> Floats:
    """Error at or beside some nodes, by differences in rows, columns and both diagonals.

    inf where a row or column has none. Where a region is too narrow for fourth differences third ones stand in,
    and second ones for them: larger where the function is smooth, and as large at a kink.

    Parameters
    ----------
    value : (h, w) float64
    region : (h, w) int64
        Differences are taken within one region only.
    index : (k,) int64
        Nodes, row by row.

    Returns
    -------
    (k,) float64
    """
    height, width = value.shape
    reach = np.arange(-4, 5)[:, None]
    row, column = np.divmod(index, width)
    value, region = value.ravel(), region.ravel()
    own = region[index]
    worst = np.zeros(index.size)
    for dy, dx in ((0, 1), (1, 0), (1, 1), (1, -1))[: 4 if rule.diagonal else 2]:
        place = index + (dy * width + dx) * reach
        same = take(region, place) == own
        if dx:
            same &= (column + dx * reach).view(np.uint64) < width  # the negative are large
        if dy:
            same &= (row + dy * reach).view(np.uint64) < height
        bound = _along(np.where(same, take(value, place), np.nan), rule)
        unknown = 0.0 if dy and dx else np.inf
        np.maximum(worst, np.where(np.isfinite(bound), bound, unknown), out=worst)
    return worst


def _along(value: Floats, rule: Rule) -> Floats:
    """The bound (k,) from nine values in a row (9, k), NaN outside the region; NaN where no difference covers."""

    def bend(array: Floats) -> Floats:
        return array[2:] - 2 * array[1:-1] + array[:-2]

    def largest(array: Floats) -> Any:
        """At the middle and beside it; two away where that tells nothing."""
        size = np.abs(array)
        middle = size.shape[0] // 2
        near = np.fmax.reduce(size[middle - 1 : middle + 2])
        return np.where(np.isfinite(near), near, np.fmax.reduce(size)) if size.shape[0] > 3 else near

    second = bend(value)  # about -3 .. 3
    fourth = bend(second)  # about -2 .. 2
    sixth = bend(fourth)  # about -1 .. 1
    third = np.fmax(np.abs(second[2:] - second[1:-1]), np.abs(second[1:-1] - second[:-2]))
    coarse = largest(fourth)
    coarse = np.where(np.isfinite(coarse), coarse, largest(np.where(np.isfinite(third), third, second[1:-1])))
    bound = np.fmin(rule.rough * coarse, rule.smooth * coarse + rule.kink * largest(sixth))
    bound = np.where(np.isfinite(fourth[2]), bound, np.fmax(bound, rule.border * third[2]))
    covered = np.isfinite(second[2:5]).any(axis=0) if rule.outward else np.isfinite(second[3])
    return np.where(covered, bound, np.nan)


Kind = TypeVar("Kind", bound=np.generic)


def shifted(array: NDArray[Kind], dy: int, dx: int, outside: float) -> NDArray[Kind]:
    """The array's value at (row + dy, column + dx) for each place."""
    out = np.full_like(array, outside)
    h, w = array.shape
    rows, columns = slice(max(dy, 0), h + min(dy, 0)), slice(max(dx, 0), w + min(dx, 0))
    into = slice(max(-dy, 0), h + min(-dy, 0)), slice(max(-dx, 0), w + min(-dx, 0))
    out[into] = array[rows, columns]
    return out


def cubic(t: Floats) -> Floats:
    """Lagrange weights (..., 4) of nodes 0, 1, 2, 3 at t."""
    a, b, c, d = t, t - 1, t - 2, t - 3
    return np.stack((-b * c * d / 6, a * c * d / 2, -a * b * d / 2, a * b * c / 6), axis=-1)


def cubic_slope(t: Floats) -> Floats:
    """Their first derivatives."""
    square = t * t
    return np.stack(
        (
            (-3 * square + 12 * t - 11) / 6,
            (3 * square - 10 * t + 6) / 2,
            (-3 * square + 8 * t - 3) / 2,
            (3 * square - 6 * t + 2) / 6,
        ),
        axis=-1,
    )


def cubic_bend(t: Floats) -> Floats:
    """Their second derivatives."""
    return np.stack((2 - t, 3 * t - 5, 4 - 3 * t, t - 1), axis=-1)
