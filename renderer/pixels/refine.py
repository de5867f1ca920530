"""Pixels and pieces of pixels, evaluated again where the estimated error says so, until the rest is small enough.

A piece is first worth its radiance at the centroid (exact for a linear function), a whole pixel its centre plus
the Laplacian over 24 of its neighbours (exact for a cubic one). Estimates of what is left:

- a whole pixel: from fourth and sixth differences (see `interpolation.WITHIN`).
- where a whole shadow fits in a pixel (see `doubt`): a quarter of the unshadowed radiance at least.
- a piece, and a pixel beside an edge: an eighth of the largest amount by which its value misses what the whole
  pixels of its region around it predict, each with its own gradient; of the range of values where none does; the
  whole value where there is no other; it, or the largest of its region nearby, where three regions meet (a corner
  that stands on a floor: its shadow has no width there; small faces of one body are one), where the piece is not
  seen at its centroid, or where its cell could not be cut exactly.
- on small faces what `shadow_fits` measures.
- in a pixel beside a light (see `convergence`): a quarter of what it may show somewhere at least, and so on the finer
  grids around each point that is as near for its cell. The grids are as many cells across and down as it takes.

A value of another pixel that was itself extrapolated from the item's own proves nothing and is passed over; nor do
dark values among themselves, deep in a penumbra: such items are evaluated on the next grid whatever their estimate.

The items with the largest estimates are evaluated on a finer grid, round by round, until the squares of all
others sum to less than the tolerance allows. After a round an item's estimate is half of what it changed by, and
at least an eighth of what it was: a change that happens to vanish proves nothing. Where a whole shadow fits in a pixel
it is asked again whether one still fits around each point of the finer grid: what that may be worth stays, summed as if
the points erred on their own (an edge passes g of g^2 points, and the sum falls as g^-3/2). Where a light without
extent can be blocked, radiance jumps within regions: errors then halve with the grid and do no better, first estimates
are doubled, and at least half of an estimate stays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.vectors import Floats, Ints, distinct

from .edge_fragments import Bits, cut_at_grid
from .moments import Edges, Grid, Pieces, pieces_of
from .regions import Regions
from .shade import Shader

Doubt = Callable[[Floats, Floats, Ints, float], NDArray[np.bool_]]
"""From image points (n,), their regions and a width in pixels to where a shadow fits in that (see `doubt`)."""
Allowed = Callable[[float], float]
"""From the items' `Items.square`, as far as known, to the sum of squared errors they may have."""
UNSEEN = 0.25
"""Of the unshadowed radiance, that a shadow which fits in a pixel may be worth."""
FINEST = 16
"""Cells in a pixel's side, at most, where no light is near."""
PANEL = 16
"""Nodes of a Gauss-Legendre rule; more of them are several rules side by side."""


@dataclass(frozen=True)
class Rule:
    """How an estimate falls with a round.

    Parameters
    ----------
    piece_stays, whole_stays : float
        What stays of a piece's, and of a whole pixel's, at least.
    piece, whole : float
        Of what each changed by.
    """

    piece_stays: float
    whole_stays: float
    piece: float
    whole: float


SMOOTH = Rule(1 / 8, 1 / 16, 1 / 2, 1 / 5)
JUMPS = Rule(1 / 2, 1 / 2, 1 / 2, 1 / 2)


@dataclass
class Items:
    """Regions in pixels: whole pixels, and pieces.

    Parameters
    ----------
    pixel, region : (n,) int64
    area, x, y : (n,) float64
        Share of the pixel, centroid.
    covariance : (3, n) float64
    value : (c, n) float64
        Mean radiance over the item, as far as known; see `shade.Palette.told`.
    estimate : (n,) float64
        Of its error (norm over the channels) times its area.
    level : (n,) int64
        How often its pixel's sides were halved.
    most : (2, n) int64
        Cells across and down that it is divided into at most.
    whole : (n,) bool
    dark : (n,) bool
        Whether it is to be evaluated at more points whatever its estimate: too dark for what is around it to tell.
    lost : (n,) float64
        Radiance, times the item's area, that shadows which fit between its points may be worth; 0 if there are none.
    """

    pixel: Ints
    region: Ints
    area: Floats
    x: Floats
    y: Floats
    covariance: Floats
    value: Floats
    estimate: Floats
    level: Ints
    most: Ints
    whole: NDArray[np.bool_]
    dark: NDArray[np.bool_]
    lost: Floats

    @classmethod
    def of(cls, pixel: Ints, region: Ints, pieces: Pieces, value: Floats, width: int) -> Items:
        """Whole pixels (k,) and their regions, then pieces (m,), with values (c, k + m): nothing is estimated yet."""
        whole = np.arange(pixel.size + pieces.cell.size) < pixel.size
        return cls(
            pixel=np.append(pixel, pieces.cell),
            region=np.append(region, pieces.region),
            area=np.append(np.ones(pixel.size), pieces.area),
            x=np.append(pixel % width + 0.5, pieces.x),
            y=np.append(pixel // width + 0.5, pieces.y),
            covariance=np.hstack((np.zeros((3, pixel.size)), pieces.covariance)),
            value=value,
            estimate=np.zeros(whole.size),
            level=np.zeros(whole.size, dtype=np.int64),
            most=np.full((2, whole.size), FINEST),
            whole=whole,
            dark=np.zeros(whole.size, dtype=bool),
            lost=np.zeros(whole.size),
        )

    @property
    def square(self) -> float:
        """Sum of their squared radiance, as far as it is known."""
        return float(np.einsum("cn,cn->n", self.value, self.value) @ self.area**2)

    @classmethod
    def joined(cls, *parts: Items) -> Items:
        """One after the other."""
        names = [part.name for part in fields(cls)]
        return cls(*(np.concatenate([getattr(part, name) for part in parts], axis=-1) for name in names))


@dataclass(frozen=True, eq=False)
class Nodes:
    """Points at which items are evaluated, with the item and the share of it each stands for."""

    item: Ints
    x: Floats
    y: Floats
    weight: Floats

    @classmethod
    def joined(cls, parts: list[Nodes]) -> Nodes:
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("item", "x", "y", "weight")))


