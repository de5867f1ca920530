"""Is the variance right? An unbiased estimator with ten times the variance passes every test of means.

Ours is compared with what Mitsuba's `direct` has for the same strategy and number of samples, one light at a
time, and the pass means with what independent pixels would give.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats

from nusselt.renderer.vectors import Floats

from .inference import resting_on

MARGIN = 0.1
"""A variance that is right within this share is right; so is the spread of passes."""
RESAMPLES = 400
BATCH = 10


@dataclass(frozen=True)
class Ratio:
    """A ratio of variances.

    Parameters
    ----------
    value : float
    interval : tuple of float
        At the level it is tested at.
    """

    value: float
    interval: tuple[float, float]

    @property
    def fails(self) -> bool:
        """Whether the whole interval lies beyond the margin."""
        return self.interval[0] > 1 + MARGIN or self.interval[1] < 1 / (1 + MARGIN)


def log_ratio_error(ours: Floats, theirs: Floats) -> float:
    """Standard error of log(sum ours / sum theirs) by resampling pixels (n,), both sides together."""

    def log_ratio(mine: Floats, other: Floats, axis: int) -> Floats:
        tiny = 1e-300  # a resample may miss the only noisy pixel
        return np.asarray(np.log(np.maximum(mine.mean(axis=axis), tiny) / np.maximum(other.mean(axis=axis), tiny)))

    found = stats.bootstrap(
        (ours, theirs),
        log_ratio,
        paired=True,
        vectorized=True,
        n_resamples=RESAMPLES,
        batch=BATCH,
        method="basic",
        random_state=np.random.default_rng(0),
    )
    return float(found.standard_error)


def variance_ratio(ours: Floats, theirs: Floats, level: float) -> Ratio | None:
    """Ratio of two mean variances over the same pixels (n,), None where neither side has any.

    Each pixel's variance is itself an estimate; resampling pixels takes that in. The quantile is Student's, by
    how many pixels carry the variance.
    """
    mine, other = float(ours.mean()), float(theirs.mean())
    if other == 0 or ours.size < 2:
        return None if mine == 0 or ours.size < 2 else Ratio(math.inf, (math.inf, math.inf))
    if mine == 0:
        return Ratio(0.0, (0.0, 0.0))
    freedom = max(min(resting_on(ours), resting_on(theirs)) - 1, 1.0)
    reach = float(stats.t.isf(level / 2, freedom)) * log_ratio_error(ours / mine, theirs / other)
    return Ratio(mine / other, (mine / other * math.exp(-min(reach, 700)), mine / other * math.exp(min(reach, 700))))


def pass_spread(passes: Floats, variance: float, freedom: float, level: float) -> Ratio | None:
    """Variance of pass means (r,) over what independent pixels would give, with its F interval.

    Parameters
    ----------
    variance, freedom : float
        Of one pass's pooled mean, from the pixels' own variances, and how many degrees of freedom that has.
    """
    if passes.size < 4 or variance <= 0:
        return None
    value = float(np.var(passes, ddof=1)) / variance
    low, high = stats.f.ppf([level / 2, 1 - level / 2], passes.size - 1, freedom)
    return Ratio(value, (value / float(high), value / float(low)))
