"""Pooled means, tiles, and roots of noisy squares: the statistics under a verdict.

A pixel is the unit: its channels are averaged first, since they share their light samples. Our noise is
clustered by pixel, whose passes are independent; the reference's is taken from its passes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from nusselt.renderer.vectors import Floats

Bools = NDArray[np.bool_]

TILES = 8
"""Tiles a side."""


@dataclass(frozen=True)
class Level:
    """The declared false-alarm rate, and one row's share of it.

    Parameters
    ----------
    alpha : float
        Of the whole report: the chance that any correct row is called ``differs``.
    rows : int
        Rows in the report.
    """

    alpha: float = 1e-3
    rows: int = 1

    @property
    def pooled(self) -> float:
        return self.alpha / 2 / self.rows

    @property
    def tile(self) -> float:
        return self.alpha / 4 / self.rows / TILES**2

    @property
    def rest(self) -> float:
        """Each of the three remaining tests: the variance, whether pixels are independent, and the channels."""
        return self.alpha / 4 / self.rows / 3

    def at_look(self, number: int) -> Level:
        """The share of look 1, 2, ... at a growing number of samples: alpha/(k (k+1)), alpha in all."""
        return Level(self.alpha / (number * (number + 1)), self.rows)


@dataclass(frozen=True)
class Bias:
    """A mean difference with its noise.

    Parameters
    ----------
    value, standard_error : float
    freedom : float
        Degrees of freedom (Welch-Satterthwaite).
    """

    value: float
    standard_error: float
    freedom: float

    def half_width(self, level: float, normal: bool = True) -> float:
        """Of the two-sided interval at this false-alarm rate.

        Without ``normal``, by Chebyshev's inequality: sqrt(1/level) standard errors, whatever the distribution.
        """
        sigmas = float(stats.t.isf(level / 2, self.freedom)) if normal else math.sqrt(1 / level)
        return sigmas * self.standard_error

    def reserve(self, power: float) -> float:
        """How far beyond the end of the interval a true bias must lie to be found with this power."""
        return float(stats.t.isf(1 - power, self.freedom)) * self.standard_error


def pooled_bias(difference: Floats, noise: Floats, passes: Floats, our_passes: Floats | None = None) -> Bias:
    """Mean difference over pixels.

    Parameters
    ----------
    difference, noise : (n,) float64
        Ours minus the reference at each pixel, and the variance of our value there.
    passes : (r,) float64
        The reference's mean over the same pixels in each of its passes; no noise if r < 2.
    our_passes : (s,) float64, optional
        The same of ours, where pixels share their light points: then only whole passes are independent.
    """
    count = difference.size
    mine = (float(noise.sum()) / count**2, freedom_of(noise)) if our_passes is None else _from_passes(our_passes)
    return welch(float(difference.mean()), mine, _from_passes(passes))


def _from_passes(values: Floats) -> tuple[float, float]:
    """Variance of the mean of independent passes (r,), and its degrees of freedom; no noise if r < 2."""
    if values.size < 2:
        return 0.0, 1.0
    return float(np.var(values, ddof=1)) / values.size, values.size - 1.0


def welch(value: float, *sides: tuple[float, float]) -> Bias:
    """A difference whose sides have the given (variance, degrees of freedom): Welch-Satterthwaite."""
    variance = sum(side[0] for side in sides)
    weight = sum(side[0] ** 2 / side[1] for side in sides)
    freedom = variance**2 / weight if weight > 0 else 1e9
    return Bias(value, math.sqrt(variance), max(freedom, 1.0))


def freedom_of(noise: Floats) -> float:
    """Degrees of freedom of a sum of estimated variances (n,), whatever their law.

    2 (sum v)^2 / Var(sum v), and Var(sum v) <= E sum v^2: twice the number of pixels the noise rests on.
    """
    return 2 * resting_on(noise)


def resting_on(noise: Floats) -> float:
    """How many pixels carry the noise: (sum v)^2 / sum v^2, at least 1; all of them where there is none."""
    scale = float(noise.max(initial=0.0))
    if scale == 0:
        return float(max(noise.size, 1))
    shares = noise / scale
    return float(shares.sum() ** 2 / (shares * shares).sum())


@dataclass(frozen=True)
class Tiles:
    """Bias by place.

    Parameters
    ----------
    bias, error, freedom, p : (8, 8) float64
        Mean difference, its standard error and degrees of freedom, and the two-sided p-value of no bias; NaN
        where a tile has no pixel, and p also where it has no noise.
    """

    bias: Floats
    error: Floats
    freedom: Floats
    p: Floats

    def failing(self, level: float, margin: float | Floats) -> int:
        """How many tiles lie beyond +-margin (radiance; one, or one a tile) at this false-alarm rate each."""
        some = ~np.isnan(self.bias)
        margins = np.broadcast_to(margin, self.bias.shape)[some]
        reach = stats.t.isf(level / 2, self.freedom[some]) * self.error[some] + margins
        return int((np.abs(self.bias[some]) > reach).sum())

    @property
    def without_noise(self) -> int:
        """Tiles that have pixels and no noise: compared to rounding, and left out of the p-values."""
        return int((~np.isnan(self.bias) & np.isnan(self.p)).sum())


def tile_numbers(height: int, width: int) -> NDArray[np.int64]:
    """Which of the 8 x 8 tiles each pixel belongs to, (h, w), row by row."""
    rows = np.minimum(np.arange(height) * TILES // height, TILES - 1)
    columns = np.minimum(np.arange(width) * TILES // width, TILES - 1)
    return np.asarray(rows[:, None] * TILES + columns, dtype=np.int64)


def tile_biases(difference: Floats, noise: Floats, judged: Bools, rounding: float) -> Tiles:
    """Welch's t in each of 8 x 8 tiles.

    Parameters
    ----------
    difference, noise : (h, w) float64
        Ours minus the reference, and the variance of that from both sides.
    judged : (h, w) bool
    rounding : float
        Errors below this are no noise.
    """
    number = tile_numbers(*difference.shape)[judged]

    def total(values: Any) -> Floats:
        return np.bincount(number, values, minlength=TILES**2).astype(np.float64).reshape(TILES, TILES)

    count = total(np.ones(number.size))
    size = np.maximum(count, 1)
    variance, squares = total(noise[judged]), total(noise[judged] ** 2)
    bias = np.where(count > 0, total(difference[judged]) / size, np.nan)
    error = np.sqrt(variance) / size
    freedom = np.divide(variance**2, squares, out=np.full((TILES, TILES), 1e9), where=squares > 0)
    noisy = (count > 0) & (error > rounding)
    p = np.full((TILES, TILES), np.nan)
    p[noisy] = 2 * stats.t.sf(np.abs(bias[noisy]) / error[noisy], freedom[noisy])
    return Tiles(bias, error, np.maximum(freedom, 1.0), p)


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


def denoised_root(square: Floats, level: float) -> tuple[float, tuple[float, float]]:
    """Root of a mean square (n,) whose expected noise has been taken out, with its interval."""
    mean = float(square.mean())
    reach = float(stats.norm.isf(level / 2)) * float(square.std()) / math.sqrt(square.size)
    return math.sqrt(max(mean, 0.0)), (math.sqrt(max(mean - reach, 0.0)), math.sqrt(max(mean + reach, 0.0)))
