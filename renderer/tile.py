"""An image in tiles: what one of them is worth, in passes with random streams of their own.

A tile is a rectangle of pixels, small enough that its arrays fit the memory whatever the image's size. Each
tile and pass has its own random stream, spawned from the seed by their numbers, so that one worker or many
give the same bits. Passes repeat the whole estimate with fresh randomness: their spread is the noise.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np

from .ambiguous_pixels import Tolerance, near_edges
from .camera.rays import pixel_centres
from .camera.sensors import sensor_view
from .camera.view import View, look
from .estimators.protocol import Bounded, Estimator
from .needs import Source
from .prepared import Prepared, prepare
from .radiance import reflected
from .scene import Scene
from .shading import ShadingPoints
from .vectors import Floats
from .visibility.ray_offset import RayOffset

PAIRS = 1 << 17
"""Pixels x camera rays x light samples handled at once in a tile."""

LIGHTS, SHARES = 24, 1 << 23
"""Lights, and lights times pixels, of which each one's share of the image is kept, at most."""


@dataclass(frozen=True)
class Job:
    """What a worker needs to know, the same for every tile."""

    scene: Scene
    estimator: Estimator
    seed: int
    passes: int
    everything: bool
    tolerance: Tolerance | None
    offset: RayOffset | None = None
    by_light: bool = False
    sensors: bool = False


@dataclass(frozen=True)
class Tile:
    """A block of pixels; ``number`` names its random stream."""

    number: int
    rows: range
    columns: range


def tiles(scene: Scene, samples: int) -> list[Tile]:
    """Square tiles, row by row, of 16 to 128 pixels a side: about PAIRS samples each."""
    side = 1 << int(math.log2(max(1.0, math.sqrt(PAIRS / (samples * scene.spp)))))
    side = min(max(side, 16), 128)
    starts = [(y, x) for y in range(0, scene.height, side) for x in range(0, scene.width, side)]
    return [
        Tile(number, range(y, min(y + side, scene.height)), range(x, min(x + side, scene.width)))
        for number, (y, x) in enumerate(starts)
    ]


def opened(job: Job) -> Prepared:
    """A job's scene: where it is, with all that is in it and its rays' own rule, if another renderer's is followed."""
    if job.offset is None:
        return prepare(job.scene, job.everything)
    scene, geometry, needs = prepare(job.scene, everything=True, moved=False)
    return Prepared(scene, geometry, needs.by_rule(job.offset))


def _stream(job: Job, tile: Tile, number: int, light: int) -> np.random.Generator:
    """The random stream of one pass and light in one tile; light -1 is the camera.

    A stream of its own for each light: leaving one out leaves the others' numbers as they were.
    """
    return np.random.default_rng(np.random.SeedSequence(job.seed, spawn_key=(tile.number, number, light + 1)))


def _parts(job: Job) -> int:
    """How many parts of the image are kept: a share for each light, and one for what is no light."""
    scene, lights = job.scene, len(job.scene.lights)
    is_kept = job.by_light and 1 < lights <= LIGHTS and lights * scene.width * scene.height <= SHARES
    return lights + 1 if is_kept else 0


def _shade(
    job: Job, tile: Tile, number: int, view: View, prepared: Prepared, routes: Counter[str]
) -> tuple[Floats, Floats, Floats]:
    """Radiance (3, n): what is seen directly, and every light's share, summed; bounds (n,); those shares."""
    radiance, bounds = view.emission.copy(), np.zeros(view.background.size)
    shares = np.zeros((_parts(job), *radiance.shape))
    if shares.size:
        shining = np.flatnonzero(view.emission.any(axis=0))
        owner = prepared.geometry.light[view.hits.surface[shining]]  # -1, no light: the last
        shares[owner, :, shining] = view.emission[:, shining].T

    def share(points: ShadingPoints, source: Source) -> Floats:
        rng = _stream(job, tile, number, source.index)
        if not isinstance(job.estimator, Bounded):
            return job.estimator(points, source, rng)
        values, bound, taken = job.estimator.with_bounds(points, source, rng)
        bounds[view.lit] = np.maximum(bounds[view.lit], bound)
        routes.update(taken)
        return values

    def kept(points: ShadingPoints, source: Source) -> Floats:
        values = share(points, source)
        shares[source.index][:, view.lit] = values
        return values

    if view.lit.size:
        radiance[:, view.lit] += reflected(view.points, prepared.needs, kept if shares.size else share)
    return radiance, bounds, shares


