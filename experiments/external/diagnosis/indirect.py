"""Light that surfaces send to each other, where it should be that of lights alone: one bounce, estimated at few points.

It is smooth, so that a few hundred points serve, each with directions by the cosine. What those meet is lit by a few
samples of every light; between the points it is interpolated.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from nusselt.renderer.camera.first_hits import Hits
from nusselt.renderer.camera.view import shading_points
from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Bools, Floats, Ints, dot, frame

from .case import Case, Guess
from .probe import Probe, Sight

FIRST, THEN = (256, 5), (1024, 11)
"""Points, and directions of each along one side of their cells: to see whether it may be that, and if so."""
NEARLY = 0.4
"""Share of the squares that few must explain for more to be taken."""
SAMPLES = 4
"""Of each light, where a direction ends."""
TESTS = 1 << 26
"""Tests of directions against triangles and ellipsoids, at most."""
NEIGHBOURS = 4
"""Points that a pixel's indirect light is the mean of, weighted by one over their squared distance."""
BRIGHTER = 0.8
"""Share of the squares that is of brighter pixels, at least: light is added."""
NEAR = 1e-9
"""Share of a scene's size within which a direction meets nothing."""


def indirect(case: Case) -> Iterator[Guess]:
    """One bounce; a share of it, or more than one."""
    step = np.where(case.shaded, case.observed - case.truth, 0.0) * np.sqrt(case.weight)
    if (np.maximum(step, 0) ** 2).sum() <= BRIGHTER * (step**2).sum():
        return
    bounce, factor = _bounce(case, *FIRST)
    if case.distance(case.truth + factor * bounce) > (1 - NEARLY) * case.distance(case.truth):
        return
    bounce, factor = _bounce(case, *THEN)
    yield Guess("indirect-light", case.truth + bounce, "one bounce of indirect light is there too")
    told = f"indirect light is there too: {factor:.3g} times that of one bounce"
    yield Guess("indirect-light", case.truth + factor * bounce, told, 1)
    albedo = np.zeros_like(case.truth)
    albedo[:, case.probe.sight.lit] = case.probe.sight.points.diffuse
    factors = np.maximum(case.combined(np.stack((bounce, albedo)), case.truth, case.shaded), 0.0)
    told = f"indirect light is there too: {factors[0]:.3g} times that of one bounce, and {factors[1]:.3g} everywhere"
    yield Guess("indirect-light", case.truth + factors[0] * bounce + factors[1] * albedo, told, 2)


