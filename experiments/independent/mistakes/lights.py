"""Mistakes of where light points lie: corners, halves, diagonals, shear; and of suns."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from nusselt.experiments.independent.steps import Batch, on_quad, on_sun, places
from nusselt.experiments.independent.world import Floats, Light, World

from .mistake import Mistake, Step


def _cells(samples: int) -> tuple[Floats, Floats, int]:
    side = math.isqrt(samples)
    i, j = np.divmod(np.arange(samples), side)
    return i.astype(float), j.astype(float), side


def _in_cells(offset: float, size: float) -> Step:
    """The step `places` that takes (offset + size random) of each cell."""

    def step(batch: Batch, samples: int, strata: bool) -> tuple[Floats, Floats]:
        i, j, side = _cells(samples)
        x, y = offset + size * batch.rng.random((2, batch.x.size, samples))
        return (i + x) / side, (j + y) / side

    return step


def _diagonal(batch: Batch, samples: int, strata: bool) -> tuple[Floats, Floats]:
    i, _, side = _cells(samples)
    x, y = batch.rng.random((2, batch.x.size, samples))
    return (i + x) / side, (i + y) / side


def _then(change: Step) -> Step:
    """The step `places` that changes right ones."""
    return lambda batch, samples, strata: change(*places(batch, samples, strata))


def _folded(u: Floats, v: Floats) -> tuple[Floats, Floats]:
    over = u + v > 1
    return np.where(over, 1 - u, u), np.where(over, 1 - v, v)


def _disk(u: Floats, v: Floats) -> tuple[Floats, Floats]:
    r, phi = 0.5 * np.sqrt(u), 2 * math.pi * v
    return 0.5 + r * np.cos(phi), 0.5 + r * np.sin(phi)


def _as_rectangle(light: Light, u: Floats, v: Floats) -> Floats:
    across = light.v - light.u * (light.u @ light.v) / (light.u @ light.u)
    return on_quad(replace(light, v=across), u, v)


def _lights(change: Step) -> Step:
    return lambda world: replace(world, lights=tuple(change(light) for light in world.lights))


def _stratum(taken: int, sampled: int) -> Step:
    """The step `places` with one cell sampled in place of another."""

    def step(batch: Batch, samples: int, strata: bool) -> tuple[Floats, Floats]:
        u, v = places(batch, samples, strata)
        if samples > sampled:
            u[:, taken], v[:, taken] = u[:, sampled], v[:, sampled]
        return u, v

    return step


LIGHTS = (
    Mistake("strata at their corners", "each cell's corner is sampled", "ball", "places", _in_cells(0, 0)),
    Mistake("strata at their centres", "each cell's centre is sampled", "ball", "places", _in_cells(0.5, 0)),
    Mistake("half a cell off", "points lie half a cell too far", "ball", "places", _in_cells(0.5, 1)),
    Mistake("half of each cell", "jitter fills half of each cell", "ball", "places", _in_cells(0, 0.5)),
    Mistake("cells of the diagonal", "one index for both axes", "ball", "places", _diagonal),
    Mistake("u = v", "one random number for both axes", "ball", "places", _then(lambda u, v: (u, u))),
    Mistake(
        "u = v, random",
        "one random number for both axes, no strata",
        "ball",
        "places",
        _then(lambda u, v: (u, u)),
        False,
    ),
    Mistake("v is 1/2", "points lie on a line", "ball", "places", _then(lambda u, v: (u, np.full_like(v, 0.5)))),
    Mistake(
        "centre of the light",
        "every sample at its centre",
        "ball",
        "places",
        _then(lambda u, v: (0 * u + 0.5, 0 * v + 0.5)),
    ),
    Mistake("corner of the light", "every sample at its corner", "ball", "places", _then(lambda u, v: (0 * u, 0 * v))),
    Mistake("one triangle of the light", "half of the square is left out", "ball", "places", _then(_folded)),
    Mistake("a disk in the light", "points fill the inscribed disk", "ball", "places", _then(_disk)),
    Mistake("first half of the light", "u from 0 to 1/2", "ball", "places", _then(lambda u, v: (u / 2, v))),
    Mistake("u squared", "points crowd at one edge", "ball", "places", _then(lambda u, v: (u * u, v))),
    Mistake("u to the 1.1", "points crowd a little at one edge", "ball", "places", _then(lambda u, v: (u**1.1, v))),
    Mistake(
        "5 % over the edge", "points lie on a light 5 % longer", "ball", "places", _then(lambda u, v: (1.05 * u, v))
    ),
    Mistake("a cell sampled twice", "one cell stands for its neighbour", "ball", "places", _stratum(0, 1)),
    Mistake("a far cell sampled twice", "one cell stands for the opposite one", "ball", "places", _stratum(0, 15)),
    Mistake(
        "corner taken for centre",
        "the light is moved by half its edges",
        "ball",
        "on_quad",
        lambda light, u, v: on_quad(light, u - 0.5, v - 0.5),
    ),
    Mistake(
        "rectangle for a parallelogram",
        "the second edge is made square to the first",
        "sheared lamp",
        "on_quad",
        _as_rectangle,
    ),
    Mistake(
        "opposite corner forgotten",
        "the second edge is taken for a corner",
        "sheared lamp",
        "on_quad",
        lambda light, u, v: on_quad(replace(light, v=light.v - light.place), u, v),
    ),
    Mistake(
        "light 1 % lower",
        "its height is rounded",
        "low lamp",
        "on_quad",
        lambda light, u, v: on_quad(replace(light, place=light.place * np.array([1, 0.99, 1])), u, v),
    ),
    Mistake(
        "light seen and sampled elsewhere",
        "it is moved by 0.1",
        "low lamp",
        "world",
        _lights(lambda light: replace(light, place=light.place + np.array([0.1, 0, 0]))),
    ),
)


def _angle(factor: float) -> Step:
    return lambda light, u, v: on_sun(replace(light, angle=factor * light.angle), u, v)


def _directional(world: World) -> World:
    return replace(world, lights=tuple(replace(light, kind="directional") for light in world.lights))


def _leaned(light: Light) -> Light:
    place = light.place + np.array([math.radians(2), 0, 0])
    return replace(light, place=place / np.linalg.norm(place))


def _weighed(light: Light, u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """By solid angle, with the weight of the projected one."""
    d, _ = on_sun(light, u, v)
    return d, np.ones_like(u)


SUNS = (
    Mistake("half the angle", "radius taken for diameter, the other way", "wide sun", "on_sun", _angle(0.5)),
    Mistake("twice the angle", "diameter taken for radius", "wide sun", "on_sun", _angle(2)),
    Mistake("twice a small angle", "diameter taken for radius", "sun", "on_sun", _angle(2)),
    Mistake("angle 10 % too wide", "of the sun's disk", "wide sun", "on_sun", _angle(1.1)),
    Mistake(
        "twice the angle at the same radiance",
        "irradiance times four",
        "sun",
        "world",
        _lights(lambda light: replace(light, angle=2 * light.angle, colour=4 * light.colour)),
    ),
    Mistake("a direction for a small sun", "hard shadows", "sun", "world", _directional),
    Mistake("a direction for a wide sun", "hard shadows", "wide sun", "world", _directional),
    Mistake(
        "sun's points crowd in the middle",
        "radius by u, not by its root",
        "wide sun",
        "on_sun",
        lambda light, u, v: on_sun(light, u * u, v),
    ),
    Mistake(
        "sun's rim",
        "every sample at the edge of its disk",
        "wide sun",
        "on_sun",
        lambda light, u, v: on_sun(light, 0 * u + 1, v),
    ),
    Mistake(
        "half a sun",
        "angles about its axis from 0 to pi",
        "wide sun",
        "on_sun",
        lambda light, u, v: on_sun(light, u, v / 2),
    ),
    Mistake("sun's cosine forgotten", "1 / cos of its disk is left out", "wide sun", "on_sun", _weighed),
    Mistake("sun two degrees off", "its direction", "sun", "world", _lights(_leaned)),
)
