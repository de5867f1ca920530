"""First hits and shadow rays, every ray against every surface at once.

Triangles by the sides of Pluecker's line coordinates (Teller & Hohmeyer 1999), so that all tests are two products of
matrices; spheres in their own space; parallelograms by their dual edges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .world import Bools, Floats, Light, World

NEAR = 1e-9
"""Share of a shadow ray at either end within which nothing blocks."""
NOTHING, LIGHT = -1, -2


def dot(a: Floats, b: Floats) -> Floats:
    """Products of vectors (3, ...)."""
    return np.asarray(np.einsum("i...,i...->...", a, b))


def crossings(corners: Floats, o: Floats, d: Floats) -> tuple[Floats, Bools]:
    """Where rays o + t d (3, n) cross the planes of triangles (t, 3, 3), and whether inside: (n, t) each."""
    following = np.roll(corners, -1, axis=1)
    moment, edge = np.cross(corners, following), following - corners
    sides = np.concatenate((moment, edge), axis=2).reshape(-1, 6)
    lines = np.concatenate((d, np.cross(o, d, axis=0)))
    side = (lines.T @ sides.T).reshape(d.shape[1], len(corners), 3)
    inside = np.asarray((side >= 0).all(axis=2) | (side <= 0).all(axis=2))
    normal = np.cross(edge[:, 0], edge[:, 1])
    height = np.einsum("ti,ti->t", normal, corners[:, 0]) - o.T @ normal.T
    with np.errstate(divide="ignore", invalid="ignore"):
        return height / (d.T @ normal.T), inside


def ball_roots(inverse: Floats, o: Floats, d: Floats) -> tuple[Floats, Floats]:
    """Both t (b, n) at which rays meet balls, the inverses (b, 4, 4) of their matrices given; NaN where they miss."""
    a = np.einsum("bij,jn->bin", inverse[:, :3, :3], o) + inverse[:, :3, 3, None]
    b = np.einsum("bij,jn->bin", inverse[:, :3, :3], d)
    bb, ab, aa = (np.einsum("bin,bin->bn", p, q) for p, q in ((b, b), (a, b), (a, a)))
    with np.errstate(invalid="ignore"):
        root = np.sqrt(ab * ab - bb * (aa - 1))
    return (-ab - root) / bb, (-ab + root) / bb


def quad_crossing(light: Light, o: Floats, d: Floats) -> tuple[Floats, Bools]:
    """Where rays (3, n) cross a parallelogram's plane, and whether inside."""
    n = np.cross(light.u, light.v)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (n @ (light.place[:, None] - o)) / (n @ d)
        q = o + t * d - light.place[:, None]
    x, y = (np.cross(light.v, n) @ q, np.cross(n, light.u) @ q)
    size = n @ n
    with np.errstate(invalid="ignore"):
        return t, (x >= 0) & (x <= size) & (y >= 0) & (y <= size)


@dataclass(frozen=True)
class Hits:
    """What n rays meet first.

    Parameters
    ----------
    position, normal, towards : (3, n)
        Of the surface; ``towards`` is the unit direction to where the ray came from.
    surface : (n,) int
        A triangle's number, a ball's after the triangles, `NOTHING` or `LIGHT`.
    light : (n,) int
        Number of the light that is met, or -1.
    material : (n,) int
    front : (n,) bool
    """

    position: Floats
    normal: Floats
    towards: Floats
    surface: NDArray[np.int64]
    light: NDArray[np.int64]
    material: NDArray[np.int64]
    front: Bools

    def take(self, some: Bools) -> Hits:
        """Some of them."""
        return Hits(**{name: values[..., some] for name, values in vars(self).items()})

    @property
    def shaded(self) -> Bools:
        """A surface, and no light's."""
        return self.surface >= 0


