"""Means with their noise, ratios of variances, roots of noisy squares: the statistics under the rules.

Everything works along the last axis, of pixels (..., n) or passes (..., r), whatever stands before it. A pixel is
the unit: its channels are averaged first, since they share their light samples.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nusselt.renderer.vectors import Bools, Floats

from .quantiles import student_quantile
from .side import Side

VARIANCE_MARGIN = 0.1
"""A variance that is right within this share is right; so is the spread of passes."""


@dataclass(frozen=True)
class Bias:
    """Mean differences with their noise.

    Parameters
    ----------
    value, standard_error : (...) float64
    freedom : (...) float64
        Degrees of freedom (Welch-Satterthwaite).
    grain : float or (...) float64
        The most that one sample brings to the value; see `half_width`.
    """

    value: Floats
    standard_error: Floats
    freedom: Floats
    grain: Floats | float = 0.0

    def half_width(self, level: float, normal: bool | Bools = True) -> Floats:
        """Of the two-sided interval at this false-alarm rate.

        Student's, of the standard error with the grain's ln(2/level) squares added: so many samples, at most, can have
        been missed by every pass. Simulated on means of rare hits (1 to 1000 pixels, hit with probabilities 1e-4 to
        0.5, 4 or 64 samples, 2 to 32 passes) the false-alarm rate was never above the level, where Student's interval
        of the standard error alone failed up to 99.9 % of the time. Where no grain is known and the mean is not
        ``normal``, by Chebyshev's inequality: sqrt(1/level) standard errors, whatever the distribution.
        """
        unseen = np.sqrt(self.standard_error**2 + math.log(2 / level) * np.asarray(self.grain) ** 2)
        return np.where(normal, student_quantile(level / 2, self.freedom), math.sqrt(1 / level)) * unseen

    def reserve(self, power: float) -> Floats:
        """How far beyond the end of the interval a true bias must lie to be found with this power."""
        return np.asarray(student_quantile(1 - power, self.freedom) * self.standard_error)


def average(values: Floats) -> Floats:
    """Mean along the last axis; 0 of nothing."""
    return np.asarray(values.sum(axis=-1) / max(values.shape[-1], 1))


def pooled_bias(difference: Floats, noise: Floats, passes: Floats, our_passes: Floats | None = None) -> Bias:
    """Mean difference over pixels.

    Parameters
    ----------
    difference, noise : (..., n) float64
        Ours minus the reference at each pixel, and the variance of our value there.
    passes : (..., r) float64
        The reference's mean over the same pixels in each of its passes; no noise if r < 2.
    our_passes : (..., s) float64, optional
        The same of ours, where pixels share their light points: then only whole passes are independent.
    """
    ours = _by_pixels(noise) if our_passes is None else _by_passes(our_passes)
    return welch(average(difference), ours, _by_passes(passes))


def weighted_bias(ours: Side, reference: Side, weights: Floats | float = 1.0) -> Bias:
    """Mean of (ours - reference) times weights (n,) over pixels, with the noise and the grains of both sides.

    Its passes tell a side's noise only where every weight is one.
    """
    count = max(ours.grey_variance.shape[-1], 1)

    def noise(side: Side) -> tuple[Floats, Floats]:
        if side.by_passes and np.ndim(weights) == 0:
            return _by_passes(side.passes)
        return _by_pixels(side.grey_variance * np.asarray(weights) ** 2 * side.clumping)

    value = average((ours.grey - reference.grey) * weights)
    share = np.broadcast_to(weights, (count,)) / count
    grain = math.hypot(ours.grain_of(share), reference.grain_of(share))
    return welch(value, noise(ours), noise(reference), grain=grain)


def _by_pixels(noise: Floats) -> tuple[Floats, Floats]:
    """Variance of the mean of independent pixels (..., n), and its degrees of freedom."""
    return noise.sum(axis=-1) / max(noise.shape[-1], 1) ** 2, freedom_of(noise)


def _by_passes(values: Floats) -> tuple[Floats, Floats]:
    """Variance of the mean of independent passes (..., r), and its degrees of freedom; no noise if r < 2."""
    count = values.shape[-1]
    if count < 2:
        return np.zeros(values.shape[:-1]), np.ones(())
    return np.var(values, axis=-1, ddof=1) / count, np.asarray(count - 1.0)


def welch(value: Floats, *sides: tuple[Floats, Floats], grain: float = 0.0) -> Bias:
    """A difference whose sides have the given (variance, degrees of freedom): Welch-Satterthwaite."""
    variance = np.asarray(sum(side[0] for side in sides))
    weight = np.asarray(sum(side[0] ** 2 / side[1] for side in sides))
    freedom = np.divide(variance**2, weight, out=np.full(weight.shape, 1e9), where=weight > 0)
    return Bias(value, np.sqrt(variance), np.maximum(freedom, 1.0), grain)


def freedom_of(noise: Floats) -> Floats:
    """Degrees of freedom of a sum of estimated variances (..., n), whatever their law.

    2 (sum v)^2 / Var(sum v), and Var(sum v) <= E sum v^2: twice the number of pixels the noise rests on.
    """
    return 2 * resting_on(noise)


def resting_on(noise: Floats) -> Floats:
    """How many pixels carry the noise: (sum v)^2 / sum v^2, at least 1; all of them where there is none."""
    scale = noise.max(axis=-1, keepdims=True, initial=0.0)
    shares = np.divide(noise, scale, out=np.ones_like(noise), where=scale > 0)  # the largest is 1: no square vanishes
    return np.maximum(shares.sum(axis=-1) ** 2 / np.maximum((shares * shares).sum(axis=-1), 1.0), 1.0)


@dataclass(frozen=True)
class Ratio:
    """Ratios of variances (...), with their intervals at the level they are tested at; NaN where there is none."""

    value: Floats
    low: Floats
    high: Floats

    @property
    def fails(self) -> Bools:
        """Whether the whole interval lies beyond the margin."""
        return np.asarray((self.low > 1 + VARIANCE_MARGIN) | (self.high < 1 / (1 + VARIANCE_MARGIN)))

    @property
    def interval(self) -> Floats:
        """(..., 2)"""
        return np.stack((self.low, self.high), axis=-1)


def error_of_mean(values: Floats, judged: Bools) -> float:
    """Standard error of the mean of independent noisy values (h, w) over the judged pixels.

    From steps between neighbours in a row (von Neumann's): what varies smoothly cancels, and what is left of it
    makes the error too large rather than too small.
    """
    pairs = judged[:, 1:] & judged[:, :-1]
    if not pairs.any():
        return math.inf
    step = (values[:, 1:] - values[:, :-1])[pairs]
    return math.sqrt(float((step * step).mean()) / 2 / int(judged.sum()))
