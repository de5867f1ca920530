"""How many samples, and in how many passes, reach a standard error: decided by a pilot whose data are dropped."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nusselt.renderer.vectors import Floats

SIZES = (4, 16, 64, 256, 1024)
"""Samples a pixel in a pass: full grids for the multijitter sampler."""
PILOT = 4
"""Passes of a pilot."""

ENOUGH = 1 << 22
"""Samples, over all pixels, after which a light that was never seen is taken to light nothing."""

OnePass = Callable[[int, int], Floats]
"""(samples, number of the pass) to the radiance (3, n) of that pass."""


@dataclass(frozen=True)
class Pilot:
    """What a few passes of one light say: its mean radiance, and the variance of one pass's pooled mean."""

    samples: int
    mean: float
    variance: float


@dataclass(frozen=True)
class Plan:
    """``passes`` passes of ``samples`` paths a pixel each."""

    samples: int
    passes: int

    def within(self, share: float) -> Plan:
        """A plan that takes this share of the time, where that is below 1; two passes at least."""
        return self if share >= 1 else Plan(self.samples, min(self.passes, max(2, int(self.passes * share))))


def pilot(one_pass: OnePass, samples: int) -> Pilot:
    """A pilot of one light; its variance is summed pixel by pixel, which has many degrees of freedom."""
    pixels = np.stack([one_pass(samples, number).mean(axis=0) for number in range(PILOT)])
    variance = float(pixels.var(axis=0, ddof=1).sum()) / max(pixels.shape[1], 1) ** 2
    return Pilot(samples, float(pixels.mean()) if pixels.size else 0.0, variance)


def plan(
    one_pass: OnePass,
    first: Pilot,
    allowed: float,
    passes: int,
    max_samples: int,
    affordable: Callable[[int], bool] = lambda samples: True,
) -> Plan:
    """Enlarge the passes of one light until ``passes`` of them reach a variance; only then make more rounds.

    Larger passes come first because multijitter's noise falls faster than one over the samples.

    Parameters
    ----------
    first : Pilot
        At the smallest size.
    allowed : float
        Variance that the mean of all passes may have.
    passes : int
        Fewest passes of a light with noise.
    max_samples : int
        Per pixel, in all passes together.
    affordable : callable
        Whether there is time for ``passes`` passes of so many samples: larger ones are not tried.
    """
    found = first
    if found.variance == 0:
        return Plan(1, 2)  # no noise: a second pass only shows that there is none
    for samples in SIZES:
        if samples <= found.samples or found.variance <= allowed * passes or samples * passes > max_samples:
            continue
        if not affordable(samples):
            break
        found = pilot(one_pass, samples)
    rounds = math.ceil(found.variance / allowed / passes) if allowed > 0 else 1
    most = max(1, max_samples // (found.samples * passes))
    return Plan(found.samples, passes * min(max(rounds, 1), most))


def unseen(pixels: int, passes: int, max_samples: int) -> Plan:
    """For a light with extent whose pilot saw no noise: most likely it lights nothing, but a pilot can miss."""
    sizes = [size for size in SIZES if size == SIZES[0] or size * passes <= max_samples]
    enough = [size for size in sizes if size * passes * pixels >= ENOUGH]
    return Plan(min(enough, default=max(sizes)), passes)
