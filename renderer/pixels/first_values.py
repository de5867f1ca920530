"""First values of all pixels and pieces, and which of them may have to be refined."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from nusselt.renderer.needs import Needs
from nusselt.renderer.vectors import Bools, Floats, Ints, distinct
from nusselt.renderer.visibility.segments import small_triangles

from .convergence import Convergence
from .doubt_squares import doubtful_places
from .error_budget import allowed
from .fill import BARE, DEAR, SHADOWED, Price, fill
from .filling import Parts, Reach, first_step
from .first_estimates import Known, first_estimates, means, summed
from .interpolation import WITHIN, error_bound
from .moments import Pieces
from .refine import UNSEEN, Items
from .regions import Regions
from .sampled import shares_error
from .shade import Palette, Shader, surface_of
from .small_faces import SmallFaces
from .whole_pixels import EDGE, Shown

FITTED = 0.25
"""Of the tolerance, that values on small faces may be fitted to."""
DEEP = 1 / 64
"""Of the unshadowed radiance, below which nothing follows from what is around: how much of a light is seen grows with
the square of the way into the penumbra, or its cube, from nothing."""

Shade = Callable[[Floats, Floats, Ints], Floats]
"""From image points (n,) and their regions to radiance (c, n)."""


@dataclass(frozen=True, eq=False)
class First:
    """First values.

    Parameters
    ----------
    items : Items
        What may be refined.
    image : (c, h, w) float64
        Whole pixels that are not; 0 elsewhere. See `Palette.told`.
    surface : (h, w) int64
        What pixels show; see `surface_of`.
    pieces, piece : Pieces, (c, k) float64
        And pieces that are not.
    square, settled : float
        Sum of all squared radiance; and of the squared errors allowed to what is not refined.
    convergence : Convergence
    """

    items: Items
    image: Floats
    surface: Ints
    pieces: Pieces
    piece: Floats
    square: float
    settled: float
    convergence: Convergence


def first_values(
    regions: Regions, palette: Palette, shown: Shown, shade: Shader, tolerance: float, needs: Needs, lights: Needs
) -> First:
    """Values of all pixels and pieces: interpolated where that is within the tolerance, or from one point each.

    Parameters
    ----------
    needs, lights : Needs
        Of the light that can be blocked, and of all.
    """
    width = shown.region.shape[1]
    surface = surface_of(shown.region, regions.surfaces)
    region = np.where(np.take(palette.reflects, surface), shown.region, EDGE)
    mine = np.flatnonzero(palette.reflects[surface_of(shown.pieces.region, regions.surfaces)])
    pieces = shown.pieces.take(mine)
    alone, own = _doubtful(regions, needs, region, pieces)
    small = SmallFaces.of(regions, region, pieces, alone, own) if needs.sources else None
    rough = _junction(shown.pieces, mine, small.label if small else pieces.region)
    bent = shown.bent[mine]
    if small:  # they are not filled from others
        region.reshape(-1)[small.pixel], alone.reshape(-1)[small.pixel] = EDGE, False
        pieces = pieces.take(small.others)
        own, rough, bent = (part[small.others] for part in (own, rough, bent))
    rough |= np.isin(pieces.cell, shown.sampled.pixel)
    some = np.flatnonzero(bent)
    rough[some] |= regions.seen(pieces.x[some], pieces.y[some]) != pieces.region[some]
    price = _price(regions, needs)

    def evaluate(pixel: Ints, piece: Ints) -> Floats:
        x, y = pixel % width + 0.5, pixel // width + 0.5
        which = region.ravel()[pixel], pieces.region[piece]
        return shade(np.append(x, pieces.x[piece]), np.append(y, pieces.y[piece]), np.concatenate(which))

    channels = 3 if palette.tint is None else 1
    convergence = Convergence.of(regions, lights.sources, first_step(region, price.nodes))
    reach = _reach(convergence, region, pieces)
    limit = partial(allowed, price.share * tolerance, 0.0, 1)
    found = fill(region, Parts(pieces, own, own | rough), evaluate, limit, alone, price, channels, reach)
    known = Known.of(found.value, region, pieces, found.piece)
    # What others tell nothing of tells nothing of its neighbours.
    apart = alone if reach is None else alone | (reach.pixel < 1)
    image = means(found.value, np.where(apart, EDGE, region) if apart.any() else region)
    cut = region == EDGE
    pixel, part = np.flatnonzero(~cut & (found.bound == 0)), np.flatnonzero(found.piece_bound == 0)
    value = np.hstack((image.reshape(channels, -1)[:, pixel], found.piece[:, part]))
    items = Items.of(pixel, region.ravel()[pixel], pieces.take(part), value, width)
    unsure = np.concatenate((alone.ravel()[pixel], own[part]))
    free = partial(shade.free, regions, needs)
    whole = np.zeros(pixel.size, dtype=bool)
    lone = _estimate(items, free, known, unsure, np.append(whole, rough[part]), _may_end(needs))
    if reach is not None:
        told = np.append(reach.pixel.ravel()[pixel], reach.piece[part])
        told[lone] /= 2  # of what is told from one side
        _beside(items, np.flatnonzero(told < 1), shade, convergence)
    np.copyto(image, 0.0, where=cut)
    lit = found.piece * pieces.area
    square = float(np.einsum("chw,chw->", image, image)) + float(np.einsum("ck,ck->", lit, lit))
    settled = float(np.einsum("hw,hw->", found.bound, found.bound, dtype=np.float64))
    sampled = shares_error(pieces.cell, found.piece, shown.sampled)
    settled += float(((found.piece_bound * pieces.area) ** 2).sum()) + sampled
    if small:
        fitted = small.items(regions, needs, shade, (FITTED * tolerance, square))
        of_pieces = np.flatnonzero(~fitted.whole)
        settled += shares_error(fitted.pixel[of_pieces], fitted.value[:, of_pieces], shown.sampled)
        square += fitted.square
        items = Items.joined(items, fitted)
    image.reshape(channels, -1)[:, pixel] = 0
    done = np.flatnonzero(found.piece_bound > 0)
    return First(items, image, surface, pieces.take(done), found.piece[:, done], square, settled, convergence)


def _reach(convergence: Convergence, region: Ints, pieces: Pieces) -> Reach | None:
    """How far values tell of pixels (h, w) and pieces; None if far enough everywhere."""
    if not convergence.near:
        return None
    reach, lit = np.full(region.shape, np.inf), np.flatnonzero(region >= 0)
    row, column = np.divmod(lit, region.shape[1])
    reach.reshape(-1)[lit] = convergence.radius(column + 0.5, row + 0.5, region.ravel()[lit])
    return Reach(reach, convergence.radius(pieces.x, pieces.y, pieces.region))


def _beside(items: Items, close: Ints, shade: Shade, convergence: Convergence) -> None:
    """Estimates of items (k,) so close to a light that a highlight fits in their pixels."""
    most, cells = convergence.beside(shade, items.x[close], items.y[close], items.region[close])
    shadowed = items.lost[close] > 0
    lost = UNSEEN * most * items.area[close]
    items.lost[close] = np.maximum(items.lost[close], lost)
    items.estimate[close] = np.maximum(items.estimate[close], lost)
    items.most[:, close] = np.where(shadowed, np.maximum(items.most[:, close], cells), cells)


def _price(regions: Regions, needs: Needs) -> Price:
    """What a value costs: most where shadows are those of big meshes."""
    if all(source.blockers.none for source in needs.sources):
        return BARE
    return SHADOWED if small_triangles(regions.geometry) is None else DEAR


def _doubtful(regions: Regions, needs: Needs, region: Ints, pieces: Pieces) -> tuple[Bools, Bools]:
    """In which pixels (h, w) and pieces (n,) a shadow may fit."""
    if not _may_end(needs):
        return np.zeros(region.shape, dtype=bool), np.zeros(pieces.cell.size, dtype=bool)
    return doubtful_places(regions, needs.sources, region, pieces)


def _may_end(needs: Needs) -> bool:
    """Whether some light is blocked somewhere, or ends by itself."""
    return any(not source.blockers.none or source.light.without_rim() != source.light for source in needs.sources)


def _estimate(items: Items, free: Shade, known: Known, unsure: Bools, rough: Bools, may_end: bool) -> Ints:
    """Estimates of the items' errors, see `refine` for the rules; returns the items whose surroundings are broken."""
    estimate = np.full(items.pixel.size, np.inf)
    pixel = items.pixel[items.whole]
    estimate[: pixel.size] = error_bound(known.centre, known.region, WITHIN, pixel)
    lone = np.flatnonzero(~np.isfinite(estimate))
    size, brightest = np.sqrt((items.value**2).sum(axis=0)), np.zeros(items.pixel.size)
    estimate[lone], brightest[lone] = first_estimates(
        known, items.pixel[lone], items.region[lone], items.x[lone], items.y[lone], summed(items.value[:, lone])
    )
    # A dark value proves nothing where it is doubtful: what is beside it may be the truth of half the piece.
    estimate = np.where(rough, np.maximum(size, brightest / math.sqrt(3)), estimate)
    most, some = np.zeros(items.pixel.size), distinct(np.append(np.flatnonzero(unsure), lone if may_end else lone[:0]))
    if some.size:
        most[some] = np.sqrt((free(items.x[some], items.y[some], items.region[some]) ** 2).sum(axis=0))
    items.estimate[:] = np.where(unsure, np.maximum(estimate, UNSEEN * most), estimate) * items.area
    items.dark[:] = (size < DEEP * most) & (items.estimate < UNSEEN * most)
    items.lost[:] = np.where(unsure, UNSEEN * most, 0.0) * items.area
    return lone


def _junction(every: Pieces, mine: Ints, label: Ints) -> Bools:
    """Pieces ``mine`` of pixels that show three regions or more: where a solid's corner stands, its shadow starts.

    Those labelled alike are one.
    """
    region = every.region.copy()
    region[mine] = label
    least = int(region.min(initial=0))
    base = int(region.max(initial=0)) - least + 1
    cells, count = np.unique(distinct(every.cell * base + (region - least)) // base, return_counts=True)
    return np.asarray(count[np.searchsorted(cells, every.cell[mine])] > 2)
