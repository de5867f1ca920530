"""Where shadows may fit in a pixel, looked for in squares of pixels first: most hold none.

What squares show of each region stands for itself: what fits in a pixel's cone fits in that of all that a square shows.
"""

from __future__ import annotations

import numpy as np

from nusselt.renderer.needs import Source
from nusselt.renderer.vectors import Bools, Floats, Ints, dot

from .doubt import Footprints, doubted, doubtful, footprints
from .moments import Pieces
from .regions import Regions

SQUARE = 4
"""Pixels in a side."""
AROUND = 1.11
"""How much larger than a square and half a pixel around it what stands for it is: it holds its pixels' footprints."""
STEEP = 0.2
"""Of the distance to the eye, that it may change by across what a square shows of a plane; and of that to a light, how
large that may be."""
FEWEST = 6
"""Points that are worth asking for them as one first."""
DENSE = 4
"""Squares and regions, by pixels, that are counted without sorting."""


def doubtful_places(regions: Regions, sources: tuple[Source, ...], region: Ints, pieces: Pieces) -> tuple[Bools, Bools]:
    """In which pixels (h, w) of regions not below 0, and in which pieces (n,), a shadow may fit."""
    width, whole = region.shape[1], _whole(region)
    row, column = np.nonzero(whole)
    rest = region >= 0
    inner = rest[: SQUARE * whole.shape[0], : SQUARE * whole.shape[1]]
    inner &= ~whole.repeat(SQUARE, axis=0).repeat(SQUARE, axis=1)
    pixel = np.append(SQUARE * (row * width + column), np.flatnonzero(rest))
    middle = np.where(np.arange(pixel.size) < row.size, SQUARE / 2, 0.5)
    x, y = np.append(pixel % width + middle, pieces.x), np.append(pixel // width + middle, pieces.y)
    which = np.append(region.ravel()[pixel], pieces.region).astype(np.int64)
    held = np.where(np.arange(x.size) < row.size, SQUARE * SQUARE, 1)
    found = _in_groups(regions, sources, x, y, which, held)
    i, j = np.divmod(np.arange(SQUARE * SQUARE), SQUARE)
    every = (pixel[: row.size][found[: row.size], None] + i * width + j).ravel()
    every = np.append(every, pixel[row.size :][found[row.size : pixel.size]])
    part = np.flatnonzero(found[pixel.size :])
    x, y = np.append(every % width + 0.5, pieces.x[part]), np.append(every // width + 0.5, pieces.y[part])
    doubt = doubtful(regions, sources, x, y, np.append(region.ravel()[every], pieces.region[part]))
    alone, own = np.zeros(region.shape, dtype=bool), np.zeros(pieces.cell.size, dtype=bool)
    alone.reshape(-1)[every], own[part] = doubt[: every.size], doubt[every.size :]
    return alone, own


def _whole(region: Ints) -> Bools:
    """Which squares (h // SQUARE, w // SQUARE) show one region, and nothing else."""
    tall, wide = (size // SQUARE * SQUARE for size in region.shape)
    first = region[:tall:SQUARE, :wide:SQUARE]
    same = first >= 0
    for k in range(1, SQUARE * SQUARE):
        same &= region[k // SQUARE : tall : SQUARE, k % SQUARE : wide : SQUARE] == first
    return np.asarray(same)


def _in_groups(regions: Regions, sources: tuple[Source, ...], x: Floats, y: Floats, region: Ints, held: Ints) -> Bools:
    """Which points (n,) are among those that a square shows of one region where a shadow may fit; some stand for as
    many pixels as they have ``held``.
    """
    if x.size == 0:
        return np.zeros(0, dtype=bool)
    wide, kinds = int(x.max()) // SQUARE + 1, int(region.max()) + 1
    key = ((y // SQUARE).astype(np.int64) * wide + (x // SQUARE).astype(np.int64)) * kinds + region
    if int(key.max()) < DENSE * x.size:
        group, count = key, np.bincount(key, held)
        number = np.arange(count.size)
    else:
        number, group = np.unique(key, return_inverse=True)
        count = np.bincount(group, held)
    here = np.flatnonzero(count)
    middle = [np.bincount(group, held * v)[here] / count[here] for v in (x, y)]
    square, kind = np.divmod(number[here], kinds)
    half = np.zeros(here.size)
    for place, v in zip((square % wide, square // wide), middle, strict=True):
        half = np.maximum(half, np.maximum(v - SQUARE * place, SQUARE * (place + 1) - v))
    whole = count[here] == SQUARE * SQUARE
    across, down = middle
    found = _steep(regions, across, down, kind, half, whole) | (count[here] < FEWEST)
    some = np.flatnonzero(~found)
    parts = footprints(regions, across[some], down[some], kind[some], 2 * AROUND * (half[some] + 0.5))
    found[some] = parts.radius >= regions.radii[kind[some] % regions.surfaces]
    found[some] |= _close(sources, parts) | doubted(regions, sources, parts)
    doubt = np.zeros(count.size, dtype=bool)
    doubt[here] = found
    return doubt[group]


def _close(sources: tuple[Source, ...], parts: Footprints) -> Bools:
    """Which footprints (n,) are near a light for their own size."""
    close = np.zeros(parts.radius.size, dtype=bool)
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
