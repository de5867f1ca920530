"""An image at a requested error: more light points until independent passes agree that well."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Estimator
from nusselt.renderer.image import Image, render
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene
from nusselt.renderer.visibility.ray_offset import RayOffset

PASSES = 8
"""Independent images whose spread is the error estimate: of itself known to 1 / sqrt(14), for a pixel; far better
over an image."""
MOST = 1 << 20
FIRST = 16


@dataclass(frozen=True)
class Reached:
    """An image and its error.

    Parameters
    ----------
    image : Image
    samples : int
        Light points in each of its passes.
    error : float
        Standard error of the mean image over its own root mean square, both over shaded pixels.
    """

    image: Image
    samples: int
    error: float


def relative_error(image: Image, passes: int) -> float:
    """Root mean square standard error of the channels' average over shaded pixels, relative to its size."""
    s = image.shaded
    size = float((image.mean.mean(axis=0)[s] ** 2).mean()) if s.any() else 0.0
    return math.sqrt(float(image.pixel_variance[s].mean()) / passes / size) if size > 0 else 0.0


def render_until(
    scene: Scene,
    estimator: Estimator,
    error: float,
    *,
    seed: int = 0,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | None = None,
    offset: RayOffset | None = None,
) -> Reached:
    """Render with more samples, each time afresh, until the error estimate is at most ``error``.

    A new attempt drops the earlier ones: to keep an image because its own spread came out small would bias it.
    The next number of samples supposes that the error falls as N^-1/2 at least: at most a factor 16 a step.

    Raises
    ------
    InputError
        For an error outside (0, 1), or one that more samples cannot reach.
    """
    if not 0 < error < 1:
        raise InputError("error", error, "a number above 0 and below 1")
    draw = partial(render, scene, executor=executor, progress=progress, offset=offset, by_light=True)
    needs = prepare(scene).needs
    if scene.spp == 1 and not estimator.is_random(needs):
        if estimator.claim(needs) != "exact":
            raise InputError("error", error, f"an estimator with noise: {estimator.name} cannot tell its error here")
        return Reached(draw(estimator, seed=seed), estimator.samples, 0.0)
    samples = FIRST
    for attempt in range(64):
        tried = dataclasses.replace(estimator, samples=samples)  # type: ignore[type-var]
        root = int(np.random.SeedSequence([seed, attempt]).generate_state(1, np.uint64)[0] >> 1)
        image = draw(tried, seed=root, passes=PASSES)
        found = relative_error(image, PASSES)
        if found <= error:
            return Reached(image, samples, found)
        # Whole powers of four: squares, which strata ask for.
        samples *= 4 ** min(max(1, round(math.log(found / error, 4))), 2)
        if samples > MOST:
            break
    raise InputError("error", error, f"an error that {MOST} samples reach; {found:.2g} was reached")
