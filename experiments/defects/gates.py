"""What the usual gates say of an image: they stand beside our verdict, and decide nothing."""

from __future__ import annotations

import math

import numpy as np
from skimage.metrics import structural_similarity

from nusselt.experiments.images.distance import Pair, flip
from nusselt.experiments.images.formats.png import to_levels
from nusselt.experiments.verdict.quantiles import normal_quantile
from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.image import Image

LEVELS = 1.0
"""Mean absolute difference of two 8-bit pictures that is let pass."""
SIMILAR, WINDOW = 0.95, 7
"""Least structural similarity that is let pass, and the side of its window in pixels."""
PERCEIVED = 0.05
"""Mean FLIP that is let pass."""
SIGNIFICANCE = 0.01
CHANGED, FEW = 4, 0.01
"""Levels by which a pixel is changed, and the share of pixels that may be."""
FORGIVEN = 0.0025
"""Share of pixels and channels that may fail by any amount, and the least variance a sample is taken to have: those
of Mitsuba's own render tests."""
LEAST_VARIANCE = 1e-4


def pictures_differ(ours: Image, reference: Reference) -> bool:
    """Whether two 8-bit PNGs differ by more than a level on average."""
    step = to_levels(ours.first).astype(int) - to_levels(reference.mean).astype(int)
    return bool(np.abs(step).mean() > LEVELS)


def structure_differs(ours: Image, reference: Reference) -> bool:
    """Whether the structural similarity (Wang et al. 2004) of two 8-bit PNGs is below what is commonly let pass.

    It falls with noise alone: right images of four classic scenes have 0.7 at one sample a light and 0.97 at 64.
    """
    height, width = reference.mean.shape[1:]
    side = min(height, width, WINDOW)
    window = side - 1 + side % 2
    if window < 3:
        return False
    pictures = to_levels(ours.first), to_levels(reference.mean)
    return bool(structural_similarity(*pictures, channel_axis=0, win_size=window) < SIMILAR)


def perceived(ours: Image, reference: Reference) -> bool | None:
    """Whether the mean FLIP of two 8-bit PNGs is above what is let pass; None where its package is not there."""
    told = flip(Pair(to_levels(ours.first)[None] / 255, to_levels(reference.mean)[None] / 255, levels=True))
    return None if told is None else told[0] > PERCEIVED


def pixels_differ(ours: Image, reference: Reference, samples: int, passes: int) -> bool:
    """A z-test of every pixel and channel, by Sidak's level, that forgives one in four hundred.

    The reference counts as exact.
    """
    step = np.abs(ours.mean - reference.mean)
    error = np.sqrt(np.maximum(ours.variance * samples, LEAST_VARIANCE) / (samples * passes))
    level = -math.expm1(math.log1p(-SIGNIFICANCE) / step.size)
    passed = step <= normal_quantile(level / 2) * error  # False for what is not a number
    return bool(1 - passed.mean() > FORGIVEN)


def changed(ours: Image, reference: Reference) -> bool:
    """Whether more than one pixel in a hundred of two 8-bit PNGs is off by more than four levels."""
    step = to_levels(ours.first).astype(int) - to_levels(reference.mean).astype(int)
    return bool((np.abs(step).max(axis=0) > CHANGED).mean() > FEW)
