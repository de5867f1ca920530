"""From a scene to an image: tiles, passes, and any executor.

The same bits, whoever works on which tile (see `tile`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .ambiguous_pixels import Tolerance
from .camera.sensors import to_irradiance
from .chunks import each
from .errors import InputError
from .estimators.protocol import Bounded, Estimator
from .needs import LeftOut
from .scene import Scene
from .tile import Job, opened, render_tile, tiles
from .vectors import Floats
from .visibility.ray_offset import RayOffset

Progress = Callable[[int, int], None]
ROWS = 128
"""Rows of an image that are copied at once where one pass over all of it would do."""


@dataclass(frozen=True, eq=False)
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
        Mean and variance of one pass in 8-bit levels, clamped to [0, 255], not rounded; no mean is kept of one pass.
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
    level_mean: Floats | None
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
        shaded = (emitter == 0) & (background == 0)
        total = _sum_over(mean, shaded)
        return cls(
            **_one_pass(mean),
            emitter=emitter,
            background=background,
            unjudged=np.zeros(emitter.shape, dtype=bool),
            pass_means=np.array([total / 3 / max(int(np.count_nonzero(shaded)), 1)]),
            back_faces=back_faces,
            left_out=left_out,
        )

    @property
    def shaded(self) -> NDArray[np.bool_]:
        """Pixels all of whose rays hit a surface that is not a light, (h, w)."""
        return (self.emitter == 0) & (self.background == 0)


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
    needs = opened(job).needs
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
    arrays = _one_pass(arrays["mean"]) | arrays
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


def _sum_over(values: Floats, kept: NDArray[np.bool_]) -> float:
    """Sum of values (c, h, w) over the pixels (h, w) that are kept; others may be NaN."""
    rows = (slice(top, top + ROWS) for top in range(0, kept.shape[0], ROWS))
    return sum(float(np.where(kept[some], values[:, some], 0.0).sum()) for some in rows)


def _one_pass(mean: Floats) -> dict[str, Any]:
    """What of an image's statistics one pass (3, h, w) has: it is the first, without a spread; that takes no memory."""
    nothing = np.broadcast_to(0.0, mean.shape)
    return {
        "first": mean,
        "mean": mean,
        "variance": nothing,
        "pixel_variance": nothing[0],
        "level_mean": None,
        "level_variance": nothing,
    }


def _clumping(sums: Floats, pixel_variance: Floats) -> float:
    """From each tile's sum of each pass (tiles, passes); below 1 it is taken for chance."""
    alone = float(pixel_variance.sum())
    if sums.shape[1] < 2 or alone == 0:
        return 1.0
    return max(1.0, float(sums.var(axis=1, ddof=1).sum()) / alone)
