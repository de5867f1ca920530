"""Where shadows may fit in a pixel, looked for in squares of pixels first: most hold none.

What squares show of each region stands for itself: what fits in a pixel's cone fits in that of all that a square shows.
"""

from __future__ import annotations

import numpy as np

from nusselt.renderer.needs import Source
from nusselt.renderer.vectors import Bools, Floats, Ints, dot

from .doubt import Footprints, Suspects, footprints, in_doubt
from .moments import Pieces
from .regions import Regions

SQUARE = 4
"""Pixels in a side of squares that show one region, which are taken as one from the start."""
SIDES = (32, 4)
"""Pixels a side of what is looked at as one, level by level."""
AROUND = 1.11
"""How much larger than a square and half a pixel around it what stands for it is where it is round: it holds its
pixels' footprints."""
STEEP = 0.2
"""Of the distance to the eye, that it may change by beside the middle of what a square shows of a plane; and of that
to a light, how large that may be."""


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
    half = np.where(np.arange(x.size) < row.size, (SQUARE - 1) / 2, 0.0)
    alone, own = np.zeros(region.shape, dtype=bool), np.zeros(pieces.cell.size, dtype=bool)
    i, j = np.divmod(np.arange(SQUARE * SQUARE), SQUARE)
    for source in sources:
        found, suspects = np.arange(x.size), Suspects.all_edges(x.size)
        for side in SIDES:
            going, suspects = _in_groups(
                regions, source, (x[found], y[found]), which[found], half[found], suspects, side
            )
            found, suspects = found[going], suspects.take(going)
        ends = np.searchsorted(found, (row.size, pixel.size))
        square, single, part = np.split(found, ends)
        every = np.append((pixel[square][:, None] + i * width + j).ravel(), pixel[single])
        part = part - pixel.size
        places = np.append(every % width + 0.5, pieces.x[part]), np.append(every // width + 0.5, pieces.y[part])
        parts = footprints(regions, *places, np.append(region.ravel()[every], pieces.region[part]))
        each = np.append(np.arange(ends[0]).repeat(SQUARE * SQUARE), np.arange(ends[0], found.size))
        point, _ = in_doubt(regions, source, parts, suspects.take(each))
        alone.reshape(-1)[every[point[point < every.size]]] = True
        own[part[point[point >= every.size] - every.size]] = True
    return alone, own


def _whole(region: Ints) -> Bools:
    """Which squares (h // SQUARE, w // SQUARE) show one region, and nothing else."""
    tall, wide = (size // SQUARE * SQUARE for size in region.shape)
    first = region[:tall:SQUARE, :wide:SQUARE]
    same = first >= 0
    for k in range(1, SQUARE * SQUARE):
        same &= region[k // SQUARE : tall : SQUARE, k % SQUARE : wide : SQUARE] == first
    return np.asarray(same)


def _in_groups(
    regions: Regions,
    source: Source,
    place: tuple[Floats, Floats],
    region: Ints,
    half: Floats,
    suspects: Suspects,
    side: int,
) -> tuple[Ints, Suspects]:
    """Which points (n,) are among those that a square, ``side`` pixels wide, shows of one region where a shadow of a
    light may fit, and which edges may throw it, among those that may already; some points stand for squares of
    pixels whose centres lie ``half`` (n,) around.
    """
    x, y = place
    if x.size == 0:
        return np.zeros(0, dtype=np.int64), suspects
    wide, kinds = int(x.max()) // side + 1, int(region.max()) + 1
    key = ((y // side).astype(np.int64) * wide + (x // side).astype(np.int64)) * kinds + region
    order = np.argsort(key, kind="stable")
    first = np.flatnonzero(np.diff(key[order], prepend=-1))
    kind, size = key[order[first]] % kinds, np.diff(np.append(first, x.size))
    low, high = (
        np.stack([f.reduceat((v + sign * half)[order], first) for v in (x, y)])
        for f, sign in ((np.minimum, -1), (np.maximum, 1))
    )
    (across, down), around = (low + high) / 2, (high - low) / 2
    held = np.add.reduceat(np.where(half[order] > 0, SQUARE * SQUARE, 1), first)
    flat = kind % regions.surfaces < regions.faces.count
    found = _steep(regions, across, down, kind, around)
    found |= ~flat & ((held < SQUARE * SQUARE) | (side > SQUARE))  # its normals turn
    some = np.flatnonzero(~found)
    flat, around = flat[some], around[:, some]
    width = np.where(flat, 1.0, AROUND * (SQUARE + 1))
    parts = footprints(regions, across[some], down[some], kind[some], width, np.where(flat, around, 0.0))
    wild = _close(source, parts) | (~flat & (parts.radius >= regions.radii[kind[some] % regions.surfaces]))
    found[some] = wild
    tame = np.flatnonzero(~wild)
    some, flat = some[tame], flat[tame]
    known = suspects.take(order[first])
    point, edge = in_doubt(regions, source, parts.take(tame), known.take(some))
    found[some[point]] = True
    known = known.given(some[flat], (np.cumsum(flat) - 1)[point[flat[point]]], edge[flat[point]])
    group = np.empty(x.size, dtype=np.int64)
    group[order] = np.repeat(np.arange(first.size), size)
    going = np.flatnonzero(found[group])
    return going, known.take(group)


def _close(source: Source, parts: Footprints) -> Bools:
    """Which footprints (n,) are near a light for what they stand for."""
    if source.light.at_infinity:
        return np.zeros(parts.radius.size, dtype=bool)
    to = source.light.middle()[0] - parts.position
    return np.asarray(parts.radius + parts.reach > STEEP * np.sqrt(dot(to, to)))


def _steep(regions: Regions, x: Floats, y: Floats, region: Ints, around: Floats) -> Bools:
    """Whether planes run too steeply, ``around`` (2, n) pixels about image points (n,), for one to tell of all."""
    surface, lens = region % regions.surfaces, regions.lens
    steep = np.zeros(x.size, dtype=bool)
    k = np.flatnonzero(surface < regions.faces.count)
    row = regions.pencil.planes.nearness[:, regions.faces.triangle[surface[k]]]
    change = sum(np.abs(dot(row, step)) * half for step, half in zip(lens.steps, around[:, k], strict=True))
    steep[k] = change > STEEP * dot(row, lens.directions(x[k], y[k]))
    return steep
