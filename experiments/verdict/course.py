"""The course's feedback: bias and "variance" in 8-bit levels, and what to expect of them.

bias is the mean over pixels and channels of (reference - image), "variance" the mean of its square, both on
images clamped to [0, 1] and multiplied by 255. Nothing is rounded here: truncation to whole levels would add
up to 1/6 level^2 of its own where the reference has noise. The reference's own noise is taken out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.image import Image

from .quantiles import normal_quantile

SURE = 1e-4
"""How often a right image's score falls outside the expected interval."""


@dataclass(frozen=True)
class CourseScore:
    """Scores in levels and levels squared, and the interval each should fall into."""

    bias: float
    mse: float
    expected: dict[str, tuple[float, float]]


def course_score(ours: Image, reference: Reference, passes: int) -> CourseScore:
    """Score the first pass of an image; what to expect comes from the spread of all its passes."""
    target = 255 * np.clip(reference.mean, 0, 1)
    inside = (reference.mean > 0) & (reference.mean < 1)
    blur = np.where(inside, (255 * reference.standard_error) ** 2, 0.0)
    step = target - 255 * np.clip(np.nan_to_num(ours.first), 0, 1)
    square = (step**2 - blur).mean(axis=0)
    expected = ours.level_variance.mean(axis=0)
    sigmas = normal_quantile(SURE / 2)
    mse_reach = sigmas * float(square.std()) * math.sqrt((1 + 1 / max(passes - 1, 1)) / square.size)
    bias_reach = sigmas * math.sqrt(float((expected + blur.mean(axis=0)).sum())) / square.size
    mean = float(expected.mean())
    return CourseScore(
        float(step.mean()),
        float(square.mean()),
        {"bias": (-bias_reach, bias_reach), "mse": (max(mean - mse_reach, 0.0), mean + mse_reach)},
    )
