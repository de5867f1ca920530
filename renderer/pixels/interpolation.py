"""Radiance at pixel centres, evaluated where it must be and interpolated where it is smooth.

Centres are taken far apart, then half as far, down to 2. A square of four of them that shows one region
throughout, and whose fourth differences (in rows, columns and both diagonals) are small, is filled by cubic
interpolation; any other is divided. A kink of slope change s between centres a distance h apart gives fourth
differences of h s/2 at
least, and an error of at most 3/8 h s/2. Where the function is smooth the error is 3/128 of the fourth difference.
So what is smooth is not shaded, and a penumbra's edge is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.vectors import Bools, Floats, Ints

COARSEST = 32
"""Largest distance between centres, in pixels; no larger than an eighth of the image."""

Evaluate = Callable[[Ints], Floats]
"""From pixel numbers (n,) to their radiance (3, n)."""


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
    own = region.ravel()[index]
    worst = np.zeros(index.size)
    for dy, dx in ((0, 1), (1, 0), (1, 1), (1, -1)):
        r, c = row + dy * reach, column + dx * reach
        place = np.clip(r, 0, height - 1) * width + np.clip(c, 0, width - 1)
        same = (region.ravel()[place] == own) & (r >= 0) & (r < height) & (c >= 0) & (c < width)
        bound = _along(np.where(same, value.ravel()[place], np.nan), rule)
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


def fill_centres(
    region: Ints, evaluate: Evaluate, allowed: Callable[[Floats], float], alone: Bools | None = None
) -> tuple[Floats, Floats, Bools]:
    """Radiance (3, h, w) at all centres whose region is at least 0, a bound (h, w) of its error, and which pixels were
    interpolated.

    Parameters
    ----------
    region : (h, w) int64
        Below 0 for pixels that are not to be filled.
    evaluate : callable
    allowed : callable
        From the first values (3, n) to the error that an interpolated value may have (sum of the channels).
    alone : (h, w) bool, optional
        Pixels that others tell nothing of: no square that shows one is filled.
    """
    h, w = region.shape
    value = np.full((3, h, w), np.nan)
    known, bound = np.zeros((h, w), dtype=bool), np.zeros((h, w))
    limit: float | None = None
    step = COARSEST
    while step > 2 and step > min(h, w) // 8:
        step //= 2
    while step >= 2:
        nodes = np.zeros((h, w), dtype=bool)
        nodes[::step, ::step] = True
        _ask(nodes & ~known & (region >= 0), value, known, evaluate)
        if limit is None:
            limit = allowed(value[:, known])
        _fill_cells(value, known, bound, region if alone is None else np.where(alone, -1, region), step, limit)
        step //= 2
    _ask(~known & (region >= 0), value, known, evaluate)
    return value, bound, bound > 0


def _ask(wanted: Bools, value: Floats, known: Bools, evaluate: Evaluate) -> None:
    index = np.flatnonzero(wanted)
    value.reshape(3, -1)[:, index] = evaluate(index)
    known |= wanted


def _fill_cells(value: Floats, known: Bools, bound: Floats, region: Ints, step: int, limit: float) -> None:
    """Interpolate inside the cells that are smooth enough."""
    nodes, regions = value[:, ::step, ::step], region[::step, ::step]
    index = np.flatnonzero(regions >= 0)
    at_nodes = np.full(regions.shape, np.inf)
    at_nodes.reshape(-1)[index] = error_bound(nodes.sum(axis=0), regions, BETWEEN, index)
    rough = np.maximum.reduce([at_nodes[:-1, :-1], at_nodes[1:, :-1], at_nodes[:-1, 1:], at_nodes[1:, 1:]])
    smooth = rough <= limit
    smooth &= _uniform(region, step)
    smooth &= ~_filled(known, step)
    row, column, top, left = _stencils(regions, *np.nonzero(smooth))
    i, j = np.meshgrid(np.arange(4), np.arange(4), indexing="ij")
    patch = nodes[:, top[:, None, None] + i, left[:, None, None] + j]
    weights = _cubic((np.arange(step + 1) / step)[:, None] + np.arange(3))  # by the cell's place among its nodes
    down, across = weights[:, row - top], weights[:, column - left]  # (step + 1, k, 4)
    patch = (down.transpose(1, 0, 2) @ patch) @ across.transpose(1, 2, 0)
    inner = np.arange(step + 1)
    place = ((row * step)[:, None, None] + inner[:, None]) * region.shape[1] + (column * step)[:, None, None] + inner
    fresh = ~known.reshape(-1)[place]
    place = place[fresh]
    value.reshape(3, -1)[:, place] = patch[:, fresh]
    bound.reshape(-1)[place] = np.broadcast_to(rough[row, column][:, None, None], fresh.shape)[fresh]
    known.reshape(-1)[place] = True


def _filled(known: Bools, step: int) -> Bools:
    """Which cells are filled already: their middles are known."""
    h, w = ((size - 1) // step for size in known.shape)
    return known[step // 2 :: step, step // 2 :: step][:h, :w]


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