def refine(
    items: Items, edges: Edges, regions: Regions, shade: Shader, allowed: Allowed, jumps: bool, doubt: Doubt
) -> float:
    """Refine items in place until the sum of squared estimates is below what is allowed; returns that sum."""
    rule = JUMPS if jumps else SMOOTH
    if jumps:
        items.estimate *= 2
        items.lost[:] = 0
    chosen = distinct(np.append(_worst(items, allowed(items.square) / 2), np.flatnonzero(items.dark)))
    while chosen.size:
        _evaluate(items, chosen, edges, regions, shade, rule, doubt)
        budget = allowed(items.square)
        chosen = _worst(items, budget / 2) if _left(items) > budget else chosen[:0]
    return _left(items)


def _left(items: Items) -> float:
    return float((items.estimate**2).sum())


def _worst(items: Items, budget: float) -> Ints:
    """The fewest items, of those that can be refined, that bring the others below the budget."""
    some = np.flatnonzero((2**items.level < items.most.max(axis=0)) & (items.estimate > 0))
    square = items.estimate[some] ** 2
    order = np.argsort(square, kind="stable")
    kept = int(np.searchsorted(np.cumsum(square[order]), budget, side="right"))
    return np.sort(some[order[kept:]])


def _evaluate(
    items: Items, chosen: Ints, edges: Edges, regions: Regions, shade: Shader, rule: Rule, doubt: Doubt
) -> None:
    """Evaluate items on their next grids."""
    parts, level = [], items.level[chosen] + 1
    for now in distinct(level).tolist():
        parts += _nodes(items, chosen[level == now], now, edges, regions)
    nodes, count = Nodes.joined(parts), items.pixel.size
    seen = np.bincount(nodes.item, nodes.weight, count)[chosen]
    radiance = shade(nodes.x, nodes.y, items.region[nodes.item])
    total = np.stack([np.bincount(nodes.item, nodes.weight * channel, count)[chosen] for channel in radiance])
    value = np.where(seen > 0, total / np.where(seen > 0, seen, 1.0), items.value[:, chosen])
    change = np.sqrt(((value - items.value[:, chosen]) ** 2).sum(axis=0)) * items.area[chosen]
    whole = items.whole[chosen]
    stays = items.estimate[chosen] * np.where(whole, rule.whole_stays, rule.piece_stays)
    estimate = np.maximum(change * np.where(whole, rule.whole, rule.piece), stays)
    keep = _hidden(items, nodes, regions)[chosen] & ~whole & (level == 1)
    estimate = np.where(keep, np.maximum(estimate, items.estimate[chosen]), estimate)
    items.value[:, chosen] = np.where(keep, items.value[:, chosen], value)
    items.estimate[chosen] = np.maximum(estimate, items.lost[chosen] * _doubted(nodes, items, doubt)[chosen])
    items.level[chosen] = level


def _nodes(items: Items, chosen: Ints, level: int, edges: Edges, regions: Regions) -> list[Nodes]:
    parts: list[Nodes] = []
    cells = np.minimum(items.most[:, chosen], 2**level)
    key = cells[0] << 32 | cells[1]
    for one in distinct(key).tolist():
        grid, mine = (one >> 32, one & 0xFFFFFFFF), chosen[key == one]
        whole = items.whole[mine]
        parts, pieces = [*parts, _gauss(items, mine[whole], grid)], mine[~whole]
        if pieces.size:
            parts += [_matched(items, pieces)] if level == 1 else _subdivided(items, pieces, grid, edges, regions)
    return parts


def _hidden(items: Items, nodes: Nodes, regions: Regions) -> NDArray[np.bool_]:
    """Which pieces' first three nodes are, some of them, behind something else: they tell little of the piece."""
    first = np.flatnonzero((items.level == 0)[nodes.item] & ~items.whole[nodes.item])
    hidden, item = np.zeros(items.pixel.size, dtype=bool), nodes.item[first]
    hidden[item[regions.seen(nodes.x[first], nodes.y[first]) != items.region[item]]] = True
    return hidden


