"""Is the normal approximation earned? Where it is not, a verdict is `undecided`, with advice.

A Student t on heavy-tailed data false-fails 23.5 % of the time at a nominal 1 % (64 samples, measured). Three
things are looked at on either side: how many pixels the noise rests on, how many passes there are, and the
skewness and excess kurtosis of the pass means.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from nusselt.renderer.vectors import Floats

from .inference import resting_on

FEWEST = 50
"""Noise that rests on fewer pixels than this is not taken for normal: at 30, lognormal noise of 2.9 means still
false-alarmed at 1.2 times the declared rate, at 50 at a quarter of it."""
PASSES = 32
"""Fewest passes from whose spread alone a standard error is taken: a t with 7 degrees of freedom costs 24
standard errors at a report's level, 12 at 14, 8.8 at 30."""
SURE = 1e-6
"""How often normal pass means are taken for heavy-tailed or skewed."""


@dataclass(frozen=True)
class Side:
    """The noise of one side.

    Parameters
    ----------
    name : str
        For the advice.
    noise : (n,) float64
        Variance at each judged pixel.
    passes : (r,) float64
        Means over these pixels, pass by pass.
    by_passes : bool
        Whether its standard error comes from the passes alone.
    """

    name: str
    noise: Floats
    passes: Floats
    by_passes: bool

    @property
    def is_random(self) -> bool:
        return bool(self.noise.size and self.noise.max() > 0)

    @property
    def excess_kurtosis(self) -> float | None:
        """Of the pass means; None below four passes or without noise."""
        if self.passes.size < 4 or not self.is_random or np.ptp(self.passes) == 0:
            return None
        return float(stats.kurtosis(self.passes, bias=False))

    def objection(self) -> str:
        """Why its mean may not be normal, with advice; empty if nothing speaks against it."""
        if not self.is_random:
            return ""
        if self.by_passes and self.passes.size < PASSES:
            return f"{self.name} has {self.passes.size} passes, fewer than {PASSES}: more passes would decide"
        if resting_on(self.noise) < FEWEST:
            return f"the noise of {self.name} rests on fewer than {FEWEST} pixels: more samples would decide"
        if is_heavy(self.passes):
            return f"the passes of {self.name} are heavy-tailed or skewed: larger passes would decide"
        return ""


def is_heavy(values: Floats) -> bool:
    """Whether independent values (r,) are too long-tailed or too skewed for a t interval of their mean.

    D'Agostino's and Anscombe-Glynn's tests; below 20 values neither can tell, and nothing is said.
    """
    if values.size < 20 or np.ptp(values) == 0:
        return False
    tail = stats.kurtosistest(values, alternative="greater").pvalue
    skew = stats.skewtest(values).pvalue
    return bool(min(tail, skew) < SURE / 2)
