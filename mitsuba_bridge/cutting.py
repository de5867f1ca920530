"""Large triangles cut into pieces that are no larger than they are far from what is seen.

Mitsuba finds a point of a triangle from its corners in float32: on a floor of a million units the points under a table
are known to 0.06. Nothing is left out: pieces fit together, and a shadow falls from each. They are cut along whole
planes, every triangle by each, and a cut is where it is by the edge alone: neighbours have the same corners on it.
"""

from __future__ import annotations

import numpy as np

from nusselt.renderer.vectors import Bools, Floats, column, cross, dot

from .placement import Placement

FIRST, STEP = 4.0, 8.0
"""The innermost planes lie so many lengths of what is seen from its centre; further ones so many times as far."""
FARTHEST = 1e8
"""Lengths of what is seen from its centre beyond which nothing is sent: products of float32 end at 3e38."""


def planes(placement: Placement) -> list[float]:
    """Distances from the centre, along each axis and both ways, at which triangles are cut; none in ordinary scenes."""
    found: list[float] = []
    distance = FIRST * placement.near
    while placement.wide and distance < placement.half and len(found) < 64:
        found.append(distance)
        if distance >= FARTHEST * placement.near:
            break
        distance *= STEP
    return found


def cut(corners: Floats, placement: Placement) -> Floats | None:
    """Triangles (3, t, 3 corners) about the placement's centre as pieces, (3, s, 3); None if none is cut."""
    distances = planes(placement)
    if not distances or not (placement.away(corners.reshape(3, -1)) > distances[0]).any():
        return None
    centred = corners - column(placement.centre)[:, :, None]
    large = (np.abs(centred).max(axis=(0, 2)) > distances[0]) & ~_beyond(centred, distances[0])
    kept = centred[:, ~large]
    pieces: Floats = centred[:, large]
    for axis in range(3):
        for distance in distances:
            for offset in (distance, -distance):
                pieces = _split(pieces, pieces[axis] - offset)
    every = np.concatenate((kept, pieces), axis=1)
    if distances[-1] >= FARTHEST * placement.near:
        every = every[:, ~_beyond(every, distances[-1] * (1 - 1e-9))]
    return np.asarray(every + column(placement.centre)[:, :, None])


def _beyond(corners: Floats, distance: float) -> Bools:
    """Triangles wholly beyond one of the six planes at a distance."""
    outside = (corners.min(axis=2) >= distance) | (corners.max(axis=2) <= -distance)
    return np.asarray(outside.any(axis=0))


def _split(corners: Floats, height: Floats) -> Floats:
    """Triangles (3, t, 3) cut where the heights (t, 3) of their corners change sign."""
    above = height > 0
    crossed = above.any(axis=1) & ~above.all(axis=1)
    if not crossed.any():
        return corners
    whole, height, above = corners[:, ~crossed], height[crossed], above[crossed]
    # The corner that is alone on its side comes first; the order around stays.
    first = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), (~above).argmax(axis=1))
    turn = (first[:, None] + np.arange(3)) % 3
    p = np.take_along_axis(corners[:, crossed], turn[None], axis=2)
    height = np.take_along_axis(height, turn, axis=1)
    alone, b, c = (p[:, :, k] for k in range(3))
    on_b, on_c = (_crossing(alone, p[:, :, k], height[:, 0], height[:, k]) for k in (1, 2))
    pieces = [np.stack(three, axis=2) for three in ((alone, on_b, on_c), (on_b, b, c), (on_b, c, on_c))]
    every = np.concatenate(pieces, axis=1)
    area = cross(every[:, :, 1] - every[:, :, 0], every[:, :, 2] - every[:, :, 0])
    return np.concatenate((whole, every[:, dot(area, area) > 0]), axis=1)


def _crossing(p: Floats, q: Floats, height_p: Floats, height_q: Floats) -> Floats:
    """Where edges meet the plane, the same to the last digit from whichever end they are given."""
    swap = height_p > 0
    low, high = np.where(swap, q, p), np.where(swap, p, q)
    below, over = np.where(swap, height_q, height_p), np.where(swap, height_p, height_q)
    return np.asarray(low + (high - low) * (-below / (over - below)))
