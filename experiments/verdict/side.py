"""What one renderer says of the pixels of b rows at once; a report's row is a batch of one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.renderer.vectors import Bools, Floats


@dataclass(frozen=True)
class Side:
    """What one renderer says of n pixels.

    Parameters
    ----------
    name : str
        For sentences.
    mean, variance : (b, c, n) float64
        Radiance in c channels, and the variance of that mean.
    grey_variance : (b, n) float64
        The same of the channels' average: a pixel's channels share their light samples.
    passes : (b, r) float64
        Mean over pixels and channels, pass by pass.
    by_passes : bool
        Whether the standard error of its pooled mean comes from the passes alone.
    sampled : bool
        Whether anything in it is random, by what is known of scene and estimator: equal values prove nothing.
    shares_points : bool
        Whether its pixels share their light points.
    freedom : float
        Degrees of freedom of each pixel's variance.
    clumping : float
        Variance of a sum of pixels over what it were if they were independent.
    grain : (n,) float64, optional
        The most that one sample brings to a pixel's mean; None where no bound is known. Noise may rest on few
        samples that were not seen: squares of grains are added to what was (see `intervals.Bias`).
    """

    name: str
    mean: Floats
    variance: Floats
    grey_variance: Floats
    passes: Floats
    by_passes: bool
    sampled: bool = True
    grain: Floats | None = None
    shares_points: bool = False
    freedom: float = 1.0
    clumping: float = 1.0

    @classmethod
    def of_passes(cls, name: str, passes: Floats, by_passes: bool) -> Side:
        """From all values (b, r, c, n) of r passes."""
        count, channels = passes.shape[1:3]
        variance = passes.var(axis=1, ddof=1, dtype=np.float64) / count
        grey = passes.mean(axis=2, dtype=np.float64)
        grey_variance = variance[:, 0] if channels == 1 else grey.var(axis=1, ddof=1) / count
        mean = passes.mean(axis=1, dtype=np.float64)
        return cls(name, mean, variance, grey_variance, grey.mean(axis=2), by_passes)

    @property
    def grey(self) -> Floats:
        """Its channels' average, (b, n)."""
        return np.asarray(self.mean.mean(axis=1))

    @property
    def is_random(self) -> Bools:
        """(b,)"""
        return np.asarray(self.sampled & (self.grey_variance.max(axis=-1, initial=0.0) > 0))

    def grain_of(self, weights: Floats | float) -> float:
        """The most that one sample brings to a sum of pixels with these weights; 0 where no bound is known.

        Where pixels share their light points, a sample is one of all of them.
        """
        if self.grain is None or not self.sampled:
            return 0.0
        brought = np.abs(weights) * self.grain
        return float(brought.sum() if self.shares_points else brought.max(initial=0.0))


@dataclass(frozen=True)
class Seen:
    """One side at every pixel: radiance (b, c, p), and shares of camera rays that meet a light or nothing, (b, p)."""

    mean: Floats
    emitter: Floats
    background: Floats

    @property
    def is_whole(self) -> Bools:
        """Where no share is a random one, because a pixel's box is part emitter or part background."""
        shares = np.stack((self.emitter, self.background))
        return np.asarray(((shares == 0) | (shares == 1)).all(axis=0))

    @property
    def shaded(self) -> Bools:
        return np.asarray((self.emitter == 0) & (self.background == 0))
