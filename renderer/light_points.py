"""Points on lights: where the shadow rays go, and what each is worth.

Every rule maps the unit square onto a light with a constant Jacobian in the measure it states, so that the
density is one over the light's size in that measure.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from .geometry.watertight import largest, one_norm
from .lights import DirectionalLight, Light, PointLight, QuadLight, SunLight
from .vectors import Floats, column, cross, dot, frame
from .visibility.segments import PLANE_ULPS


def unit_square(rng: np.random.Generator, n: int, samples: int, stratified: bool) -> tuple[Floats, Floats]:
    """(u, v) in [0, 1)^2 for n points, each (n, samples): independent, or one in each cell of a square grid.

    Cell k = i sqrt(N) + j is the stratum [i, i+1) x [j, j+1) over sqrt(N), i along u.
    """
    u, v = rng.random((2, n, samples))
    if stratified:
        side = math.isqrt(samples)
        i, j = np.divmod(np.arange(samples), side)
        u, v = (i + u) / side, (j + v) / side
    return u, v


def lattice(rng: np.random.Generator, n: int, samples: int) -> tuple[Floats, Floats]:
    """(u, v) in [0, 1)^2 for n points, each (n, samples): a rank-1 lattice, shifted at random for every point.

    Korobov's lattice k (1, a) / N, with a the whole number nearest N over the golden ratio that shares no factor
    with N: Fibonacci's lattice where N is a Fibonacci number, and as even in between. The shift modulo one
    (Cranley & Patterson 1976) makes each point uniform.
    """
    a = min((a for a in range(1, samples + 1) if math.gcd(a, samples) == 1), key=lambda a: abs(a - samples / GOLDEN))
    k = np.arange(samples)
    first, second = rng.random((2, n, 1))
    return (k / samples + first) % 1.0, (k * a % samples / samples + second) % 1.0


GOLDEN = (1 + math.sqrt(5)) / 2


def faced_by(corner: Floats, ab: Floats, ac: Floats, points: Floats) -> NDArray[np.bool_]:
    """Which points (3, n) the parallelogram corner + u ab + v ac shines on: before it by more than rounding.

    A surface in the light's own plane sees it edge-on, and gets nothing. By how little rounding lifts a point of it off
    that plane does not matter to the light: to a point right before it, it fills half the sky. So points within the
    rounding of the plane's equation count as on it, as for shadow rays (see `shadows`); the edges' product is known to
    rounding of its own, which tells where they are nearly parallel.

    Parameters
    ----------
    corner, ab, ac : (3, 1) or (3, n) float64
        Emits on the side of -(ab x ac).
    """
    normal, way = cross(ab, ac), corner - points
    bound = one_norm(normal) * (largest(corner) + largest(points)) + largest(ab) * largest(ac) * largest(way)
    return np.asarray(dot(normal, way) > PLANE_ULPS * bound)


def quad_beams(light: QuadLight, points: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Directions to corner + u ab + v ac and the solid angle each stands for.

    Area measure: density 1/A, so a sample stands for A cos(theta_l) / R^2 of solid angle, over N.
    A cos(theta_l) R = (ab x ac) . d: positive on the emitting side, no unit normal needed.

    Parameters
    ----------
    points : (3, n) float64
    u, v : (n, k) float64

    Returns
    -------
    d : (3, n, k) float64
        From point to light point.
    solid_angle : (n, k) float64
        sr, divided by k already; 0 behind the light and in its plane.
    """
    corner, ab, ac = column(light.corner), column(light.ab), column(light.ac)
    d = (corner - points)[:, :, None] + ab[:, :, None] * u + ac[:, :, None] * v
    faced = faced_by(corner, ab, ac, points)[:, None]
    return d, _solid_angle(cross(ab, ac), d) * (faced / u.shape[1])


