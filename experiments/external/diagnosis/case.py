"""One image before the hypotheses: how well a prediction fits it, and fits of one parameter."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nusselt.experiments.images.formats import Raw
from nusselt.experiments.images.transfer import Quantiser, Rule
from nusselt.renderer.vectors import Floats

from .probe import Probe

LEVELS = 255.0
"""Differences are counted in 8-bit levels, whatever the file."""
ROUNDS, FINER = 4, 9
"""Grids of a fit, and the values of the finer ones: each narrows the parameter four times."""
CHANCE = 3.0
"""Standard errors by which one prediction must be nearer than another to be called so."""


def nearer(one: Floats, other: Floats) -> float:
    """By how many standard errors the squares ``one`` (n,) are the smaller, pixel by pixel."""
    step = other - one
    error = float(step.std()) / math.sqrt(step.size)
    if error > 0:
        return float(step.mean()) / error
    return math.copysign(math.inf, float(step.mean())) if step.any() else 0.0


@dataclass(frozen=True)
class Guess:
    """A predicted image under one hypothesis.

    Parameters
    ----------
    prediction : (3, n) float64
        Radiance before clamping and levels.
    detail : str
    fitted : int
        Parameters that were fitted.
    rule : Rule, optional
        Instead of the image's own quantisation.
    noise : float
        What the mistake adds to the image's noise, levels squared.
    """

    prediction: Floats
    detail: str
    fitted: int = 0
    rule: Rule | None = None
    noise: float = 0.0


@dataclass(frozen=True)
class Case:
    """The images of one renderer at the probe's pixels.

    Parameters
    ----------
    probe : Probe
    raws : tuple of Raw
        Values (3, n): what each file holds there.
    quantiser : Quantiser
    """

    probe: Probe
    raws: tuple[Raw, ...]
    quantiser: Quantiser

    @cached_property
    def deviation(self) -> Floats:
        """Standard deviation (3, n) of one image's noise, as our estimator has it."""
        return np.sqrt(self.probe.variance)

    def observed(self, quantiser: Quantiser) -> Floats:
        """Mean of the images, radiance (3, n)."""
        return np.mean([quantiser.decode(raw) for raw in self.raws], axis=0)

    @cached_property
    def _observed(self) -> Floats:
        return self.observed(self.quantiser)

    @cached_property
    def valid(self) -> NDArray[np.bool_]:
        """Pixels (n,) that are finite in every image."""
        return np.asarray(np.isfinite(self._observed).all(axis=0))

    def squares(self, guess: Guess) -> Floats:
        """Squared difference in levels, mean of the channels, of each valid pixel."""
        quantiser, observed = self.quantiser, self._observed
        if guess.rule and quantiser.top:
            quantiser = replace(quantiser, rule=guess.rule)
            observed = self.observed(quantiser)
        return self._squares(guess.prediction, observed, quantiser)

    def _squares(self, prediction: Floats, observed: Floats, quantiser: Quantiser) -> Floats:
        predicted = quantiser.expected(prediction[:, self.valid], self.deviation[:, self.valid])
        return np.asarray(((LEVELS * (observed[:, self.valid] - predicted)) ** 2).mean(axis=0))

    def distance(self, prediction: Floats) -> float:
        """Mean squared difference in levels."""
        return float(self._squares(prediction, self._observed, self.quantiser).mean())

    def distance_at(self, prediction: Floats, some: NDArray[np.intp]) -> float:
        """The same for a prediction (3, k) of some pixels only."""
        predicted = self.quantiser.expected(prediction, self.deviation[:, some])
        return float(((LEVELS * (self._observed[:, some] - predicted)) ** 2).mean())

    def better(self, one: Guess, other: Guess) -> bool:
        """Whether ``one`` fits better than ``other`` beyond chance, pixel by pixel."""
        return nearer(self.squares(one), self.squares(other)) > CHANCE

    @cached_property
    def noise(self) -> float:
        """What of it is noise if our estimator's noise is the image's: levels squared."""
        valid = self.valid
        truth, variance = self.probe.truth[:, valid], self.probe.variance[:, valid]
        inside = ~self.quantiser.saturated(truth, np.sqrt(variance))
        filled = self.quantiser.spread(truth) * (variance > 0)
        share = 1 / len(self.raws) + 1 / self.probe.passes
        return float((LEVELS**2 * inside * (variance * share + filled / len(self.raws))).mean())

    def left(self, prediction: Floats) -> Floats:
        """Signed difference (n,) in levels, mean of the channels; NaN where the images are not finite."""
        predicted = self.quantiser.expected(prediction, self.deviation)
        return np.asarray(LEVELS * (self._observed - predicted).mean(axis=0))

    def fit(self, family: Callable[[float], Floats], grid: Iterable[float]) -> float:
        """The parameter whose prediction is nearest: the best of a grid, then of finer grids between its neighbours.

        Edges make the distance jagged, so that no slope is trusted.
        """
        values = np.asarray(list(grid), dtype=np.float64)
        for _ in range(ROUNDS):
            found = [self.distance(family(float(value))) for value in values]
            best = int(np.argmin(found))
            low, high = values[max(best - 1, 0)], values[min(best + 1, values.size - 1)]
            chosen = float(values[best])
            values = np.union1d(np.linspace(low, high, FINER), chosen)
        return chosen
