"""Are pixels and passes independent? Then the means of passes vary as the pixels' own variances say."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import special

from nusselt.experiments.verdict.evidence import Evidence
from nusselt.experiments.verdict.intervals import Ratio, average, resting_on
from nusselt.experiments.verdict.rule import Finding
from nusselt.renderer.vectors import Floats

from .normality import FEWEST


def pass_spread(passes: Floats, noise: Floats, level: float) -> Ratio:
    """Variance of pass means (b, r) over what independent pixels would give, with its F interval; none without noise.

    Parameters
    ----------
    noise : (b, n) float64
        Variance of the mean of all passes at each pixel.
    """
    count = passes.shape[-1]
    pooled = average(noise) / max(noise.shape[-1], 1)
    noisy = pooled > 0
    value, low, high = np.full((3, len(pooled)), np.nan)
    value[noisy] = passes[noisy].var(axis=-1, ddof=1) / count / pooled[noisy]
    ours, theirs = count - 1, (count - 1) * resting_on(noise[noisy])  # degrees of freedom of an F
    low[noisy] = value[noisy] * special.fdtri(theirs, ours, level / 2)
    high[noisy] = value[noisy] / special.fdtri(ours, theirs, level / 2)
    return Ratio(value, low, high)


@dataclass(frozen=True)
class PassSpread:
    """Fails where the whole interval lies beyond its margin.

    Says nothing of fewer than four passes, nor of noise that rests on few pixels (its law is not F's), nor where pixels
    share their light points, as they then should.
    """

    name: str = "pass spread"
    share: float = 1.0

    def __call__(self, evidence: Evidence, level: float) -> Finding:
        passes = evidence.ours.passes
        if evidence.shares_points or passes.shape[-1] < 4:
            return Finding(evidence.nowhere, lambda k: "", figures={"pass_spread": None})
        spread = pass_spread(passes, evidence.ours.grey_variance, level)
        fails = spread.fails & (resting_on(evidence.ours.grey_variance) >= FEWEST)
        return Finding(
            fails,
            lambda k: (
                f"passes vary {spread.value[k]:.3g} times as much as independent pixels would" if fails[k] else ""
            ),
            figures={"pass_spread": spread.value},
        )
