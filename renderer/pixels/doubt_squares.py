"""Where shadows may fit in a pixel, looked for in squares of pixels first: most hold none.

What squares show of each region stands for itself: what fits in a pixel's cone fits in that of all that a square shows.
"""

from __future__ import annotations

import numpy as np

from nusselt.renderer.needs import Source
from nusselt.renderer.vectors import Bools, Floats, Ints, dot

from .doubt import doubtful, footprints
from .moments import Pieces
from .regions import Regions

SQUARE = 8
"""Pixels in a side."""
AROUND = 1.25
"""How much larger than a square what stands for it is: it holds all of its pixels' footprints."""
STEEP = 0.2
"""Of the distance to the eye, that it may change by across what a square shows of a plane; and of that to a light, how
large that may be."""
FEWEST = 16
"""Points that are worth asking for them as one first."""
DENSE = 4
"""Squares and regions, by pixels, that are counted without sorting."""


def doubtful_places(regions: Regions, sources: tuple[Source, ...], region: Ints, pieces: Pieces) -> tuple[Bools, Bools]:
    """In which pixels (h, w) of regions not below 0, and in which pieces (n,), a shadow may fit."""
    width = region.shape[1]
    every = np.flatnonzero(region >= 0)
    row, column = np.divmod(every, width)
    x, y = np.append(column + 0.5, pieces.x), np.append(row + 0.5, pieces.y)
    which = np.append(region.ravel()[every], pieces.region).astype(np.int64)
    found = _in_groups(regions, sources, x, y, which)
    some = np.flatnonzero(found)
    found[some] = doubtful(regions, sources, x[some], y[some], which[some])
    alone = np.zeros(region.shape, dtype=bool)
    alone.reshape(-1)[every] = found[: every.size]
    return alone, found[every.size :]


def _in_groups(regions: Regions, sources: tuple[Source, ...], x: Floats, y: Floats, region: Ints) -> Bools:
    """Which points (n,) are among those that a square shows of one region where a shadow may fit."""
    if x.size == 0:
        return np.zeros(0, dtype=bool)
    wide, kinds = int(x.max()) // SQUARE + 1, int(region.max()) + 1
    key = ((y // SQUARE).astype(np.int64) * wide + (x // SQUARE).astype(np.int64)) * kinds + region
    if int(key.max()) < DENSE * x.size:
        group, count = key, np.bincount(key)
        number = np.arange(count.size)
    else:
        number, group = np.unique(key, return_inverse=True)
        count = np.bincount(group)
    held = np.flatnonzero(count)
    middle = [np.bincount(group, v)[held] / count[held] for v in (x, y)]
    square, kind = np.divmod(number[held], kinds)
    half = np.zeros(held.size)
    for place, v in zip((square % wide, square // wide), middle, strict=True):
        half = np.maximum(half, np.maximum(v - SQUARE * place, SQUARE * (place + 1) - v))
    whole = count[held] == SQUARE * SQUARE
    across, down = middle
    found = _steep(regions, across, down, kind, half, whole) | (count[held] < FEWEST)
    some = np.flatnonzero(~found)
    across, down, kind, size = across[some], down[some], kind[some], 2 * AROUND * half[some]
    found[some] = _close(regions, sources, across, down, kind, size)
    found[some] |= doubtful(regions, sources, across, down, kind, size)
    doubt = np.zeros(count.size, dtype=bool)
    doubt[held] = found
    return doubt[group]


def _close(regions: Regions, sources: tuple[Source, ...], x: Floats, y: Floats, region: Ints, size: Floats) -> Bools:
    """Whether what is ``size`` (n,) pixels wide about image points (n,) is near a light for its own size."""
    parts = footprints(regions, x, y, region, size)
    close = np.zeros(x.size, dtype=bool)
    for light in (source.light for source in sources if not source.light.at_infinity):
        to = light.middle()[0] - parts.position
        close |= parts.radius > STEEP * np.sqrt(dot(to, to))
    return close


def _steep(regions: Regions, x: Floats, y: Floats, region: Ints, half: Floats, whole: Bools) -> Bools:
    """Whether surfaces run too steeply, ``half`` (n,) pixels about image points (n,), for one point to tell of all.

    Of what is round, squares that show more than it.
    """
    surface, lens = region % regions.surfaces, regions.lens
    flat = surface < regions.faces.count
    steep = ~flat & ~whole
    k = np.flatnonzero(flat)
    row = regions.pencil.planes.nearness[:, regions.faces.triangle[surface[k]]]
    near, steps = dot(row, lens.directions(x[k], y[k])), (2 * lens.right / lens.width, 2 * lens.up / lens.height)
    change = (np.abs(dot(row, steps[0])) + np.abs(dot(row, steps[1]))) * half[k]
    steep[k] = change > STEEP * near
    return np.asarray(steep)
