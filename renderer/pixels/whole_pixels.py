"""What every pixel shows: one region, or pieces of several.

Visible edges are found (see `candidate_edges`, `visible_folds`) and cut pixel by pixel (`edge_fragments`); what they
bound there is summed (`moments`), and the pixels between them are told in runs. Pixels that hold too many edges, or
whose books do not balance, are sampled (`sampled`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.renderer.vectors import Bools, Ints, distinct

from .candidate_edges import SIDE, find_lines, searched
from .edge_fragments import Bits, bits_of, cut_at_crossings, thinned
from .folds import Folds, folds_of
from .interpolation import shifted
from .moments import PIXEL, Borders, Edges, Pieces, pieces_between, visible_edges
from .regions import Regions
from .sampled import HALF_PLANE, Sampled, rays_in, resampled
from .visible_folds import away_from, visible_folds

EDGE = -2
"""Region of a pixel that an edge crosses."""
UNKNOWN = -3
"""Region of one that is not known yet."""
RUN = 16
"""Pixels of a row that one ray may speak for."""


@dataclass(frozen=True, eq=False)
class Shown:
    """What an image shows.

    Parameters
    ----------
    edges : Edges
        Visible ones.
    region : (h, w) int32, or int64 where there are so many
        EDGE where one passes.
    pieces : Pieces
        Of the pixels that one crosses.
    sampled : Sampled
        Pixels whose pieces were found by rays.
    bent : (p,) bool
        Pieces whose centroids may show something else.
    """

    edges: Edges
    region: Ints
    pieces: Pieces
    sampled: Sampled
    bent: Bools


def shown_by(regions: Regions, tolerance: float) -> Shown:
    """What pixels show; the image's ``tolerance`` says how well those are sampled that cannot be cut.

    Where a pixel's books do not balance, folds (see `folds`) are asked again as all other lines are.
    """
    geometry, faces, width, height = regions.geometry, regions.faces, regions.lens.width, regions.lens.height
    folds = folds_of(geometry, faces, regions.lens, regions.creased[:, : faces.count], regions.far)
    for _ in range(2):
        edges, broken, crowded = _edges(regions, folds)
        borders = Borders.of(edges, width, PIXEL, regions)
        pieces, bad = pieces_between(borders, edges, width, PIXEL)
        if bad.size == 0 or folds.edge.size == 0:
            break
        folds = away_from(folds, bad, regions)
    crossed = distinct(np.append(borders.cells, crowded))
    sure = searched(geometry, faces) and not bad.size
    region = _whole_regions(regions, crossed, borders if sure else None)
    missed = _missed(region.reshape(height, width))
    if missed.size:
        region = _whole_regions(regions, crossed, None)
        missed = _missed(region.reshape(height, width))
    sampled = distinct(np.concatenate((bad, crowded, missed)))
    rays = rays_in(sampled, width * height, tolerance)
    pieces = resampled(pieces, sampled, rays, regions)
    region[sampled] = EDGE
    found = Sampled(sampled, HALF_PLANE * rays.shape[1] ** -0.75)
    return Shown(edges, region.reshape(height, width), pieces, found, _bent(pieces, edges.bits, broken, regions))


def _edges(regions: Regions, folds: Folds) -> tuple[Edges, Ints, Ints]:
    """Visible edges; cells in which some are no folds; and cells that are too crowded for them to be found."""
    lens = regions.lens
    lines = find_lines(regions.geometry, regions.faces, regions.planes, lens, folds.edge)
    bits, crowded = thinned(bits_of(lines, lens.width, lens.height))
    if folds.edge.size == 0:
        edges = visible_edges(cut_at_crossings(bits, bits.take(crowded[:0])), regions)
        return edges, edges.bits.cell, crowded
    folded, along = visible_folds(folds, bits, crowded, regions)
    if along.cell.size:
        bits, more = thinned(Bits.joined(bits, along))
        crowded = np.append(crowded, more)
    order = np.argsort(folded.bits.cell, kind="stable")
    folded = folded.take(order[~np.isin(folded.bits.cell[order], crowded)])
    edges = visible_edges(cut_at_crossings(bits, folded.bits), regions)
    return Edges.joined(edges, folded), edges.bits.cell, crowded


def _whole_regions(regions: Regions, crossed: Ints, borders: Borders | None) -> Ints:
    """Regions (h w,) of all pixels, EDGE for those that an edge crosses.

    Both ends of each run of pixels between edges in a row show what is seen on the borders there; rays tell where
    that is not known, and now and then between, if all lines were looked for and borders are given; else of each pixel.
    A lost edge has an end, where some pixel's books do not balance, or parts a run, whose ends then differ.
    """
    width, height = regions.lens.width, regions.lens.height
    start = np.zeros(width * height, dtype=bool)
    start[:: RUN if borders else 1] = True
    for pixel in (np.arange(0, start.size, width), crossed + 1, crossed):
        start[np.minimum(pixel, start.size - 1)] = True
        start[np.maximum(pixel - 1, 0)] = True
    label = np.full(start.size, UNKNOWN)
    if borders:
        for side, step in enumerate((-1, 1)):
            whole = np.flatnonzero((borders.count[side] == 1) & (borders.cells % width != side * (width - 1)))
            label[borders.cells[whole] + step] = borders.seen[borders.first[side, whole]]
    label[crossed] = EDGE
    first = np.flatnonzero(start)
    asked = first[label[first] == UNKNOWN]
    label[asked] = regions.seen(asked % width + 0.5, asked // width + 0.5)
    seen = label[first].astype(np.result_type(np.int32, np.min_scalar_type(label.max(initial=0))))
    return np.repeat(seen, np.diff(np.append(first, start.size)))


def _bent(pieces: Pieces, bits: Bits, broken: Ints, regions: Regions) -> Bools:
    """Pieces (p,) that may not be convex.

    One straight edge leaves two that are; and so is what folds alone cut out of a triangle.
    """
    pixels, faces = regions.lens.width * regions.lens.height, regions.faces
    count, mixed, curved = np.bincount(bits.cell, minlength=pixels), *np.zeros((2, pixels), dtype=bool)
    mixed[broken] = True
    curved[bits.cell[bits.reach > SIDE]] = True
    single = np.append(np.bincount(faces.of_triangle, minlength=faces.count) == 1, False)
    plain = single[np.minimum(pieces.region % regions.surfaces, faces.count)] & (pieces.region >= 0)
    return np.asarray(curved[pieces.cell] | ((count[pieces.cell] != 1) & (mixed[pieces.cell] | ~plain)))


def _missed(region: Ints) -> Ints:
    """Pixels whose neighbour shows another region though no edge was found in either."""
    wrong = np.zeros(region.shape, dtype=bool)
    for dy, dx in ((0, 1), (1, 0)):
        beside = shifted(region, dy, dx, EDGE)
        apart = (region != beside) & (region != EDGE) & (beside != EDGE)
        wrong |= apart | shifted(apart, -dy, -dx, False).astype(bool)
    return np.flatnonzero(wrong)
