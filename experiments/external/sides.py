"""Somebody's images as one side of the project's judge, and the truth as the other.

What cannot be judged is masked alike on both sides and counted: pixels whose level can be cut off at an end of the
range, and what a lossy compression mixed. Levels are compared with what they are expected to be on average (see
`transfer`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from nusselt.experiments.images.formats import Raw
from nusselt.experiments.images.formats.raw import Rounding
from nusselt.experiments.images.transfer import Quantiser
from nusselt.experiments.verdict.evidence import ROUNDING
from nusselt.mitsuba_bridge.reference import Reference
from nusselt.mitsuba_bridge.tolerance import ray_tolerance
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import Image, render
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Bools, Floats

from .ground_truth import Truth
from .noise import Noise, asked_for

PART = 0.5
"""Share of a light given to a masked pixel, which is marked as not to be judged too: it is not one of the shaded."""
SNAP = 1e-5
"""Radiance from a level's edge within which a noise-free value may have fallen to either side."""
BLOCK = 8
"""Pixels a side of the blocks of a lossy compression."""


@dataclass(frozen=True)
class Sides:
    """Two sides for `judge`, and what was counted.

    Parameters
    ----------
    image : Image
    reference : Reference
    images : int
        How many images ``image.mean`` averages.
    supposed : (h, w) float64
        Variance that one image was supposed to have.
    factor : float
        How many times that it has.
    deviation : (3, h, w) float64
        With which levels are expected: at most that supposed.
    saturated : int
        Shaded pixels that are masked.
    at_the_top : int
        Shaded pixels at the highest level in the first image.
    """

    image: Image
    reference: Reference
    images: int
    supposed: Floats
    factor: float
    deviation: Floats
    saturated: int
    at_the_top: int


def stage(scene: Scene, truth: Truth) -> Image:
    """What our camera sees where, and which pixels lie at an edge.

    Where pixels are areas, the truth says it. Nothing is asked there of plain pixels beside another colour: two lights
    may meet in one, and a reference's rays may have missed a sliver.
    """
    if scene.spp == 1:
        return render(scene, Area(samples=1), tolerance=ray_tolerance(scene))
    mean, emitter, background = truth.reference.mean, truth.reference.emitter, truth.reference.background
    part = (emitter == 1) & beside_another(mean, 3) | (background == 1) & beside_another(background[None], 3)
    return replace(Image.without_noise(mean, np.where(part, PART, emitter), background), unjudged=part)


def beside_another(colour: Floats, size: int) -> Bools:
    """Where a colour (c, h, w) is not the same all over a square of so many pixels a side, (h, w)."""
    window = (1, size, size)
    high, low = ndimage.maximum_filter(colour, window), ndimage.minimum_filter(colour, window)
    return np.asarray((high - low > ROUNDING * np.abs(high)).any(axis=0))


def two_sides(seen: Image, raws: list[Raw], quantiser: Quantiser, truth: Reference, noise: Noise) -> Sides:
    """Line somebody's images up with the truth.

    Parameters
    ----------
    seen : Image
        From `stage`.
    raws : list of Raw
        Different images: a repeated one says nothing new.
    """
    shaded, rounding = seen.shaded, max((raw.rounding for raw in raws), key=lambda one: one.relative)
    saturated = shaded & quantiser.saturated(truth.mean, noise.deviation).any(axis=0)
    masked = saturated | _mixed(seen, rounding)
    decoded = np.stack([quantiser.decode(raw) for raw in raws])
    deviation = noise.deviation
    expected = quantiser.expected(truth.mean, deviation)
    if quantiser.top:
        supposed = noise.variance + quantiser.spread(truth.mean).mean(axis=0)
        share = _share_of_noise(decoded, expected, supposed + truth.pixel_standard_error**2, shaded & noise.sampled)
        deviation = deviation * np.sqrt(share)
        expected = quantiser.expected(truth.mean, deviation)
    snapped = _snapped(decoded, expected, truth.mean, quantiser, rounding)
    decoded = np.where(noise.sampled, decoded, snapped)
    emitter = np.where(masked, PART, seen.emitter)
    judged = shaded & ~masked
    level = np.where(noise.sampled, quantiser.spread(truth.mean), 0.0)
    supposed = noise.variance + level.mean(axis=0)
    variance, pixel_variance, factor = _variances(
        decoded, expected, (noise.deviation**2 + level, supposed), noise.least, truth, judged & noise.sampled
    )
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
        unjudged=seen.unjudged | masked,
    )
    top = int((raws[0].values == quantiser.top).any(axis=0)[shaded].sum()) if quantiser.top else 0
    reference = replace(truth, mean=expected, emitter=emitter, background=seen.background)
    if len(raws) > 1:
        reference = _undithered(reference, np.where(decoded.var(axis=0, ddof=1) < level, level, 0.0))
    return Sides(image, reference, len(raws), supposed, factor, deviation, int(saturated.sum()), top)


