"""What every pixel shows: one region, or pieces of several."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.renderer.vectors import Ints, distinct

from .candidate_edges import find_lines, searched
from .edge_fragments import bits_of, cut_at_crossings
from .interpolation import shifted
from .moments import Edges, Pieces, pieces_of, visible_edges
from .regions import Regions
from .sampled import HALF_PLANE, Sampled, rays_in, resampled

EDGE = -2
"""Region of a pixel that an edge crosses."""
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
    """

    edges: Edges
    region: Ints
    pieces: Pieces
    sampled: Sampled


def shown_by(regions: Regions, tolerance: float) -> Shown:
    """What pixels show; the image's ``tolerance`` says how well those are sampled that cannot be cut."""
    width, height = regions.lens.width, regions.lens.height
    lines = find_lines(regions.geometry, regions.faces, regions.planes, regions.lens)
    bits, crowded = cut_at_crossings(bits_of(lines, width, height))
    edges = visible_edges(bits, regions)
    pieces, bad = pieces_of(edges, width, (1, 1), regions)
    crossed = distinct(pieces.cell)
    region = _whole_regions(regions, crossed, searched(regions.geometry) and not bad.size and not crowded.size)
    missed = _missed(region.reshape(height, width))
    if missed.size:
        region = _whole_regions(regions, crossed, False)
        missed = _missed(region.reshape(height, width))
    sampled = distinct(np.concatenate((bad, crowded, missed)))
    rays = rays_in(sampled, width * height, tolerance)
    pieces = resampled(pieces, sampled, rays, regions)
    region[sampled] = EDGE
    found = Sampled(sampled, HALF_PLANE * rays.shape[1] ** -0.75)
    return Shown(edges, region.reshape(height, width), pieces, found)


def _whole_regions(regions: Regions, crossed: Ints, runs: bool) -> Ints:
    """Regions (h w,) of all pixels, EDGE for those that an edge crosses.

    Rays for both ends of each run of pixels between edges in a row and now and then between, where all lines were
    looked for; else one for each pixel. A lost edge has an end, where some pixel's books do not balance, or parts a
    run, whose ends then differ.
    """
    width, height = regions.lens.width, regions.lens.height
    start = np.zeros(width * height, dtype=bool)
    start[:: RUN if runs else 1] = True
    for pixel in (np.arange(0, start.size, width), crossed + 1, crossed):
        start[np.minimum(pixel, start.size - 1)] = True
        start[np.maximum(pixel - 1, 0)] = True
    first = np.flatnonzero(start)
    seen = regions.seen(first % width + 0.5, first // width + 0.5)
    seen = seen.astype(np.result_type(np.int32, np.min_scalar_type(seen.max(initial=0))))
    region = np.repeat(seen, np.diff(np.append(first, start.size)))
    region[crossed] = EDGE
    return region


def _missed(region: Ints) -> Ints:
    """Pixels whose neighbour shows another region though no edge was found in either."""
    wrong = np.zeros(region.shape, dtype=bool)
    for dy, dx in ((0, 1), (1, 0)):
        beside = shifted(region, dy, dx, EDGE)
        apart = (region != beside) & (region != EDGE) & (beside != EDGE)
        wrong |= apart | shifted(apart, -dy, -dx, False).astype(bool)
    return np.flatnonzero(wrong)
