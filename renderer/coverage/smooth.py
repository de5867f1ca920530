"""Radiance at pixel centres, evaluated where it must be and interpolated where it is smooth.

Centres are taken 8 apart, then 4, then 2. A square of four of them that shows one region throughout, and whose
fourth differences (in rows, columns and both diagonals) are small, is filled by cubic interpolation; any other
is divided. A kink of slope change s between centres a distance h apart gives fourth differences of h s/2 at
least, and an error of at most 3/8 h s/2. Where the function is smooth the error is 3/128 of the fourth difference.
So what is smooth is not shaded, and a penumbra's edge is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ..geometry import Ints
from ..vectors import Floats

STEPS = (8, 4, 2)
"""Distances between centres, in pixels."""

Evaluate = Callable[[Ints], Floats]
"""From pixel numbers (n,) to their radiance (3, n)."""
Bools = NDArray[np.bool_]


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
    outward : bool
        Whether the second difference next to a node may speak for it.
    """

    rough: float
    smooth: float
    kink: float
    outward: bool


BETWEEN = Rule(0.4, 0.07, 0.13, True)
"""Of cubic interpolation between nodes: 3/128 where smooth (1/24 at an end of the four); a kink midway leaves 3/8
where these are 1 and 3."""
WITHIN = Rule(1 / 12, 1 / 100, 1 / 40, False)
"""Of a pixel's centre plus Laplacian over 24: 0.003 where smooth; a kink leaves 1/12 where these are 2 and 6, and
1/48 where they are 0.5 and 1.5."""


def error_bound(value: Floats, region: Ints, rule: Rule) -> Floats:
    """Error at or beside each of the nodes (h, w), by differences in rows, columns and both diagonals.

    inf where a row or column has none. Where a region is too narrow for fourth differences third ones stand in,
    and second ones for them: larger where the function is smooth, and as large at a kink.

    Parameters
    ----------
    value : (h, w) float64
    region : (h, w) int64
        Differences are taken within one region only.
    """
    worst = np.zeros(value.shape)
    for dy, dx in ((0, 1), (1, 0), (1, 1), (1, -1)):
        bound = _along(value, region, rule, dy, dx)
        unknown = 0.0 if dy and dx else np.inf
        np.maximum(worst, np.where(np.isfinite(bound), bound, unknown), out=worst)
    return worst


def _along(value: Floats, region: Ints, rule: Rule, dy: int, dx: int) -> Floats:
    """The bound in one direction; NaN where no second difference covers the node."""

    def beside(array: Floats) -> tuple[Floats, Floats]:
        return shifted(array, dy, dx, np.nan), shifted(array, -dy, -dx, np.nan)

    def widest(array: Floats) -> Floats:
        """Largest at the node and beside it; two away where that tells nothing."""
        near = np.fmax(array, np.fmax(*beside(array)))
        return np.where(np.isfinite(near), near, np.fmax(*beside(near)))

    second = second_difference(value, region, dy, dx)
    ahead, behind = beside(second)
    fourth = ahead - 2 * second + behind
    third = np.fmax(np.abs(ahead - second), np.abs(second - behind))
    coarse = widest(np.abs(fourth))
    coarse = np.where(np.isfinite(coarse), coarse, widest(np.where(np.isfinite(third), third, np.abs(second))))
    ahead, behind = beside(fourth)
    sixth = widest(np.abs(ahead - 2 * fourth + behind))
    bound = np.fmin(rule.rough * coarse, rule.smooth * coarse + rule.kink * sixth)
    covered = np.isfinite(second)
    if rule.outward:
        covered |= np.isfinite(ahead_or_behind(second, dy, dx))
    return np.where(covered, bound, np.nan)


def ahead_or_behind(array: Floats, dy: int, dx: int) -> Floats:
    """A neighbour's value in either direction, NaN where there is none."""
    return np.fmax(shifted(array, dy, dx, np.nan), shifted(array, -dy, -dx, np.nan))


Kind = TypeVar("Kind", bound=np.generic)


def shifted(array: NDArray[Kind], dy: int, dx: int, outside: float) -> NDArray[Kind]:
    """The array's value at (row + dy, column + dx) for each place."""
    out = np.full_like(array, outside)
    h, w = array.shape
    rows, columns = slice(max(dy, 0), h + min(dy, 0)), slice(max(dx, 0), w + min(dx, 0))
    into = slice(max(-dy, 0), h + min(-dy, 0)), slice(max(-dx, 0), w + min(-dx, 0))
    out[into] = array[rows, columns]
    return out


def second_difference(value: Floats, region: Ints, dy: int, dx: int) -> Floats:
    """f(+) - 2 f + f(-) at each place; NaN where the three are not of one region."""
    same = (shifted(region, dy, dx, -9) == region) & (shifted(region, -dy, -dx, -9) == region)
    ahead, behind = shifted(value, dy, dx, np.nan), shifted(value, -dy, -dx, np.nan)
    return np.where(same, ahead - 2 * value + behind, np.nan)


