"""Points of the unit square that lights are sampled at, and the random beams of any light.

Every kind maps the unit square onto itself with a constant Jacobian in the measure it states, so that the density is
one over the light's size in that measure.
"""

from __future__ import annotations

import math

import numpy as np

from nusselt.renderer.vectors import Floats

from .protocol import Light


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


def stratum_centres(samples: int) -> tuple[Floats, Floats]:
    """(u, v) of the centres of the sqrt(N) x sqrt(N) strata, each (1, N), in the order of `unit_square`."""
    side = math.isqrt(samples)
    i, j = np.divmod(np.arange(samples), side)
    return (i[None] + 0.5) / side, (j[None] + 0.5) / side


def random_beams(
    light: Light, points: Floats, rng: np.random.Generator, samples: int, stratified: bool
) -> tuple[Floats, Floats]:
    """Random beams (see `Light.beams`) from points (3, n) to a light: ``samples`` each, or one if it has no extent."""
    if not light.has_extent:
        return light.beams(points, *one_place())
    return light.beams(points, *unit_square(rng, points.shape[1], samples, stratified))


def one_place() -> tuple[Floats, Floats]:
    """(u, v), each (1, 1), for a light without extent: all of it is there."""
    return np.zeros((1, 1)), np.zeros((1, 1))
