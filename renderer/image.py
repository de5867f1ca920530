"""From a scene to an image: tiles, passes, and any executor.

A tile is a rectangle of pixels, small enough that its arrays fit the memory whatever the image's size. Each
tile and pass has its own random stream, spawned from the seed by their numbers, so that one worker or many
give the same bits. Passes repeat the whole estimate with fresh randomness: their spread is the noise.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .ambiguous_pixels import Tolerance, near_edges
from .camera.rays import pixel_centres
from .camera.sensors import sensor_view, to_irradiance
from .camera.view import View, look
from .chunks import each
from .errors import InputError
from .estimators.protocol import Bounded, Estimator
from .needs import LeftOut, Source
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

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Image:
    """A rendered image and its statistics over passes.

    Parameters
    ----------
    first, mean : (3, h, w) float64
        Radiance of the first pass, and the mean of all.
    variance : (3, h, w) float64
        Of one pass, unbiased; 0 for an estimator without noise.
    pixel_variance : (h, w) float64
        The same of the channels' average: a pixel's channels share their light samples.
    level_mean, level_variance : (3, h, w) float64
        Mean and variance of one pass in 8-bit levels, clamped to [0, 255], not rounded.
    emitter, background : (h, w) float64
        Share of camera rays that hit a light's front or back, or nothing.
    unjudged : (h, w) bool
        Within the tolerance of a geometric edge, or of a hard shadow's.
    pass_means : (passes,) float64
        Channel average over the shaded pixels, pass by pass.
    clumping : float
        Variance of the image's sum over what it were if pixels were independent; 1 where they are.
    back_faces : int
        Pixels that show the black back of a one-sided surface.
    left_out : tuple of LeftOut
    routes : dict of str to int
        For estimators that choose by the point: pixels times lights that took each route, in the first pass.
    bound : (h, w) float64, optional
        For estimators that know it: the largest bound of any value in each pixel, in units of what its light would
        give if nothing were in the way; inf where there is noise.
    light_means : (lights + 1, 3, h, w) float32, optional
        What the mean is the sum of: each light's share, seen or reflected, and what shines and is no light. None for
        one light, for very many, and where they were not asked for, or lights are not summed one by one.
    """

    first: Floats
    mean: Floats
    variance: Floats
    pixel_variance: Floats
    level_mean: Floats
    level_variance: Floats
    emitter: Floats
    background: Floats
    unjudged: NDArray[np.bool_]
    pass_means: Floats
    back_faces: int
    left_out: tuple[LeftOut, ...]
    clumping: float = 1.0
    routes: dict[str, int] = field(default_factory=dict)
    bound: Floats | None = None
    light_means: NDArray[np.float32] | None = None

    @classmethod
    def without_noise(
        cls, mean: Floats, emitter: Floats, background: Floats, back_faces: int = 0, left_out: tuple[LeftOut, ...] = ()
    ) -> Image:
        """An image in which nothing is random: radiance (3, h, w), shares of emitters and background (h, w)."""
        nothing = np.zeros(emitter.shape)
        shaded = (emitter == 0) & (background == 0)
        level = np.clip(mean, 0, 1)
        level *= 255
        return cls(
            first=mean,
            mean=mean,
            variance=np.zeros(mean.shape),
            pixel_variance=nothing,
            level_mean=level,
            level_variance=np.zeros(mean.shape),
            emitter=emitter,
            background=background,
            unjudged=np.zeros(emitter.shape, dtype=bool),
            pass_means=np.array([float(mean.mean(axis=0)[shaded].sum()) / max(int(shaded.sum()), 1)]),
            back_faces=back_faces,
            left_out=left_out,
        )

    @property
    def shaded(self) -> NDArray[np.bool_]:
        """Pixels all of whose rays hit a surface that is not a light, (h, w)."""
        return (self.emitter == 0) & (self.background == 0)


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


def _opened(job: Job) -> Prepared:
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
    job: Job, tile: Tile, number: int, view: View, opened: Prepared, routes: Counter[str]
) -> tuple[Floats, Floats, Floats]:
    """Radiance (3, n): what is seen directly, and every light's share, summed; bounds (n,); those shares."""
    radiance, bounds = view.emission.copy(), np.zeros(view.background.size)
    shares = np.zeros((_parts(job), *radiance.shape))
    if shares.size:
        shining = np.flatnonzero(view.emission.any(axis=0))
        owner = opened.geometry.light[view.hits.surface[shining]]  # -1, no light: the last
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
        radiance[:, view.lit] += reflected(view.points, opened.needs, kept if shares.size else share)
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
    """All passes of one tile: arrays over its pixels (row by row), and its share of each pass's sum."""
    scene, geometry, needs = opened = _opened(job)
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
        radiance, bounds, shares = _shade(job, tile, number, view, opened, routes if number == 0 else Counter())
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
    return {
        "first": colours.first,
        "mean": colours.mean,
        "variance": colours.variance,
        "pixel_variance": averages.variance,
        "level_mean": levels.mean,
        "level_variance": levels.variance,
        "emitter": emitter,
        "background": background,
        "unjudged": unjudged,
        "bound": bound,
        "back": back,
        "light_means": (lights / passes).astype(np.float32),
        "routes": routes,
        "pass_sums": np.array([image[shaded].sum() for image in pixels]),
    }