def _share_of_noise(decoded: Floats, expected: Floats, supposed: Floats, some: Bools) -> Floats:
    """How much of the variance supposed images have around each pixel, (h, w), at most 1.

    Noise of less than a level does not even levels out: what a level is on average depends on it.
    """
    grey = decoded.mean(axis=1)
    square = grey.var(axis=0, ddof=1) if len(grey) > 1 else (grey[0] - expected.mean(axis=0)) ** 2
    return np.minimum(asked_for(square, supposed, some & np.isfinite(square)), 1.0)


def _undithered(reference: Reference, level: Floats) -> Reference:
    """Where images are quieter than their levels are wide, noise does not even the levels out: each pixel is off.

    By how much, up to half a level, depends on noise that is not known so well. All images are off alike.

    Parameters
    ----------
    level : (3, h, w) float64
        Variance of a number spread over its level; 0 where noise evens it out.
    """
    return replace(
        reference,
        standard_error=np.sqrt(reference.standard_error**2 + level),
        pixel_standard_error=np.sqrt(reference.pixel_standard_error**2 + level.mean(axis=0)),
    )


def _variances(
    decoded: Floats, expected: Floats, of_one: tuple[Floats, Floats], least: float, truth: Reference, some: Bools
) -> tuple[Floats, Floats, float]:
    """Variance of one of k images (3, h, w), of its channels' average (h, w), and how many times the supposed it is.

    Of several it is their own; where they are equal by chance, that chance counts as one value beside the supposed. Of
    one it is the supposed, and more where differences ask for more: they hold mistakes too, which makes intervals
    longer, never shorter.
    """
    supposed, supposed_grey = of_one
    grey, count = decoded.mean(axis=1), len(decoded)
    if count > 1:
        own, own_grey = decoded.var(axis=0, ddof=1), grey.var(axis=0, ddof=1)
        factor = _ratio(own_grey, supposed_grey, some)
        share = factor / count
        return np.where(own > 0, own, share * supposed), np.where(own_grey > 0, own_grey, share * supposed_grey), factor
    square = (grey[0] - expected.mean(axis=0)) ** 2
    usual, some = supposed_grey + truth.pixel_standard_error**2, some & np.isfinite(square)
    times = np.maximum(asked_for(square, usual, some), least)
    return times * supposed, times * supposed_grey, max(_ratio(square, usual, some), least)


def _ratio(one: Floats, other: Floats, some: Bools) -> float:
    """Of two sums over the pixels ``some``; 1 where there is nothing to divide by."""
    total = float(other[some].sum())
    return float(np.nan_to_num(one[some]).sum()) / total if total > 0 else 1.0


def _mixed(seen: Image, rounding: Rounding) -> Bools:
    """Pixels (h, w) that share a block of a lossy compression with a light's edge, or are plain and at any edge."""
    if not rounding.lossy:
        return np.zeros(seen.emitter.shape, dtype=bool)

    light = np.where(seen.emitter > 0, seen.mean, -1.0)
    size = 2 * BLOCK - 1
    return beside_another(light, size) | (beside_another(seen.background[None], size) & ~seen.shaded)


def _snapped(decoded: Floats, expected: Floats, truth: Floats, quantiser: Quantiser, rounding: Rounding) -> Floats:
    """Values without noise that differ by the format's rounding alone take the expected one."""
    if quantiser.top:
        edges = quantiser.edges
        near = np.clip(np.searchsorted(edges, truth), 1, quantiser.top - 1)
        gap = np.minimum(np.abs(truth - edges[near]), np.abs(truth - edges[near - 1]))
        one = 1.5 * np.diff(quantiser.values).max()
        even = (np.abs(decoded - expected) <= one) & (gap < SNAP)
    else:
        even = np.abs(decoded - expected) <= rounding.limit(expected)
    return np.where(even, expected, decoded)
