"""Noise that two images, or two places of one image, have in common."""

from __future__ import annotations

import math

import numpy as np
from scipy import ndimage, special

from nusselt.experiments.images.formats import Raw
from nusselt.renderer.vectors import Floats

AROUND = 5
"""Pixels a side of the mean that is taken off: what is left is noise, not a smooth mistake."""
NOISY = 1.0
"""Levels: quieter pixels share their whole levels, not their noise."""
SURE = 7.0
LEAST = 0.1
"""Correlation that is told, and how many standard errors it must have."""
CUT = 5.0
"""Standard deviations beyond which a difference is no noise."""
NEAR = 4
"""Pixels within which neighbours may look alike for other reasons."""


def different(raws: list[Raw]) -> list[Raw]:
    """Each image once."""
    found: list[Raw] = []
    for raw in raws:
        if not any(np.array_equal(raw.values, other.values) for other in found):
            found.append(raw)
    return found


def whitened(difference: Floats, deviation: Floats, shaded: np.ndarray) -> Floats:
    """Differences (h, w) in standard deviations, without their smooth part; 0 where there is no noise."""
    noisy = shaded & (255 * deviation > NOISY) & np.isfinite(difference)
    z = np.where(noisy, np.divide(difference, deviation, out=np.zeros_like(difference), where=noisy), 0.0)
    return np.where(np.abs(z) < CUT, rough(z, noisy), 0.0)


def smooth(values: Floats, some: np.ndarray) -> Floats:
    """The mean of values (h, w) around each pixel, of the pixels ``some`` alone."""
    weight = ndimage.uniform_filter(some.astype(float), AROUND, mode="constant")
    total = ndimage.uniform_filter(np.where(some, values, 0.0), AROUND, mode="constant")
    return np.asarray(total / np.maximum(weight, 1e-9))


def rough(values: Floats, some: np.ndarray) -> Floats:
    """Values (h, w) at the pixels ``some`` without what is smooth among those; 0 elsewhere."""
    return np.where(some, np.where(some, values, 0.0) - smooth(values, some), 0.0)


def common_noise(fields: list[Floats]) -> float:
    """Largest correlation of two images' noise, 0 unless it is beyond chance."""
    best = 0.0
    for k, one in enumerate(fields):
        for other in fields[:k]:
            best = max(best, _beyond_chance(one, other))
    return best


def _beyond_chance(one: Floats, other: Floats) -> float:
    size = math.sqrt(float((one * one).sum()) * float((other * other).sum()))
    count = int(((one != 0) & (other != 0)).sum())
    if size == 0 or count < 100:
        return 0.0
    found = float((one * other).sum()) / size
    return found if found > max(LEAST, SURE / math.sqrt(count)) else 0.0


def amount(field: Floats) -> float:
    """How much noise an image has, by the median over pixels: 1 where it is as supposed, and nothing else is wrong."""
    noise = field[field != 0] ** 2
    return float(np.median(noise)) / _median(1) if noise.size else 0.0


def apart(steps: list[Floats], deviation: Floats, noisy: np.ndarray) -> float:
    """How much k images (h, w) vary among each other, over the variance supposed: 1 where their noise is independent.

    By the median over pixels: a mistake that takes the noise off some pixels, a missing shadow, is no noise in common.
    """
    ratio = np.var(steps, axis=0, ddof=1)[noisy] / deviation[noisy] ** 2
    freedom = len(steps) - 1
    return float(np.median(ratio)) / (_median(freedom) / freedom) if ratio.size else 1.0


def _median(freedom: int) -> float:
    """Of chi-squared."""
    return 2 * float(special.gammaincinv(freedom / 2, 0.5))