def _doubted(nodes: Nodes, items: Items, doubt: Doubt) -> Floats:
    """Of each item, the root of the sum of squared shares of its nodes that shadows still fit around."""
    mine = np.flatnonzero(items.lost[nodes.item] > 0)
    level, still = items.level[nodes.item[mine]] + 1, np.zeros(mine.size, dtype=bool)
    for now in distinct(level).tolist():
        k = np.flatnonzero(level == now)
        node = mine[k]
        still[k] = doubt(nodes.x[node], nodes.y[node], items.region[nodes.item[node]], 0.5**now)
    k, count = mine[still], items.pixel.size
    weight = np.bincount(nodes.item, nodes.weight, count)
    return np.sqrt(np.bincount(nodes.item[k], nodes.weight[k] ** 2, count)) / np.maximum(weight, 1e-300)


def _gauss(items: Items, chosen: Ints, grid: Grid) -> Nodes:
    """Gauss-Legendre over whole pixels."""
    (across, wide), (down, high) = (_rule(cells) for cells in grid)
    x = items.x[chosen][:, None] + np.tile(across, down.size)
    y = items.y[chosen][:, None] + np.repeat(down, across.size)
    share = np.broadcast_to(np.tile(wide, down.size) * np.repeat(high, across.size), x.shape)
    return Nodes(np.repeat(chosen, x.shape[1]), x.ravel(), y.ravel(), share.ravel())


def _rule(count: int) -> tuple[Floats, Floats]:
    """So many places (count,) on a side of length 1 about its middle, and weights."""
    panels = max(count // PANEL, 1)
    node, weight = np.polynomial.legendre.leggauss(count // panels)
    middle = (np.arange(panels) + 0.5) / panels - 0.5
    return (middle[:, None] + node / (2 * panels)).ravel(), np.tile(weight / (2 * panels), panels)


def _matched(items: Items, chosen: Ints) -> Nodes:
    """Three points with the piece's centroid and covariance: exact to degree 2 on any shape."""
    xx, xy, yy = items.covariance[:, chosen]
    a = np.sqrt(np.maximum(xx, 1e-30))
    b = xy / a
    c = np.sqrt(np.maximum(yy - b * b, 0))
    angle = 2 * np.pi * np.arange(3) / 3
    u, v = np.sqrt(2) * np.cos(angle), np.sqrt(2) * np.sin(angle)
    x = items.x[chosen][:, None] + a[:, None] * u
    y = items.y[chosen][:, None] + b[:, None] * u + c[:, None] * v
    return Nodes(np.repeat(chosen, 3), x.ravel(), y.ravel(), np.full(3 * chosen.size, 1 / 3))


def _subdivided(items: Items, chosen: Ints, grid: Grid, edges: Edges, regions: Regions) -> list[Nodes]:
    """The same exact moments on a grid inside the pixels; cells that cannot be cut are taken at their centre."""
    width, (across, down) = regions.lens.width, grid
    pixels = distinct(items.pixel[chosen])
    mine = np.flatnonzero(np.isin(edges.bits.cell, pixels))
    fine = _finer(edges, mine, grid, regions)
    pieces, bad = pieces_of(fine, width * across, grid, regions)
    good = ~np.isin(pieces.cell, bad)
    row, column = np.divmod(pixels, width)
    i, j = np.divmod(np.arange(across * down), across)
    every = ((row[:, None] * down + i) * (width * across) + column[:, None] * across + j).ravel()
    plain = every[~np.isin(every, pieces.cell[good])]
    below, beside = np.divmod(plain, width * across)
    x, y = (beside + 0.5) / across, (below + 0.5) / down
    parts = [
        (pieces.cell[good], pieces.x[good] / across, pieces.y[good] / down, pieces.region[good], pieces.area[good]),
        (plain, x, y, regions.seen(x, y), np.ones(plain.size)),
    ]
    return [_owned(items, chosen, width, grid, *part) for part in parts]


def _finer(edges: Edges, mine: Ints, grid: Grid, regions: Regions) -> Edges:
    bits, scale = edges.bits.take(mine), np.array(grid)[:, None]
    scaled = Bits(bits.start * scale, bits.end * scale, bits.cell, bits.reach)
    cut, parent = cut_at_grid(scaled, regions.lens.width * grid[0], regions.lens.height * grid[1])
    return Edges(cut, edges.left[mine][parent], edges.right[mine][parent])


def _owned(
    items: Items, chosen: Ints, width: int, grid: Grid, cell: Ints, x: Floats, y: Floats, region: Ints, area: Floats
) -> Nodes:
    """Nodes of the chosen items among points found in cells."""
    row, column = np.divmod(cell, width * grid[0])
    base = int(max(items.region.max(initial=0), region.max(initial=0))) + 2
    key = ((row // grid[1]) * width + column // grid[0]) * base + region + 1
    own = items.pixel[chosen] * base + items.region[chosen] + 1
    order = np.argsort(own, kind="stable")
    place = np.minimum(np.searchsorted(own[order], key), own.size - 1)
    item = order[place]
    match = own[item] == key
    return Nodes(chosen[item[match]], x[match], y[match], area[match])
