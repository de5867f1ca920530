"""The steps of the renderer, each of which a mistake may replace: what is right stands here."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .rays import Hits, dot, trace, visible
from .world import Bools, Floats, Light, World, read_world

Rng = np.random.Generator


@dataclass(frozen=True)
class Batch:
    """Pixels that are shaded together, before one light.

    Parameters
    ----------
    x, y : (n,) int
        Columns and rows.
    light : int
        Number of the light.
    seed : int
        Of the image.
    shape : (int, int)
        Height and width of the image.
    rng : Generator
        Of this batch and light alone.
    """

    x: NDArray[np.int64]
    y: NDArray[np.int64]
    light: int
    seed: int
    shape: tuple[int, int]
    rng: Rng


@dataclass(frozen=True)
class Surface:
    """Materials of n points: ``diffuse``, ``specular`` (3, n, 1), ``shininess`` (n, 1)."""

    diffuse: Floats
    specular: Floats
    shininess: Floats


def rays(world: World, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Origins and unit directions (3, n) through points of the image, in pixels from its upper left corner."""
    look = world.at - world.eye
    look = look / np.linalg.norm(look)
    right = np.cross(look, world.up)
    right = right / np.linalg.norm(right)
    up = np.cross(right, look)
    t = math.tan(math.radians(world.fov) / 2)
    across = t * world.width / world.height * (2 * x / world.width - 1)
    d = look[:, None] + right[:, None] * across + up[:, None] * (t * (1 - 2 * y / world.height))
    return np.repeat(world.eye[:, None], x.size, axis=1), d / np.sqrt(dot(d, d))


def places(batch: Batch, samples: int, strata: bool) -> tuple[Floats, Floats]:
    """Points (u, v) of the unit square, (n, samples) each: random, or one in each cell of a grid."""
    u, v = batch.rng.random((2, batch.x.size, samples))
    if strata:
        side = math.isqrt(samples)
        i, j = np.divmod(np.arange(samples), side)
        u, v = (i + u) / side, (j + v) / side
    return u, v


def on_quad(light: Light, u: Floats, v: Floats) -> Floats:
    """Points (3, n, s) of a quad."""
    return light.place[:, None, None] + light.u[:, None, None] * u + light.v[:, None, None] * v


def quad_term(light: Light, cosine: Floats, r: Floats) -> Floats:
    """Area times the light's cosine over r^2: solid angle of the whole light per point of it."""
    return np.asarray(light.area * np.maximum(cosine, 0) / r**2)


def point_term(r: Floats) -> Floats:
    """1/r^2."""
    return np.asarray(1 / r**2)


def on_sun(light: Light, u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Unit directions (3, n, s) into a sun, uniform over its projected disk, and what each is worth.

    Radiance is E / (pi sin^2 a) with a half the angle; a piece of the disk is pi sin^2 a / cos of solid angle.
    """
    r, phi = math.sin(light.angle / 2) * np.sqrt(u), 2 * math.pi * v
    axis = np.eye(3)[np.argmin(np.abs(light.place))]
    x = np.cross(light.place, axis)
    x = x / np.linalg.norm(x)
    y = np.cross(light.place, x)
    high = np.sqrt(1 - r * r)
    parts = (x, r * np.cos(phi)), (y, r * np.sin(phi)), (light.place, high)
    return np.sum([a[:, None, None] * b for a, b in parts], axis=0), 1 / high


def brdf(surface: Surface, normal: Floats, towards: Floats, w: Floats) -> Floats:
    """k_d / pi + k_s (s + 2) / (2 pi) max(r.w, 0)^s for unit w (3, n, k): (3, n, k)."""
    return np.asarray(surface.diffuse / math.pi + surface.specular * lobe(surface, normal, towards, w))


def lobe(surface: Surface, normal: Floats, towards: Floats, w: Floats) -> Floats:
    """Phong's, (n, k)."""
    mirror = 2 * dot(normal, towards) * normal - towards
    cosine = np.maximum(dot(mirror[:, :, None], w), 0)
    power = np.where(cosine > 0, cosine**surface.shininess, 0.0)  # 0^0 is 1 elsewhere
    return np.asarray((surface.shininess + 2) / (2 * math.pi) * power)


def cosine(c: Floats) -> Floats:
    """Of the surface, from n.w."""
    return np.maximum(c, 0)


def shown(world: World, hits: Hits) -> Floats:
    """What the camera sees without any light on it (3, n): lights from their front, and what glows."""
    radiance = world.table("emission").T[:, hits.material] * (hits.front & hits.shaded)
    for number, light in enumerate(world.lights):
        radiance = np.where(hits.front & (hits.light == number), light.colour[:, None], radiance)
    return np.asarray(radiance)


def gather(values: Floats, rng: Rng) -> Floats:
    """Radiance (3, n) from that of samples (3, n, s)."""
    return np.asarray(values.mean(axis=2))


def same(value: Any) -> Any:
    """What is right as it is."""
    return value


def indirect(world: World, hits: Hits, rng: Rng) -> Floats:
    """What points (3, n) reflect of other surfaces' light: nothing, images are of direct light."""
    return np.zeros((3, 1))


def finished(image: Floats, shaded: Bools, rng: Rng) -> Floats:
    """The image as it is."""
    return image


@dataclass(frozen=True)
class Steps:
    """All steps, in the order in which they are taken.

    Parameters
    ----------
    text, world : callable
        The scene's text, and the scene, before they are used.
    read : callable
    seed : callable
        Of an image, from the one asked for.
    pixel : callable
        Points (2, n) of the image from columns and rows and offsets (2, n) in the pixel.
    rays, trace, shown : callable
        Camera rays; what they hit; what is seen of it without light.
    places : callable
        Points of the unit square.
    on_quad, quad_term, point_term, on_sun : callable
        Points and directions of lights, and what each is worth.
    visible : callable
    cosine, brdf : callable
    arriving : callable
        Radiance of samples (3, n, s), from the light, before they are averaged.
    gather : callable
    indirect : callable
        What is added to that.
    finished : callable
        The image (3, h, w), its shaded pixels (h, w), and a generator of the image's own.
    """

    text: Callable[[str], str] = same
    read: Callable[[str], World] = read_world
    world: Callable[[World], World] = same
    seed: Callable[[int], int] = same
    pixel: Callable[[Floats, Floats], Floats] = lambda corner, offset: corner + offset
    rays: Callable[[World, Floats, Floats], tuple[Floats, Floats]] = rays
    trace: Callable[[World, Floats, Floats], Hits] = trace
    shown: Callable[[World, Hits], Floats] = shown
    places: Callable[[Batch, int, bool], tuple[Floats, Floats]] = places
    on_quad: Callable[[Light, Floats, Floats], Floats] = on_quad
    quad_term: Callable[[Light, Floats, Floats], Floats] = quad_term
    point_term: Callable[[Floats], Floats] = point_term
    on_sun: Callable[[Light, Floats, Floats], tuple[Floats, Floats]] = on_sun
    visible: Callable[[World, Hits, Floats, Light], Floats] = visible
    cosine: Callable[[Floats], Floats] = cosine
    brdf: Callable[[Surface, Floats, Floats, Floats], Floats] = brdf
    arriving: Callable[[Light, Floats], Floats] = lambda light, values: values
    gather: Callable[[Floats, Rng], Floats] = gather
    indirect: Callable[[World, Hits, Rng], Floats] = indirect
    finished: Callable[[Floats, Bools, Rng], Floats] = finished


RIGHT = Steps()
