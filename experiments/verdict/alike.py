"""How much the noise of an image is like itself some pixels away."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from nusselt.renderer.vectors import Floats

from .quantiles import normal_quantile

AROUND = 5
"""Pixels a side over which noise is scaled to a deviation of one."""
CUT = 4.0
"""Deviations at which noise is cut off: single wild samples are no likeness."""
FEWEST = 500
"""Pairs of pixels below which nothing is said."""
LEAST = 0.05
"""Correlation that matters."""


@dataclass(frozen=True)
class Alike:
    """The largest correlation of an image's noise with itself moved by (right, down) pixels; 0 where it is chance.

    Parameters
    ----------
    correlation : float
    step : (int, int)
    clumping : float
        Variance of the sum of all pixels over what it were if they were independent: one, and the correlations that are
        not chance.
    """

    correlation: float = 0.0
    step: tuple[int, int] = (0, 0)
    clumping: float = 1.0

    @property
    def said(self) -> str:
        if not self.correlation:
            return ""
        right, down = self.step
        return f"the noise of pixels {right} to the right and {down} down is alike (correlation {self.correlation:.2f})"

    @classmethod
    def of(cls, noise: Floats, level: float) -> Alike:
        """Of noise (h, w), 0 where there is none, at this false-alarm rate over all steps."""
        height, width = noise.shape
        there = (noise != 0).astype(float)
        power = ndimage.uniform_filter(noise * noise, AROUND, mode="constant")
        weight = ndimage.uniform_filter(there, AROUND, mode="constant")
        scale = np.sqrt(np.divide(power, weight, out=np.ones_like(power), where=(weight > 0) & (power > 0)))
        z = np.clip(np.divide(noise, scale, out=np.zeros_like(noise), where=scale > 0), -CUT, CUT)
        sums, squares, pairs = (_pairs(values, height, width) for values in (z, z * z, there))
        # In one half plane: a step and its opposite are one pair.
        sums[0, width:] = squares[0, width:] = pairs[0, width:] = 0.0
        sums[0, 0] = 0.0
        enough = pairs > FEWEST
        beyond = normal_quantile(level / max(int(enough.sum()), 1))
        z_of = np.divide(sums, np.sqrt(squares), out=np.zeros_like(sums), where=enough & (squares > 0))
        variance = float((z * z).sum()) / max(float(there.sum()), 1.0)
        correlation = np.divide(sums, pairs * variance, out=np.zeros_like(sums), where=enough & (variance > 0))
        sure = (z_of > beyond) & (correlation > LEAST)
        if not sure.any():
            return cls()
        place = np.unravel_index(int(np.where(sure, correlation, 0.0).argmax()), sums.shape)
        down, right = (int(k) for k in place)
        clumping = 1 + 2 * float((correlation * pairs)[sure].sum()) / max(float(there.sum()), 1.0)
        step = (right if right < width else right - sums.shape[1], down)
        return cls(min(float(correlation[place]), 1.0), step, max(clumping, 1.0))


def _pairs(values: Floats, height: int, width: int) -> Floats:
    """Sums of v(p) v(p + step) over the image, for steps down (rows) and to either side (columns, as of an FFT)."""
    shape = (2 * height, 2 * width)
    found = np.fft.irfft2(np.abs(np.fft.rfft2(values, shape)) ** 2, shape)
    # A step (dy, dx) stands at row dy, column dx modulo the width.
    kept = found[:height]
    return np.asarray(np.where(np.abs(kept) < 1e-9 * math.fabs(kept[0, 0]), 0.0, kept))