class _Moments:
    """Mean and unbiased variance over passes of arrays (..., n).

    Sums of differences from the first pass: no cancellation between large squares that share their mean.
    """

    def __init__(self, first: Floats) -> None:
        self.first, self.count = first, 1
        self.total, self.square = np.zeros_like(first), np.zeros_like(first)

    def add(self, value: Floats) -> None:
        step = value - self.first
        self.total += step
        self.square += step * step
        self.count += 1

    @property
    def mean(self) -> Floats:
        return self.first + self.total / self.count

    @property
    def variance(self) -> Floats:
        centred = self.square - self.total * self.total / self.count
        return np.maximum(centred, 0) / max(self.count - 1, 1)


def render_tile(job: Job, tile: Tile) -> dict[str, Any]:
    """All passes of one tile: arrays over its pixels (row by row), and its share of each pass's sum.

    One pass has no spread, and none is given.
    """
    scene, geometry, needs = prepared = opened(job)
    x, y = pixel_centres(tile.columns, tile.rows)
    n, boxed = x.size, scene.spp > 1
    passes = job.passes if boxed or job.estimator.is_random(needs) else 1
    unjudged, back = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
    emitter, background, bound = np.zeros(n), np.zeros(n), np.zeros(n)
    lights = np.zeros((_parts(job), 3, n))
    moments: tuple[_Moments, ...] = ()
    pixels = []
    routes: Counter[str] = Counter()
    view = sensor_view(scene, geometry, np.array(tile.columns)) if job.sensors else look(scene, geometry, x, y)
    if job.tolerance and not boxed:
        unjudged = near_edges(scene, geometry, needs, view, x, y, job.tolerance)
    for number in range(passes):
        if boxed:
            u, v = _stream(job, tile, number, -1).random((2, n, scene.spp)) - 0.5
            view = look(scene, geometry, (x[:, None] + u).ravel(), (y[:, None] + v).ravel())
        radiance, bounds, shares = _shade(job, tile, number, view, prepared, routes if number == 0 else Counter())
        radiance = radiance.reshape(3, n, -1).mean(axis=2)
        bound = np.maximum(bound, bounds.reshape(n, -1).max(axis=1))
        emitter += view.emitter.reshape(n, -1).mean(axis=1)
        background += view.background.reshape(n, -1).mean(axis=1)
        if shares.size:
            lights += shares.reshape(*lights.shape, -1).mean(axis=3) if boxed else shares
        back |= view.back.reshape(n, -1).any(axis=1)
        values = radiance, radiance.mean(axis=0), 255 * np.clip(radiance, 0, 1)
        pixels.append(values[1])
        if not moments:
            moments = tuple(_Moments(value) for value in values)
        else:
            for moment, value in zip(moments, values, strict=True):
                moment.add(value)
    emitter, background = emitter / passes, background / passes  # at the end: whole shares stay 0 or 1
    colours, averages, levels = moments
    shaded = (emitter == 0) & (background == 0)
    spread = {
        "first": colours.first,
        "variance": colours.variance,
        "pixel_variance": averages.variance,
        "level_mean": levels.mean,
        "level_variance": levels.variance,
    }
    return (spread if passes > 1 else {}) | {
        "mean": colours.mean,
        "emitter": emitter,
        "background": background,
        "unjudged": unjudged,
        "bound": bound,
        "back": back,
        "light_means": (lights / passes).astype(np.float32),
        "routes": routes,
        "pass_sums": np.array([image[shaded].sum() for image in pixels]),
    }
