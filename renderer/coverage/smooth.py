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
    """

    rough: float
    smooth: float
    kink: float


BETWEEN = Rule(0.4, 0.07, 0.13)
"""Of cubic interpolation between nodes: 3/128 where smooth; a kink midway leaves 3/8 where these are 1 and 3."""
WITHIN = Rule(1 / 12, 1 / 100, 1 / 40)
"""Of a pixel's centre plus Laplacian over 24: 0.003 where smooth; a kink leaves 1/12 where these are 2 and 6, and
1/48 where they are 0.5 and 1.5."""


def error_bound(value: Floats, region: Ints, rule: Rule) -> Floats:
    """Error at or beside each of the nodes (h, w), by differences in rows, columns and both diagonals.

    inf where there are none. Where a region is too narrow for fourth differences third ones stand in, and second
    ones for them: larger where the function is smooth, and as large at a kink.

    Parameters
    ----------
    value : (h, w) float64
    region : (h, w) int64
        Differences are taken within one region only.
    """
    worst = np.zeros(value.shape)
    for dy, dx in ((0, 1), (1, 0), (1, 1), (1, -1)):

        def beside(array: Floats, dy: int = dy, dx: int = dx) -> tuple[Floats, Floats]:
            return shifted(array, dy, dx, np.nan), shifted(array, -dy, -dx, np.nan)

        def widest(array: Floats, beside: Callable[[Floats], tuple[Floats, Floats]] = beside) -> Floats:
            return np.fmax(array, np.fmax(*beside(array)))

        second = second_difference(value, region, dy, dx)
        ahead, behind = beside(second)
        fourth = ahead - 2 * second + behind
        third = np.fmax(np.abs(ahead - second), np.abs(second - behind))
        known = np.isfinite(fourth)
        ahead, behind = beside(fourth)
        sixth = ahead - 2 * fourth + behind
        coarse = np.where(known, np.abs(fourth), np.where(np.isfinite(third), third, np.abs(second)))
        bound = rule.rough * widest(coarse)
        fine = rule.smooth * widest(coarse) + rule.kink * widest(np.abs(sixth))
        bound = np.where(np.isfinite(sixth), np.fmin(bound, fine), bound)
        np.maximum(worst, np.where(np.isfinite(second), bound, np.inf), out=worst)
    return worst


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


def fill_centres(region: Ints, evaluate: Evaluate, allowed: Callable[[Floats], float]) -> tuple[Floats, Bools]:
    """Radiance (3, h, w) at all centres whose region is at least 0, and which of them were evaluated.

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
    known, done = np.zeros((h, w), dtype=bool), np.zeros((h, w), dtype=bool)
    limit: float | None = None
    for step in STEPS:
        nodes = np.zeros((h, w), dtype=bool)
        nodes[::step, ::step] = True
        _ask(nodes & ~known & (region >= 0), value, known, done, evaluate)
        if limit is None:
            limit = allowed(value[:, done])
        _fill_cells(value, known, region, step, limit)
    _ask(~known & (region >= 0), value, known, done, evaluate)
    return value, done


def _ask(wanted: Bools, value: Floats, known: Bools, done: Bools, evaluate: Evaluate) -> None:
    index = np.flatnonzero(wanted)
    value.reshape(3, -1)[:, index] = evaluate(index)
    known |= wanted
    done |= wanted


def _fill_cells(value: Floats, known: Bools, region: Ints, step: int, limit: float) -> None:
    """Interpolate inside the cells that are smooth enough."""
    nodes, regions = value[:, ::step, ::step], region[::step, ::step]
    rough = error_bound(nodes.sum(axis=0), regions, BETWEEN)
    corners = [rough[:-1, :-1], rough[1:, :-1], rough[:-1, 1:], rough[1:, 1:]]
    smooth = np.maximum.reduce(corners) <= limit
    smooth &= _uniform(region, step)
    row, column = np.nonzero(smooth)
    inner = (row > 0) & (row < nodes.shape[1] - 2) & (column > 0) & (column < nodes.shape[2] - 2)
    row, column = row[inner], column[inner]
    i, j = np.meshgrid(np.arange(-1, 3), np.arange(-1, 3), indexing="ij")
    around = row[:, None, None] + i, column[:, None, None] + j
    one = (regions[around] == regions[row, column][:, None, None]).all(axis=(1, 2))
    row, column, around = row[one], column[one], tuple(index[one] for index in around)
    weights = _cubic(np.arange(step + 1) / step)  # (step + 1, 4)
    patch = np.einsum("ai,ckij,bj->ckab", weights, nodes[(slice(None), *around)], weights, optimize=True)
    rows = (row * step)[:, None, None] + np.arange(step + 1)[:, None]
    columns = (column * step)[:, None, None] + np.arange(step + 1)
    rows, columns = np.broadcast_arrays(rows, columns)
    fresh = ~known[rows, columns]
    value[:, rows[fresh], columns[fresh]] = patch[:, fresh]
    known[rows[fresh], columns[fresh]] = True


def _cubic(t: Floats) -> Floats:
    """Lagrange weights (n, 4) of nodes -1, 0, 1, 2 at t."""
    return np.stack(
        (
            -t * (t - 1) * (t - 2) / 6,
            (t + 1) * (t - 1) * (t - 2) / 2,
            -(t + 1) * t * (t - 2) / 2,
            (t + 1) * t * (t - 1) / 6,
        ),
        axis=1,
    )
