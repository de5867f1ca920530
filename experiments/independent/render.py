"""Images: camera rays, then for every light its samples, by one of several ways of sampling."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .rays import Hits, dot, quad_crossing
from .steps import RIGHT, Batch, Rng, Steps, Surface
from .world import Bools, Floats, Light, World

RAYS = 1 << 15
"""Shadow rays traced at once."""
GOLDEN = (0.7548776662466927, 0.5698402909980532)
"""Steps of a lattice that fills the square evenly (Roberts 2018)."""
WAYS = ("area", "mis", "one-light", "roulette", "lattice")
"""Of sampling: points of each light; those and directions by their cosine, by multiple importance (Veach 1997); one
light a sample, by chance; half of the samples left out, by chance; one lattice, shifted at random in each pixel."""


@dataclass(frozen=True)
class Options:
    """How an image is made.

    Parameters
    ----------
    samples : int
        Per light and pixel.
    strata : bool
        One sample in each cell of a grid over the light; ``samples`` is a square then.
    jittered : bool
        Every sample has a camera ray of its own, anywhere in the pixel, instead of one through the centre for all.
    way : str
        One of `WAYS`.
    seed : int
    """

    samples: int = 16
    strata: bool = True
    jittered: bool = False
    way: str = "area"
    seed: int = 0

    @property
    def rays(self) -> int:
        """Camera rays of a pixel."""
        return self.samples if self.jittered else 1


def render(text: str, width: int, options: Options, steps: Steps = RIGHT) -> Floats:
    """An image (h, w, 3) of a scene's text, at most so many pixels wide."""
    world = steps.world(steps.read(steps.text(text)).sized(width))
    options = replace(options, seed=steps.seed(options.seed))
    size = world.height * world.width
    image, shaded = np.zeros((3, size)), np.zeros(size, dtype=bool)
    step = max(1, RAYS // options.samples)
    for number, start in enumerate(range(0, size, step)):
        pixels = np.arange(start, min(start + step, size))
        image[:, pixels], shaded[pixels] = _pixels(world, pixels, options, steps, number)
    plane = (world.height, world.width)
    final = np.random.default_rng([options.seed, 1])
    return np.asarray(steps.finished(image.reshape(3, *plane), shaded.reshape(plane), final).transpose(1, 2, 0))


def _pixels(
    world: World, pixels: NDArray[np.int64], options: Options, steps: Steps, number: int
) -> tuple[Floats, Bools]:
    """Radiance (3, n) of pixels, and whether a surface shows in them."""
    rng = np.random.default_rng([options.seed, 0, number])
    rays, each = options.rays, options.samples // options.rays
    y, x = np.divmod(pixels, world.width)
    corner = np.repeat(np.array([x, y], dtype=float), rays, axis=1)
    offset = rng.random(corner.shape) if options.jittered else np.full(corner.shape, 0.5)
    hits = steps.trace(world, *steps.rays(world, *steps.pixel(corner, offset)))
    radiance, on = steps.shown(world, hits), hits.shaded & hits.front
    values = np.zeros((3, int(on.sum()), each))
    share = _shares(options, len(world.lights), values.shape[1:], rng)
    for index, light in enumerate(world.lights if on.any() else ()):
        stream = np.random.default_rng([options.seed, 2, number, index])
        batch = Batch(x, y, index, options.seed, (world.height, world.width), stream)
        u, v = lattice(batch, options.samples) if options.way == "lattice" else _places(batch, options, steps)
        u, v = (np.broadcast_to(a, (x.size, options.samples)).reshape(-1, each)[on] for a in (u, v))
        found = from_light(world, hits.take(on), light, u, v, steps, options.way == "mis", stream)
        values += share[index] * steps.arriving(light, found)
    radiance[:, on] += steps.gather(values, rng) + steps.indirect(world, hits.take(on), rng)
    shaded = np.asarray(hits.shaded.reshape(-1, rays).any(axis=1))
    return radiance.reshape(3, -1, rays).mean(axis=2), shaded


def _places(batch: Batch, options: Options, steps: Steps) -> tuple[Floats, Floats]:
    return steps.places(batch, options.samples, options.strata)


def lattice(batch: Batch, samples: int) -> tuple[Floats, Floats]:
    """Points of one lattice, shifted at random in each pixel."""
    shift, k = batch.rng.random((2, batch.x.size, 1)), np.arange(samples)
    u, v = ((shift[axis] + GOLDEN[axis] * k) % 1 for axis in range(2))
    return u, v


def _shares(options: Options, lights: int, shape: tuple[int, ...], rng: Rng) -> Floats:
    """What a sample of each light counts, (lights, n, s): 1 on average."""
    if options.way == "one-light" and lights:
        return lights * (rng.integers(0, lights, shape) == np.arange(lights)[:, None, None]).astype(float)
    if options.way == "roulette":
        return np.where(rng.random((lights, *shape)) < 0.5, 2.0, 0.0)
    return np.ones((lights, 1, 1))


def _surface(world: World, hits: Hits) -> Surface:
    diffuse, specular = (world.table(name).T[:, hits.material, None] for name in ("diffuse", "specular"))
    return Surface(diffuse, specular, world.table("shininess")[hits.material, None])


def from_light(
    world: World, hits: Hits, light: Light, u: Floats, v: Floats, steps: Steps, mis: bool, rng: Rng
) -> Floats:
    """What each sample (n, s) of a light sends towards the eye, (3, n, s) or (3, n, 1)."""
    x, normal = hits.position[:, :, None], hits.normal
    r = np.ones(1)
    if light.kind == "quad":
        d = steps.on_quad(light, u, v) - x
        r = np.sqrt(dot(d, d))
        term = steps.quad_term(light, -dot(light.normal[:, None, None], d) / r, r)
    elif light.kind == "sun":
        d, term = steps.on_sun(light, u, v)
    elif light.kind == "point":
        d = light.place[:, None, None] - x
        r = np.sqrt(dot(d, d))
        term = steps.point_term(r)
    else:
        d, term = np.broadcast_to(light.place[:, None, None], (*x.shape[:2], 1)), np.ones(1)
    w = d / r
    cosine = steps.cosine(dot(normal[:, :, None], w))
    seen = steps.visible(world, hits, d, light)
    surface, colour = _surface(world, hits), light.colour[:, None, None]
    value = colour * term * cosine * seen * steps.brdf(surface, normal, hits.towards, w)
    if not mis or light.kind != "quad":
        return np.asarray(value)
    chance = np.maximum(cosine / math.pi, 0) * term  # of a direction over that of a point, both by solid angle
    return np.asarray(value / (1 + chance)) + _by_direction(world, hits, light, surface, u.shape[1], steps, rng)


def _by_direction(
    world: World, hits: Hits, light: Light, surface: Surface, samples: int, steps: Steps, rng: Rng
) -> Floats:
    """The other half of multiple importance: directions by their cosine, that may meet the light."""
    n, count = hits.normal, hits.normal.shape[1]
    w, cosine = by_cosine(n, samples, rng)
    t, inside = quad_crossing(light, np.repeat(hits.position, samples, axis=1), w.reshape(3, -1))
    t, inside = t.reshape(count, samples), inside.reshape(count, samples)
    facing = -dot(light.normal[:, None, None], w)
    met = inside & (t > 0) & (facing > 0)
    density = np.where(met, t * t / np.where(met, light.area * facing, 1), 1.0)
    seen = np.where(met, steps.visible(world, hits, w * np.where(met, t, 1.0), light), 0.0)
    value = light.colour[:, None, None] * cosine * seen * steps.brdf(surface, n, hits.towards, w)
    return np.asarray(value / (density + cosine / math.pi))


def by_cosine(n: Floats, samples: int, rng: Rng) -> tuple[Floats, Floats]:
    """Unit directions (3, n, s) about normals, by their cosines (n, s), and those."""
    radius, phi = np.sqrt(rng.random((n.shape[1], samples))), 2 * math.pi * rng.random((n.shape[1], samples))
    axis = np.where(np.abs(n[:1]) < 0.7, np.array([[1.0], [0], [0]]), np.array([[0], [1.0], [0]]))
    a = np.cross(n, axis, axis=0)
    a = a / np.sqrt(dot(a, a))
    b, cosine = np.cross(n, a, axis=0), np.sqrt(1 - radius**2)
    w = a[:, :, None] * (radius * np.cos(phi)) + b[:, :, None] * (radius * np.sin(phi)) + n[:, :, None] * cosine
    return w, cosine
