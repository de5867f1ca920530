"""Is each channel right? The pooled mean averages them, and cannot see two of them swapped."""

from __future__ import annotations

import math

import numpy as np
from scipy import stats

from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.image import Image

from .inference import Bools, freedom_of

NAMES = ("red", "green", "blue")


def colour_failures(
    ours: Image, reference: Reference, judged: Bools, passes: int, level: float, margin: float
) -> list[str]:
    """Channels whose bias is further than the margin (radiance) from that of their average.

    Channels share their samples, in an unknown measure: the error of the difference is at most the sum of both.

    Parameters
    ----------
    level : float
        False-alarm rate of all three together.
    """
    count = int(judged.sum())
    if count == 0:
        return []
    step = (ours.mean - reference.mean)[:, judged]
    bias = np.abs(step.mean(axis=1) - step.mean())
    noise = (ours.variance / passes + reference.standard_error**2)[:, judged]
    grey = (ours.pixel_variance / passes + reference.pixel_standard_error**2)[judged]
    error = (np.sqrt(noise.sum(axis=1)) + math.sqrt(float(grey.sum()))) / count
    freedom = min(freedom_of(row) for row in (*noise, grey))
    reach = float(stats.t.isf(level / 6, freedom)) * error
    return [
        f"{name} is off by {value:.3g} beyond the average of the channels"
        for name, value, limit in zip(NAMES, bias, reach + margin, strict=True)
        if value > limit
    ]