def render(
    scene: Scene,
    estimator: Estimator,
    *,
    seed: int = 0,
    passes: int = 1,
    executor: Executor | None = None,
    progress: Progress | None = None,
    everything: bool = False,
    tolerance: Tolerance | None = None,
    offset: RayOffset | None = None,
    by_light: bool = False,
) -> Image:
    """Render a scene.

    Parameters
    ----------
    scene : Scene
    estimator : Estimator
    seed : int
        Root of every random stream.
    passes : int
        Independent repetitions; one is made where nothing is random.
    executor : Executor, optional
        Where the tiles run; None runs them here, one after the other. The image does not depend on it.
    progress : callable, optional
        Called with (tiles done, tiles in all).
    everything : bool
        Leave nothing out (see `needs`).
    tolerance : Tolerance, optional
        Mark pixels this close to an edge.
    offset : RayOffset, optional
        Trace shadow rays by another renderer's rule, to be wrong as it is.
    by_light : bool
        Keep each light's share, `Image.light_means`; it takes some hundredths of the time.

    Returns
    -------
    Image
    """
    return _render(Job(scene, estimator, seed, passes, everything, tolerance, offset, by_light), executor, progress)


def read_sensors(
    scene: Scene,
    estimator: Estimator,
    *,
    seed: int = 0,
    passes: int = 1,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Image:
    """What a scene's sensors read: irradiance, W m^-2, as an image of one row, a pixel for each.

    Nothing is left out but what the estimator leaves out by the point: needs are found for surfaces.

    Parameters
    ----------
    scene : Scene
        With sensors.
    estimator, seed, passes, executor, progress
        As for `render`.

    Returns
    -------
    Image
        ``first``, ``mean`` (3, 1, n), their variances and ``pass_means`` in irradiance; levels mean nothing.

    Raises
    ------
    InputError
        If the scene has none.
    """
    if not scene.sensors:
        raise InputError("sensors", "none", "a scene with a sensor: sensor x y z nx ny nz")
    row = scene.with_(width=len(scene.sensors), height=1, spp=1)
    image = _render(Job(row, estimator, seed, passes, True, None, sensors=True), executor, progress)
    square = to_irradiance(to_irradiance(1.0))
    return replace(
        image,
        first=to_irradiance(image.first),
        mean=to_irradiance(image.mean),
        variance=square * image.variance,
        pixel_variance=square * image.pixel_variance,
        pass_means=to_irradiance(image.pass_means),
    )


def _render(job: Job, executor: Executor | None, progress: Progress | None) -> Image:
    """All tiles of a job, put together."""
    scene, estimator = job.scene, job.estimator
    shared = estimator.shares_points  # one light point at a time: a tile's memory does not grow with them
    parts = tiles(scene, 1 if shared else estimator.samples)
    needs = _opened(job).needs
    arrays: dict[str, Any] = {}
    pass_sums: dict[int, Floats] = {}
    routes: Counter[str] = Counter()
    for done, (tile, result) in enumerate(
        zip(parts, each(partial(render_tile, job), executor, parts), strict=True), start=1
    ):
        pass_sums[tile.number] = result.pop("pass_sums")
        routes += result.pop("routes")
        window = (..., slice(tile.rows.start, tile.rows.stop), slice(tile.columns.start, tile.columns.stop))
        for name, values in result.items():
            shape = values.shape[:-1]
            if name not in arrays:
                arrays[name] = np.empty((*shape, scene.height, scene.width), dtype=values.dtype)
            arrays[name][window] = values.reshape(*shape, len(tile.rows), len(tile.columns))
        if progress:
            progress(done, len(parts))
    shaded = (arrays["emitter"] == 0) & (arrays["background"] == 0)
    back = int(arrays.pop("back").sum())
    bound, light_means = arrays.pop("bound"), arrays.pop("light_means")
    # Summed in the tiles' order: the bits do not depend on who finished first.
    sums = np.array([pass_sums[number] for number in sorted(pass_sums)])
    return Image(
        **arrays,
        pass_means=sums.sum(axis=0) / max(shaded.sum(), 1),
        back_faces=back,
        left_out=needs.left_out,
        clumping=_clumping(sums, arrays["pixel_variance"][shaded]) if shared else 1.0,
        routes=dict(sorted(routes.items())),
        bound=bound if isinstance(estimator, Bounded) else None,
        light_means=light_means if light_means.size else None,
    )


def _clumping(sums: Floats, pixel_variance: Floats) -> float:
    """From each tile's sum of each pass (tiles, passes); below 1 it is taken for chance."""
    alone = float(pixel_variance.sum())
    if sums.shape[1] < 2 or alone == 0:
        return 1.0
    return max(1.0, float(sums.var(axis=1, ddof=1).sum()) / alone)