def trace(world: World, o: Floats, d: Floats) -> Hits:
    """First hits of rays (3, n) with unit directions."""
    n, count = d.shape[1], len(world.triangles)
    t, inside = crossings(world.triangles, o, d)
    near = np.where(inside & (t > NEAR), t, np.inf)
    inverse = np.asarray(np.linalg.inv(world.balls), dtype=float)
    low, high = ball_roots(inverse, o, d)
    with np.errstate(invalid="ignore"):
        balls = np.where(low > NEAR, low, np.where(high > NEAR, high, np.inf))
    quads = [(number, *quad_crossing(light, o, d)) for number, light in enumerate(world.lights) if light.kind == "quad"]
    lights = [np.where(inside & (t > NEAR), t, np.inf) for _, t, inside in quads]
    every = np.concatenate((near, balls.T, np.array(lights).reshape(len(lights), n).T, np.full((n, 1), np.inf)), axis=1)
    first = every.argmin(axis=1)
    distance = every[np.arange(n), first]
    missed = ~np.isfinite(distance)
    position = o + np.where(missed, 0.0, distance) * d
    bodies = count + len(world.balls)
    surface = np.where(missed, NOTHING, np.where(first < bodies, first, LIGHT))
    numbers = np.array([number for number, _, _ in quads], dtype=int)
    light = np.where(surface == LIGHT, np.append(numbers, -1)[np.clip(first - bodies, 0, len(numbers))], -1)
    normal = _normals(world, position, first, inverse)
    for number in numbers:
        normal[:, light == number] = world.lights[number].normal[:, None]
    kinds = np.concatenate((world.triangle_material, world.ball_material, [0]))
    return Hits(position, normal, -d, surface, light, kinds[np.minimum(first, bodies)], -dot(normal, d) > 0)


def _normals(world: World, position: Floats, first: NDArray[np.int64], inverse: Floats) -> Floats:
    """Unit normals (3, n) of the surfaces that are met, by their winding or outwards."""
    count, normal = len(world.triangles), np.zeros(position.shape)
    edges = world.triangles[:, 1:] - world.triangles[:, :1]
    flat = np.cross(edges[:, 0], edges[:, 1]).T
    on = first < count
    normal[:, on] = flat[:, first[on]]
    for number, matrix in enumerate(inverse):
        on = first == count + number
        normal[:, on] = matrix[:3, :3].T @ (matrix[:3, :3] @ position[:, on] + matrix[:3, 3:])
    length = np.sqrt(dot(normal, normal))
    return np.divide(normal, length, out=normal, where=length > 0)


def visible(world: World, hits: Hits, d: Floats, light: Light, low: float = NEAR, high: float = 1 - NEAR) -> Floats:
    """1 where nothing stands along d (3, n, s) from the hits, else 0: (n, s).

    Parameters
    ----------
    d : (3, n, s)
        To the light's point, or a unit direction to a light at infinity.
    low, high : float
        What is met before and after these shares of the way blocks nothing.
    """
    n, s = d.shape[1:]
    o, own = np.repeat(hits.position, s, axis=1), np.repeat(hits.surface, s)
    ways = d.reshape(3, -1)
    end = np.inf if light.kind in ("directional", "sun") else high
    t, inside = crossings(world.triangles, o, ways)
    numbers, inverse = np.arange(len(world.triangles)), np.asarray(np.linalg.inv(world.balls), dtype=float)
    blocked = (inside & (t > low) & (t < end) & (own[:, None] != numbers)).any(axis=1)
    for number, roots in enumerate(zip(*ball_roots(inverse, o, ways), strict=True)):
        other = own != len(world.triangles) + number
        with np.errstate(invalid="ignore"):
            blocked |= other & np.any([(root > low) & (root < end) for root in roots], axis=0)
    for body in world.lights:
        if body.kind == "quad" and body is not light:
            t, within = quad_crossing(body, o, ways)
            blocked |= within & (t > low) & (t < end)
    return (~blocked).astype(float).reshape(n, s)