def _bounce(case: Case, count: int, side: int) -> tuple[Floats, float]:
    """What one bounce adds (3, n), and how many times it fits best."""
    probe, bounce = case.probe, np.zeros_like(case.truth)
    points = probe.sight.points
    bodies = max(probe.geometry.triangles + probe.geometry.ellipsoids, 1)
    chosen = np.random.default_rng(probe.seed).permutation(points.count)[: min(count, TESTS // (bodies * side**2))]
    if chosen.size < NEIGHBOURS:
        return bounce, 0.0
    some = points.take(chosen)
    d = _by_cosine(some.normal, side, np.random.default_rng([probe.seed, side]))
    met = _first(probe.geometry, np.repeat(some.position, side**2, axis=1), d)
    arriving = _reflected(probe, met, -d).reshape(3, chosen.size, side**2).mean(axis=2)
    bounce[:, probe.sight.lit] = points.diffuse * _between(
        points, probe.sight.surface[probe.sight.lit], chosen, arriving
    )
    return bounce, max(float(case.combined(bounce[None], case.truth, case.shaded)[0]), 0.0)


def _by_cosine(normal: Floats, side: int, rng: np.random.Generator) -> Floats:
    """Unit directions (3, n side^2) about normals (3, n), by their cosine: one in each cell."""
    n = normal.shape[1]
    cells = np.stack(np.divmod(np.arange(side**2), side))[:, None]
    u, v = (cells + rng.random((2, n, side**2))) / side
    x, y = frame(normal)
    r, phi = np.sqrt(u), 2 * math.pi * v
    parts = ((x, r * np.cos(phi)), (y, r * np.sin(phi)), (normal, np.sqrt(1 - u)))
    return np.asarray(sum(axis[:, :, None] * share for axis, share in parts).reshape(3, -1))


def _first(g: Geometry, o: Floats, d: Floats) -> Hits:
    """What rays (3, n) meet first: all triangles by Pluecker's coordinates at once, all ellipsoids in their spaces.

    Flat disks, which are lights' alone, are not met.
    """
    n = d.shape[1]
    size = max(float(np.abs(np.concatenate((o, g.a, g.b, g.c), axis=1)).max()), 1e-300)
    corners = (g.a, g.b, g.c)
    lines = np.concatenate((d, np.cross(o, d, axis=0)))
    inside_to, inside_from = np.ones((g.triangles, n), dtype=bool), np.ones((g.triangles, n), dtype=bool)
    for p, q in zip(corners, (g.b, g.c, g.a), strict=True):
        side = np.asarray(np.concatenate((np.cross(p, q, axis=0), q - p)), dtype=np.float64).T @ lines
        inside_to &= side >= 0
        inside_from &= side <= 0
    t = np.full((g.triangles + g.ellipsoids, n), np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        height = ((g.normal * g.a).sum(axis=0)[:, None] - g.normal.T @ o) / (g.normal.T @ d)
        t[: g.triangles] = np.where((inside_to | inside_from) & (height > NEAR * size), height, np.inf)
        for k in range(g.ellipsoids):
            t[g.triangles + k] = _ellipsoid(g, k, o, d, NEAR * size)
    first = t.argmin(axis=0)
    distance = t[first, np.arange(n)]
    surfaces = np.concatenate((g.triangle_surface, g.ellipsoid_surface))
    ball = np.where(first >= g.triangles, first - g.triangles, -1)
    hit = np.isfinite(distance)
    position = o + np.where(hit, distance, 0.0) * d
    return Hits(
        np.where(hit, surfaces[first], -1),
        position,
        _normals(g, position, first, ball),
        distance,
        np.where(hit, ball, -1),
        np.where(hit & (ball < 0), first, -1),
    )


def _ellipsoid(g: Geometry, k: int, o: Floats, d: Floats, near: float) -> Floats:
    a, b = g.inverse[k] @ (o - g.center[:, [k]]), g.inverse[k] @ d
    bb, ab, aa = dot(b, b), dot(a, b), dot(a, a) - 1
    root = np.sqrt(ab * ab - bb * aa)
    roots = np.stack(((-ab - root) / bb, (-ab + root) / bb))
    return np.where(roots > near, roots, np.inf).min(axis=0)


def _normals(g: Geometry, position: Floats, first: Ints, ball: Ints) -> Floats:
    """Unit normals (3, n) of what is met."""
    normal = np.zeros_like(position)
    flat = ball < 0
    normal[:, flat] = g.normal[:, first[flat]]
    for k in range(g.ellipsoids):
        on = ball == k
        normal[:, on] = g.inverse[k].T @ (g.inverse[k] @ (position[:, on] - g.center[:, [k]]))
    return np.asarray(normal / np.maximum(np.sqrt(dot(normal, normal)), 1e-300))


def _reflected(probe: Probe, met: Hits, outgoing: Floats) -> Floats:
    """Radiance (3, n) that what is met reflects of lights; lights themselves are none of it."""
    g, out = probe.geometry, np.zeros_like(outgoing)
    hit: Bools = met.surface >= 0
    hit[hit] = g.light[met.surface[hit]] < 0
    if not probe.scene.two_sided:
        hit &= dot(met.normal, outgoing) > 0
    lit = np.flatnonzero(hit)
    if lit.size:
        points = shading_points(g, met, outgoing, lit)
        none = np.zeros((3, lit.size))
        sight = Sight(points, np.arange(lit.size), none, none, np.full(lit.size, -1), met.surface[lit])
        out[:, lit] = probe.arriving_at(sight, SAMPLES)
    return out


def _between(points: ShadingPoints, surface: Ints, chosen: Ints, values: Floats) -> Floats:
    """Values (3, c) at the chosen of n points, at all of them: of their neighbours that are alike."""
    size = max(float(np.ptp(points.position, axis=1).max()), 1e-300)
    places = np.concatenate((points.position / size, points.normal, surface[None] * 10.0))
    squares = (places**2).sum(axis=0)
    far = squares[:, None] + squares[chosen] - 2 * places.T @ places[:, chosen]
    nearest = np.argpartition(far, NEIGHBOURS - 1, axis=1)[:, :NEIGHBOURS]
    weight = 1 / (np.maximum(np.take_along_axis(far, nearest, axis=1), 0.0) + 1e-4)
    return np.asarray((values[:, nearest] * weight).sum(axis=2) / weight.sum(axis=1))
