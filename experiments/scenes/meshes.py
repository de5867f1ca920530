"""Closed triangle meshes of any size, made from a formula: no scanned data is shipped.

Every mesh is a closed manifold, wound counter-clockwise seen from outside.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.vectors import Floats, column, cross, dot, unit

Surface: TypeAlias = tuple[Floats, NDArray[np.int64]]
"""Vertices (3, v) and triangles (3, t)."""


def _quads(a: NDArray[np.int64], b: NDArray[np.int64], c: NDArray[np.int64], d: NDArray[np.int64]) -> NDArray[np.int64]:
    """Two triangles a b c and a c d for each quadrilateral: (3, 2 n)."""
    first = np.stack([v.ravel() for v in (a, b, c)])
    second = np.stack([v.ravel() for v in (a, c, d)])
    return np.hstack((first, second))


def displaced_sphere(triangles: int, radius: float = 1.0, bump: float = 0.08) -> Surface:
    """A sphere whose radius swings by the share ``bump`` in 9 waves around and 7 from pole to pole.

    Parameters
    ----------
    triangles : int
        About how many; at least 16 are made.
    """
    rings = max(3, round(math.sqrt(triangles / 4)) + 1)
    around = 2 * (rings - 1)
    u = 2 * math.pi * np.arange(around) / around
    v = math.pi * np.arange(1, rings)[:, None] / rings
    r = radius * (1 + bump * np.sin(9 * u) * np.sin(7 * v) * np.sin(v))
    ball = np.stack((r * np.sin(v) * np.cos(u), r * np.sin(v) * np.sin(u), r * np.cos(v) + 0 * u))
    poles = column([0, 0, radius]), column([0, 0, -radius])
    vertices = np.hstack((poles[0], ball.reshape(3, -1), poles[1]))
    ring = 1 + np.arange(around * (rings - 1)).reshape(rings - 1, around)
    after = np.roll(ring, -1, axis=1)
    sides = _quads(ring[:-1], ring[1:], after[1:], after[:-1])
    top = np.stack((np.zeros(around, dtype=np.int64), ring[0], after[0]))
    bottom = np.stack((np.full(around, vertices.shape[1] - 1), after[-1], ring[-1]))
    return vertices, np.hstack((top, sides, bottom))


def torus_knot(triangles: int, p: int = 2, q: int = 3, tube: float = 0.25) -> Surface:
    """A tube around the (p, q) torus knot, in the unit ball.

    Parameters
    ----------
    p, q : int
        Turns about the axis and about the core, coprime.
    tube : float
        Radius of the tube relative to the core's, small enough for the tube not to meet itself.
    """
    around = max(6, round(math.sqrt(triangles / 2 / 12)))
    along = max(24, round(triangles / 2 / around))
    t = 2 * math.pi * np.arange(along) / along
    big, small = 1.0, 0.45

    def curve(t: Floats) -> Floats:
        rho = big + small * np.cos(q * t)
        return np.stack((rho * np.cos(p * t), rho * np.sin(p * t), small * np.sin(q * t)))

    def outwards(t: Floats) -> Floats:
        return np.stack((np.cos(q * t) * np.cos(p * t), np.cos(q * t) * np.sin(p * t), np.sin(q * t)))

    step = 1e-5
    tangent = unit(curve(t + step) - curve(t - step))
    normal = outwards(t)  # of the torus: perpendicular to any curve on it, so the frame closes after one turn
    normal = unit(normal - tangent * dot(normal, tangent))
    binormal = cross(tangent, normal)
    angle = 2 * math.pi * np.arange(around) / around
    size = big + small + tube
    ring = np.cos(angle) * normal[:, :, None] + np.sin(angle) * binormal[:, :, None]
    vertices = (curve(t)[:, :, None] + tube * ring).reshape(3, -1) / size
    grid = np.arange(along * around).reshape(along, around)
    next_ring, next_spoke = np.roll(grid, -1, axis=0), np.roll(grid, -1, axis=1)
    return vertices, _quads(grid, next_spoke, np.roll(next_ring, -1, axis=1), next_ring)


def many_small(triangles: int, seed: int = 0) -> Surface:
    """Octahedra (8 triangles) turned at random, one in each cell of a cubic grid over [-1, 1]^3: they never meet."""
    count = max(1, round(triangles / 8))
    side = math.ceil(count ** (1 / 3))
    cell = np.stack(np.unravel_index(np.arange(count), (side, side, side)))
    rng = np.random.default_rng(seed)
    centre = (cell + 0.5) * (2 / side) - 1
    x, y, z, w = unit_quaternions(rng, count)
    axes = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )  # (3, 3 axes, count)
    arms = np.concatenate((axes, -axes), axis=1) * (0.95 / side)  # +x +y +z -x -y -z
    vertices = (centre[:, None, :] + arms).transpose(0, 2, 1).reshape(3, -1)
    faces = [(i, j, k) if _even(i, j, k) else (i, k, j) for i in (0, 3) for j in (1, 4) for k in (2, 5)]
    corner = np.array(faces).T[:, None, :] + 6 * np.arange(count)[:, None]
    return vertices, corner.reshape(3, -1)


def _even(i: int, j: int, k: int) -> bool:
    """Whether an even number of the arms i, j, k are negative: the face i j k is then wound outwards."""
    return (i // 3 + j // 3 + k // 3) % 2 == 0


def unit_quaternions(rng: np.random.Generator, n: int) -> Floats:
    """Uniform over the rotations, (4, n): normalised Gaussians."""
    v = rng.standard_normal((4, n))
    return np.asarray(v / np.sqrt((v * v).sum(axis=0)))