def _uniform(region: Ints, step: int) -> Bools:
    """Which cells of the grid of nodes show one region in all their pixels, edges included."""
    low = high = region
    for axis in (0, 1):
        low, high = _pooled(low, step, axis, np.minimum), _pooled(high, step, axis, np.maximum)
    return (low == high) & (low >= 0)


def _pooled(values: Ints, step: int, axis: int, take: np.ufunc) -> Ints:
    count = (values.shape[axis] - 1) // step
    values = np.moveaxis(values, axis, 0)
    out = values[: count * step].reshape(count, step, *values.shape[1:])
    pooled = take(take.reduce(out, axis=1), values[step : count * step + 1 : step])
    return np.moveaxis(pooled, 0, axis)


def fill_centres(region: Ints, evaluate: Evaluate, allowed: Callable[[Floats], float]) -> tuple[Floats, Floats]:
    """Radiance (3, h, w) at all centres whose region is at least 0, and a bound (h, w) of its error.

    Parameters
    ----------
    region : (h, w) int64
        Below 0 for pixels that are not to be filled.
    evaluate : callable
    allowed : callable
        From the first values (3, n) to the error that an interpolated value may have (sum of the channels).
    """
    h, w = region.shape
    value = np.full((3, h, w), np.nan)
    known, bound = np.zeros((h, w), dtype=bool), np.zeros((h, w))
    limit: float | None = None
    for step in STEPS:
        nodes = np.zeros((h, w), dtype=bool)
        nodes[::step, ::step] = True
        _ask(nodes & ~known & (region >= 0), value, known, evaluate)
        if limit is None:
            limit = allowed(value[:, known])
        _fill_cells(value, known, bound, region, step, limit)
    _ask(~known & (region >= 0), value, known, evaluate)
    return value, bound


def _ask(wanted: Bools, value: Floats, known: Bools, evaluate: Evaluate) -> None:
    index = np.flatnonzero(wanted)
    value.reshape(3, -1)[:, index] = evaluate(index)
    known |= wanted


def _fill_cells(value: Floats, known: Bools, bound: Floats, region: Ints, step: int, limit: float) -> None:
    """Interpolate inside the cells that are smooth enough."""
    nodes, regions = value[:, ::step, ::step], region[::step, ::step]
    rough = error_bound(nodes.sum(axis=0), regions, BETWEEN)
    rough = np.maximum.reduce([rough[:-1, :-1], rough[1:, :-1], rough[:-1, 1:], rough[1:, 1:]])
    smooth = rough <= limit
    smooth &= _uniform(region, step)
    row, column, top, left = _stencils(regions, *np.nonzero(smooth))
    i, j = np.meshgrid(np.arange(4), np.arange(4), indexing="ij")
    patch = nodes[:, top[:, None, None] + i, left[:, None, None] + j]
    weights = _cubic((np.arange(step + 1) / step)[:, None] + np.arange(3))  # by the cell's place among its nodes
    down, across = weights[:, row - top], weights[:, column - left]  # (step + 1, k, 4)
    patch = (down.transpose(1, 0, 2) @ patch) @ across.transpose(1, 2, 0)
    rows = (row * step)[:, None, None] + np.arange(step + 1)[:, None]
    columns = (column * step)[:, None, None] + np.arange(step + 1)
    rows, columns = np.broadcast_arrays(rows, columns)
    fresh = ~known[rows, columns]
    value[:, rows[fresh], columns[fresh]] = patch[:, fresh]
    bound[rows[fresh], columns[fresh]] = np.broadcast_to(rough[row, column][:, None, None], fresh.shape)[fresh]
    known[rows[fresh], columns[fresh]] = True


def _stencils(region: Ints, row: Ints, column: Ints) -> tuple[Ints, Ints, Ints, Ints]:
    """For cells, the first row and column of 4 x 4 nodes of their region around them; cells without are left out.

    The cell in the middle if it can be, else at the side.
    """
    height, width = region.shape
    top, left = np.full(row.size, -1), np.full(row.size, -1)
    i, j = np.meshgrid(np.arange(4), np.arange(4), indexing="ij")
    for up in (1, 0, 2):
        for back in (1, 0, 2):
            r, c = row - up, column - back
            some = np.flatnonzero((top < 0) & (r >= 0) & (r + 4 <= height) & (c >= 0) & (c + 4 <= width))
            around = region[r[some, None, None] + i, c[some, None, None] + j]
            fits = some[(around == region[row[some], column[some]][:, None, None]).all(axis=(1, 2))]
            top[fits], left[fits] = r[fits], c[fits]
    found = np.flatnonzero(top >= 0)
    return row[found], column[found], top[found], left[found]


def _cubic(t: Floats) -> Floats:
    """Lagrange weights (..., 4) of nodes 0, 1, 2, 3 at t."""
    a, b, c, d = t, t - 1, t - 2, t - 3
    return np.stack((-b * c * d / 6, a * c * d / 2, -a * b * d / 2, a * b * c / 6), axis=-1)
