"""Somebody's images as one side of the project's judge, and the truth as the other.

What cannot be judged is masked alike on both sides and counted: pixels whose level can be cut off at an end of the
range. Levels are compared with what they are expected to be on average (see `transfer`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from nusselt.experiments.images.formats import Raw
from nusselt.experiments.images.transfer import Quantiser
from nusselt.mitsuba_bridge.reference import Reference
from nusselt.mitsuba_bridge.tolerance import ray_tolerance
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import Image, render
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats

from .expected import Renders

PART = 0.5
"""Share of a light given to a masked pixel: neither shaded nor plain, so that nothing is asked of it."""
SNAP = 1e-5
"""Radiance from a level's edge within which a noise-free value may have fallen to either side."""


@dataclass(frozen=True)
class Sides:
    """Two sides for `judge`, and what was counted.

    Parameters
    ----------
    image : Image
    reference : Reference
    images : int
        How many images ``image.mean`` averages.
    saturated : int
        Shaded pixels that are masked.
    at_the_top : int
        Shaded pixels at the highest level in the first image.
    """

    image: Image
    reference: Reference
    images: int
    saturated: int
    at_the_top: int


def stage(scene: Scene) -> Image:
    """What our camera sees where, and which pixels lie at an edge."""
    return render(scene, Area(samples=1), tolerance=ray_tolerance(scene))


def two_sides(seen: Image, raws: list[Raw], quantiser: Quantiser, truth: Reference, renders: Renders) -> Sides:
    """Line somebody's images up with the truth.

    Parameters
    ----------
    seen : Image
        From `stage`.
    raws : list of Raw
        Different images: a repeated one says nothing new.
    """
    shaded = seen.shaded
    deviation = np.where(shaded, renders.deviation, 0.0)
    masked = shaded & quantiser.saturated(truth.mean, deviation).any(axis=0)
    decoded = np.stack([quantiser.decode(raw) for raw in raws])
    expected = quantiser.expected(truth.mean, deviation)
    decoded = np.where(shaded, decoded, _snapped(decoded, expected, truth.mean, quantiser, raws[0].rounding))
    emitter = np.where(masked, PART, seen.emitter)
    judged = shaded & ~masked
    count = len(raws)
    if count > 1:
        variance = decoded.var(axis=0, ddof=1)
        pixel_variance = _by_chance(decoded.mean(axis=1).var(axis=0, ddof=1), quantiser, truth, judged)
    else:
        variance = deviation**2 + quantiser.spread(truth.mean)
        pixel_variance = _supposed(decoded[0], expected, renders, quantiser, truth, judged)
    levels = 255 * np.clip(np.nan_to_num(decoded), 0, 1)
    image = replace(
        seen,
        first=decoded[0],
        mean=decoded.mean(axis=0),
        variance=variance,
        pixel_variance=pixel_variance,
        level_mean=levels.mean(axis=0),
        level_variance=255**2 * np.nan_to_num(variance),
        pass_means=np.array(
            [np.nan_to_num(one.mean(axis=0)[judged]).mean() if judged.any() else 0.0 for one in decoded]
        ),
        left_out=(),
        emitter=emitter,
    )
    top = int((raws[0].values == quantiser.top).any(axis=0)[shaded].sum()) if quantiser.top else 0
    reference = replace(truth, mean=expected, emitter=emitter, background=seen.background)
    return Sides(image, reference, count, int(masked.sum()), top)


def _snapped(decoded: Floats, expected: Floats, truth: Floats, quantiser: Quantiser, rounding: float) -> Floats:
    """Plain pixels that differ by the format's rounding alone take the expected value."""
    if quantiser.top:
        edges = quantiser.edges
        near = np.clip(np.searchsorted(edges, truth), 1, quantiser.top - 1)
        gap = np.minimum(np.abs(truth - edges[near]), np.abs(truth - edges[near - 1]))
        one = 1.5 * np.diff(quantiser.values).max()
        even = (np.abs(decoded - expected) <= one) & (gap < SNAP)
    else:
        even = np.abs(decoded - expected) <= rounding * np.abs(expected)
    return np.where(even, expected, decoded)


def _by_chance(variance: Floats, quantiser: Quantiser, truth: Reference, judged: np.ndarray) -> Floats:
    """Among noisy images, equal levels in a pixel do not say that it has no noise: a level's spread stands in."""
    if not quantiser.top or not variance[judged].any():
        return variance
    return np.where(variance > 0, variance, quantiser.spread(truth.mean).mean(axis=0))


def _supposed(
    decoded: Floats, expected: Floats, renders: Renders, quantiser: Quantiser, truth: Reference, judged: np.ndarray
) -> Floats:
    """Noise of a single image: our estimator's, and more where the differences ask for more.

    Their mean square holds systematic differences too: a longer interval, never a shorter one.
    """
    supposed = np.where(judged, renders.pixel_variance, 0.0) + quantiser.spread(truth.mean).mean(axis=0)
    some = judged & np.isfinite(decoded).all(axis=0)
    if not some.any():
        return supposed
    square = float(((decoded - expected).mean(axis=0)[some] ** 2).mean())
    usual = float((supposed + truth.pixel_standard_error**2)[some].mean())
    if usual > 0:
        return supposed * max(1.0, square / usual)
    return supposed + square
