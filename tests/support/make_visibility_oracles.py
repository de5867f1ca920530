"""Makes visibility_oracles.npz: irradiance behind the blocks of cornell-boxes, by polygons in 40 digits.

Shares nothing with the renderer's way: every block is projected from the point onto the light's plane, its convex hull
taken, and the light's polygon (cut at the horizon) clipped by the hulls; by inclusion and exclusion
E = E(light) - E(light & hull 1) - E(light & hull 2) + E(light & hull 1 & hull 2), each by Lambert's formula.

    python tests/support/make_visibility_oracles.py [points]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from mpmath import mp, mpf

from nusselt.experiments.scenes import catalogue
from nusselt.renderer.geometry.arrays import build_geometry

mp.dps = 40
TARGET = Path(__file__).with_name("visibility_oracles.npz")
RANDOM = 2000
"""Points kept as they come; of the rest, those in penumbra."""
BLOCKS = (slice(10, 22), slice(22, 34))
"""The triangles of each block."""


def sub(a, b):
    return [x - y for x, y in zip(a, b, strict=True)]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def clip(polygon, height):
    """The part of a polygon where an affine function is not negative."""
    out = []
    values = [height(p) for p in polygon]
    for k, (p, h) in enumerate(zip(polygon, values, strict=True)):
        q, g = polygon[(k + 1) % len(polygon)], values[(k + 1) % len(polygon)]
        if h >= 0:
            out.append(p)
        if h * g < 0:
            out.append([a + h / (h - g) * (b - a) for a, b in zip(p, q, strict=True)])
    return out


def hull(points):
    """Convex hull of points in the plane, counter-clockwise (Andrew's chain)."""
    points = sorted(set(map(tuple, points)))

    def chain(sequence):
        out = []
        for p in sequence:
            while len(out) > 1 and turn(out[-2], out[-1], p) <= 0:
                out.pop()
            out.append(p)
        return out[:-1]

    return chain(points) + chain(points[::-1])


def turn(a, b, p):
    return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])


def lambert(polygon, x, n):
    """|E| of a polygon (x, z) in the light's plane y = Y."""
    total = mpf(0)
    arms = [sub([p[0], LIGHT_Y, p[1]], x) for p in polygon]
    for k, a in enumerate(arms):
        b = arms[(k + 1) % len(arms)]
        g = cross(a, b)
        length = mp.sqrt(dot(g, g))
        if length > 0:
            total += mp.atan2(length, dot(a, b)) * dot(n, g) / length
    return abs(total) / 2


def block_shadow(triangles, x):
    """Hull of a block's projection from x onto the light's plane; only what is above x can hide anything."""
    points = []
    floor = x[1] + mpf(10) ** -25
    for corners in triangles:
        for p in clip(corners, lambda p: p[1] - floor):
            s = (LIGHT_Y - x[1]) / (p[1] - x[1])
            points.append((x[0] + s * (p[0] - x[0]), x[2] + s * (p[2] - x[2])))
    return hull(points) if len(points) > 2 else []


def irradiance(x, n, own):
    """Visible and unoccluded irradiance for unit radiance."""
    if x[1] >= LIGHT_Y:
        return mpf(0), mpf(0)
    light = clip(LIGHT, lambda p: dot(n, sub([p[0], LIGHT_Y, p[1]], x)))
    if len(light) < 3:
        return mpf(0), mpf(0)
    whole = lambert(light, x, n)
    shadows = [block_shadow(b, x) for k, b in enumerate(BODIES) if k != own]
    value, both = whole, light
    for shadow in filter(None, shadows):
        value -= lambert(within(light, shadow), x, n)
        both = within(both, shadow)
    if len([s for s in shadows if s]) == 2:
        value += lambert(both, x, n)
    return value, whole


def within(polygon, convex):
    for k, a in enumerate(convex):
        b = convex[(k + 1) % len(convex)]
        if len(polygon) > 2:
            polygon = clip(polygon, lambda p, a=a, b=b: turn(a, b, p))
    return polygon if len(polygon) > 2 else []


SCENE = catalogue.load("cornell-boxes")
GEOMETRY = build_geometry(SCENE)
LAMP = SCENE.quad_lights[0]
LIGHT_Y = mpf(LAMP.corner[1])
LIGHT = [
    [
        mpf(LAMP.corner[0]) + u * mpf(LAMP.ab[0]) + v * mpf(LAMP.ac[0]),
        mpf(LAMP.corner[2]) + u * mpf(LAMP.ab[2]) + v * mpf(LAMP.ac[2]),
    ]
    for u, v in ((0, 0), (1, 0), (1, 1), (0, 1))
]
CORNERS = np.stack((GEOMETRY.a, GEOMETRY.b, GEOMETRY.c), axis=2)
BODIES = [
    [[[mpf(float(c)) for c in CORNERS[:, t, k]] for k in range(3)] for t in range(*b.indices(99))] for b in BLOCKS
]


def main(count: int) -> None:
    rng = np.random.default_rng(20)
    triangle = rng.integers(0, 34, count)
    u, v = rng.random((2, count))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    a, b, c = (CORNERS[:, triangle, k] for k in range(3))
    position = a + u * (b - a) + v * (c - a)
    normal = GEOMETRY.normal[:, triangle]
    normal = normal / np.linalg.norm(normal, axis=0)
    values = np.zeros((2, count))
    for k in range(count):
        own = next((j for j, block in enumerate(BLOCKS) if block.start <= triangle[k] < block.stop), -1)
        x, n = ([mpf(float(w)) for w in vector[:, k]] for vector in (position, normal))
        values[:, k] = [float(e) for e in irradiance(x, n, own)]
    penumbra = (values[0] < values[1] * (1 - 1e-12)) & (values[0] > 1e-12 * values[1])
    kept = np.flatnonzero(penumbra | (np.arange(count) < RANDOM))
    arrays = {"position": position, "normal": normal, "irradiance": values[0], "unoccluded": values[1]}
    np.savez_compressed(TARGET, **{name: array[..., kept] for name, array in arrays.items()})
    print(count, "points,", int(penumbra.sum()), "of them in penumbra")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 12_000)
