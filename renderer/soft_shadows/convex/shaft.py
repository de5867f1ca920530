"""Which occluders can matter: a conservative shaft for a block of points, then a ball against each point's cone.

The shaft is the convex hull of the points' box and the light's (Haines & Wallace 1994): a piece wholly outside one
of its planes hides nothing from any of the points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.renderer.vectors import Floats, Ints, dot

ROOM = 1e-9
"""How far outside, relative to the sizes, a piece must be: rounding never drops one."""
ROUNDING = 64 * 2.0**-53
"""What a plane of three products of coordinates may be off, relative to the largest, counted."""


@dataclass(frozen=True, eq=False)
class Bounds:
    """What holds bodies, each: balls and boxes about the same middles.

    Parameters
    ----------
    center, half : (3, m) float64
        The boxes' middles and half sides.
    radius : (m,) float64
    beyond : float
        Largest coordinate of the light.
    """

    center: Floats
    half: Floats
    radius: Floats
    beyond: float


def shaft_planes(points: Floats, light: Floats) -> tuple[Floats, Floats]:
    """Planes n . p <= d, n (3, k), that hold the boxes of points (3, n) and light (3, m).

    The sides of the common box, and in each coordinate plane the lines that touch both rectangles.
    """
    low = np.stack((points.min(axis=1), light.min(axis=1)))
    high = np.stack((points.max(axis=1), light.max(axis=1)))
    normals = [*np.eye(3), *-np.eye(3)]
    offsets = [*high.max(axis=0), *-low.min(axis=0)]
    for i, j in ((0, 1), (1, 2), (2, 0)):
        corners = np.array([[(a[i], b[j]) for a in (low[k], high[k]) for b in (low[k], high[k])] for k in (0, 1)])
        step = corners[1][None] - corners[0][:, None]  # (4, 4, 2): from each corner of one to each of the other
        across = np.stack((step[..., 1], -step[..., 0]), axis=-1).reshape(16, 2)
        touched = np.repeat(corners[0], 4, axis=0)
        height = (corners.reshape(8, 1, 2) * across).sum(axis=2) - (touched * across).sum(axis=1)
        for sign in (1.0, -1.0):
            holds = (sign * height <= 0).all(axis=0) & across.any(axis=1)
            n = np.zeros((holds.sum(), 3))
            n[:, i], n[:, j] = (sign * across[holds]).T
            normals.extend(n)
            offsets.extend((sign * across[holds] * touched[holds]).sum(axis=1))
    return np.array(normals).T, np.array(offsets)


def in_shaft(center: Floats, radius: Floats, n: Floats, d: Floats) -> Ints:
    """Balls that reach into a shaft of planes n . p <= d."""
    size = np.abs(d) + dot(np.abs(n)[:, :, None], np.abs(center)[:, None]).max(axis=1, initial=0)
    far = np.sqrt(dot(n, n))[:, None] * radius + ROOM * size[:, None]
    return np.flatnonzero(~(dot(n[:, :, None], center[:, None]) - d[:, None] > far).any(axis=0))


def reaching(bounds: Bounds, points: Floats, planes: Floats) -> tuple[Ints, Ints]:
    """Pairs (point, body), ascending in point, whose ball and box reach the inner side of all planes (3, p, n).

    The planes hold products of the points' and the light's coordinates: rounding may turn them by as much.
    """
    length, turned = np.sqrt(dot(planes, planes)), np.abs(planes)
    base = dot(planes, points[:, None])
    size = np.abs(points).max(initial=0) + np.abs(bounds.center).max(initial=0) + bounds.radius.max(initial=0)
    size += bounds.beyond
    center, half = bounds.center.T, bounds.half.T
    reaches = np.ones((bounds.radius.size, points.shape[1]), dtype=bool)
    for k in range(planes.shape[1]):
        height = center @ planes[:, k]
        height -= base[k]
        extent = np.minimum(half @ turned[:, k], bounds.radius[:, None] * length[k])
        extent += length[k] * (ROOM * size) + ROUNDING * size**3
        height += extent
        reaches &= height > 0
    point, body = np.nonzero(reaches.T)
    return point, body