def _solid_angle(doubled: Floats, d: Floats) -> Floats:
    length2 = dot(d, d)
    facing = np.maximum(dot(doubled[:, :, None], d), 0)
    # A point that lies on the light itself sees it edge-on: nothing, not 0/0.
    return np.divide(facing, length2 * np.sqrt(length2), out=np.zeros_like(facing), where=length2 > 0)


def sun_directions(light: SunLight, u: Floats, v: Floats) -> Floats:
    """Unit directions over the sun's disk, (3, n, k), uniform in projected solid angle about its centre.

    Density 1/(pi sin^2 alpha): with the radiance E/(pi sin^2 alpha) a direction stands for E/N on a plane
    that faces the centre, and for E/N / cos(theta_centre) of radiance times solid angle on any plane.
    """
    axis = column(light.direction)
    x, y = frame(axis)
    sine = math.sin(light.half_angle) * np.sqrt(u)
    angle = 2 * math.pi * v
    cosine = np.sqrt(1 - sine * sine)
    return x[:, :, None] * (sine * np.cos(angle)) + y[:, :, None] * (sine * np.sin(angle)) + axis[:, :, None] * cosine


Extended: TypeAlias = QuadLight | SunLight
"""Lights with an extent to be sampled."""


def extended_beams(light: Extended, points: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats, bool]:
    """Beams through points (u, v) of the unit square, each (n, k) or (1, k), of a light with an extent.

    Returns
    -------
    d : (3, n, k) float64
    weight : (n, k) float64
        What multiplies the light's colour (radiance or irradiance), divided by k already.
    at_infinity : bool
        Whether shadow rays have no far end.
    """
    if isinstance(light, QuadLight):
        return *quad_beams(light, points, u, v), False
    d = sun_directions(light, u, v)
    weight = 1 / (u.shape[1] * dot(column(light.direction)[:, :, None], d))
    n, k = points.shape[1], u.shape[1]
    return np.broadcast_to(d, (3, n, k)), np.array(np.broadcast_to(weight, (n, k))), True


def beams(
    light: Light, points: Floats, rng: np.random.Generator, samples: int, stratified: bool
) -> tuple[Floats, Floats, bool]:
    """Random beams of any kind of light; see `extended_beams`. One beam if it has no extent."""
    n = points.shape[1]
    d: Floats
    if isinstance(light, PointLight):
        d = (column(light.position) - points)[:, :, None]
        length2 = dot(d, d)
        return d, np.divide(1.0, length2, out=np.zeros_like(length2), where=length2 > 0), False
    if isinstance(light, DirectionalLight):
        return np.broadcast_to(column(light.direction)[:, :, None], (3, n, 1)), np.ones((n, 1)), True
    return extended_beams(light, points, *unit_square(rng, n, samples, stratified))


def stratum_centres(samples: int) -> tuple[Floats, Floats]:
    """(u, v) of the centres of the sqrt(N) x sqrt(N) strata, each (1, N), in the order of `unit_square`."""
    side = math.isqrt(samples)
    i, j = np.divmod(np.arange(samples), side)
    return (i[None] + 0.5) / side, (j[None] + 0.5) / side


def colour(light: Light) -> Floats:
    """What the weights of `beams` multiply, (3, 1)."""
    if isinstance(light, QuadLight):
        return column(light.radiance)
    return column(light.intensity if isinstance(light, PointLight) else light.irradiance)


def hull(light: Light) -> tuple[Floats, bool]:
    """Points (3, m) whose convex hull holds the light, or directions to it; and whether it is at infinity."""
    if isinstance(light, QuadLight):
        p, ab, ac = (column(v) for v in (light.corner, light.ab, light.ac))
        return np.hstack((p, p + ab, p + ac, p + ab + ac)), False
    if isinstance(light, PointLight):
        return column(light.position), False
    axis = column(light.direction)
    if isinstance(light, DirectionalLight):
        return axis, True
    x, y = frame(axis)
    reach = math.tan(light.half_angle)  # a square around the disk's cone
    return np.hstack([axis + reach * (sx * x + sy * y) for sx in (-1, 1) for sy in (-1, 1)]), True
