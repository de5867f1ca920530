"""What noise a right image may have, known from the scene and from passes of ours before the image is looked at.

Equal values never say that a pixel has no noise: eight passes of ours may all miss the corner of a light that a ninth
finds, and so may somebody's two images. Only the scene says it: where no light with extent shines, and nothing else is
drawn at random.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from nusselt.experiments.check.ceiling import grain_of_reference, sample_ceilings
from nusselt.renderer.image import Image
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Bools, Floats

from .expected import Renders
from .ground_truth import Truth

MISSED = 5.0
"""Samples, on average, of which a reference that found none has surely missed no more: e^-5."""
AROUND = 15
"""Pixels a side of the square over which differences say how noisy an image is: 224 of them, without the pixel."""


@dataclass(frozen=True)
class Noise:
    """Of one image.

    Parameters
    ----------
    sampled : (h, w) bool
        Pixels whose value may be random.
    deviation : (3, h, w) float64
        Standard deviation; above 0 at every sampled pixel that is not black for certain.
    variance : (h, w) float64
        Of the channels' average.
    grain, reference_grain : (h, w) float64
        The most that one sample can bring to the pixel, and to the truth's.
    least : float
        Share of it that one image has at least: 0 where the number of its samples is not known.
    """

    sampled: Bools
    deviation: Floats
    variance: Floats
    grain: Floats
    reference_grain: Floats
    least: float


def noise_of(
    scene: Scene,
    draws: int,
    seen: Image,
    truth: Truth,
    renders: Renders,
    least: float = 1.0,
    weight: int = 1,
) -> Noise:
    """The noise of an estimator's image where passes of it showed some, and elsewhere the most it can have.

    The mean of N values in [0, U] whose expectation is T varies by at most T U / N, and by U^2 / 4 N.

    Parameters
    ----------
    draws : int
        N: light samples of a pixel, or camera rays where pixels are areas.
    seen : Image
        From `sides.stage`.
    renders : Renders
        Of the estimator.
    least : float
        See `Noise`.
    weight : int
        How many times as much a sample may weigh because others were left out at random, one light of some picked, or
        paths ended: then what has no noise alone has some.
    """
    mean = truth.reference.mean
    grey, boxed = mean.mean(axis=0), scene.spp > 1
    ceilings = sample_ceilings(scene.with_(spp=1) if truth.exact else scene)
    reference_grain = grain_of_reference(ceilings, truth.reference)
    ceiling = ceilings.max(axis=0, initial=0.0)
    if weight > 1:  # a visible light brings no more than all of them
        ceiling = weight * np.maximum(ceiling, grey)
    if boxed:  # whatever a pixel's neighbours show, some of its rays may meet; no light where it is known to show none
        shows = np.where(seen.shaded, np.maximum(ceiling, grey), 0.0)
        around = ndimage.maximum_filter(np.maximum(ceiling, grey), 3)
        ceiling = np.where(seen.shaded & truth.exact, ndimage.maximum_filter(shows, 3), around)
    most = grey if truth.exact else grey + 3 * truth.reference.pixel_standard_error + MISSED * reference_grain
    limit = np.minimum(most * ceiling, max(len(ceilings), 1) * ceiling**2 / 4) / draws
    sampled = (seen.emitter < 1) & (seen.background < 1) if boxed else seen.shaded & (ceiling > 0) & (most > 0)
    variance = np.where(renders.pixel_variance > 0, renders.pixel_variance, limit)
    tint = np.divide(mean, grey, out=np.ones_like(mean), where=grey > 0)
    deviation = np.where(renders.deviation > 0, renders.deviation, np.sqrt(limit) * tint)
    if weight > 1:
        variance = weight * variance + (weight - 1) * grey**2 / draws
        deviation = np.sqrt(weight * deviation**2 + (weight - 1) * mean**2 / draws)
    return Noise(
        sampled,
        np.where(sampled, deviation, 0.0),
        np.where(sampled, variance, 0.0),
        ceiling / draws,
        reference_grain,
        least,
    )


def asked_for(square: Floats, supposed: Floats, some: Bools) -> Floats:
    """How many times (h, w) the variance supposed squared differences (h, w) are around each pixel.

    Of the pixels ``some``, without the pixel itself: what is wrong there alone is not taken for noise.
    """

    def around(values: Floats) -> Floats:
        total = values = np.where(some, values, 0.0)
        for axis in (0, 1):
            total = ndimage.correlate1d(total, np.ones(AROUND), axis, mode="constant")
        return np.maximum(total - values, 0.0)

    found, usual = around(square), around(supposed)
    return np.divide(found, usual, out=np.ones_like(found), where=usual > 0)
