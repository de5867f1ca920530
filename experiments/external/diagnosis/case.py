"""The images of one renderer before the hypotheses: how well a prediction fits, and what it leaves beyond noise.

Squares are weighted by one over the noise of their pixel. What is left beyond noise is the product of the errors of two
halves of the images, whose noise is independent: no estimate of the noise is needed. Of one image it is the square
without the noise that is supposed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import ndimage

from nusselt.experiments.images.formats import Raw
from nusselt.experiments.images.transfer import Quantiser, Rule
from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.vectors import Bools, Floats

from .probe import Probe

ROUNDS, FINER = 4, 9
"""Grids of a fit, and the values of the finer ones: each narrows the parameter four times."""
FLOOR = 0.005
LEAST = 0.05
"""Error of a noise-free pixel that counts as one deviation: this share of its radiance, and so much of the mean."""
AROUND = 5
"""Pixels a side over which the noise of few images is averaged for the weights."""
TILE = 6
"""Pixels a side of the tiles whose errors are summed: smooth errors stand out of the noise there."""
DARK = 1e-3
"""Share of the truth's mean to which a dark image's pixels are looked at more closely."""
EDGE = 0.15
"""The same of pixels beside another thing, of the brightest around: there a hair decides what is seen."""
FARTHER = 0.01
"""The same of the pixels next to those."""
OFF = 3.0
"""Errors, in units of `FLOOR`, from which a pixel without noise is off."""


@dataclass(frozen=True)
class Guess:
    """A predicted image under one hypothesis.

    Parameters
    ----------
    name : str
        What the hypothesis is called.
    prediction : (3, n) float64
        Radiance before clamping and levels.
    detail : str
    fitted : int
        Parameters that were fitted.
    error : (n,) float64
        Variance of the prediction's own noise, channels averaged.
    rule : Rule, optional
        Instead of the image's own quantisation.
    noise : (n,) float64
        Variance that one image has more than by the right rules.
    """

    name: str
    prediction: Floats
    detail: str
    fitted: int = 0
    error: Floats | float = 0.0
    rule: Rule | None = None
    noise: Floats | float = 0.0


@dataclass(frozen=True)
class Inputs:
    """What is known of images and truth, whole.

    Parameters
    ----------
    raws : list of Raw
        Different images of independent noise.
    quantiser : Quantiser
        How they are to be read if nothing is wrong.
    mean : (3, h, w) float64
        The truth.
    error : (h, w) float64
        Variance of its own noise.
    judged, shaded : (h, w) bool
        Pixels that are compared; that show what reflects.
    noise : (3, h, w) float64, optional
        Variance of one right image, where it is not that of our estimator through pixels' centres.
    """

    raws: list[Raw]
    quantiser: Quantiser
    mean: Floats
    error: Floats
    judged: Bools
    shaded: Bools
    noise: Floats | None = None

    @classmethod
    def against(
        cls,
        raws: list[Raw],
        quantiser: Quantiser,
        reference: Reference,
        judged: Bools | None = None,
        noise: Floats | None = None,
    ) -> Inputs:
        """Images and what they are compared with; all pixels are unless some are ``judged``.

        Where pixels are areas, those that are partly a surface are not.
        """
        shaded = (reference.emitter == 0) & (reference.background == 0)
        error = (reference.standard_error**2).mean(axis=0)
        one_kind = shaded | (reference.emitter == 1) | (reference.background == 1)
        judged = one_kind if judged is None else judged & one_kind
        return cls(raws, quantiser, reference.mean, error, judged, shaded, noise)


@dataclass(frozen=True)
class Case:
    """Images at the probe's pixels.

    Parameters
    ----------
    probe : Probe
    given : Inputs
    """

    probe: Probe
    given: Inputs

    @cached_property
    def raws(self) -> list[Raw]:
        return [Raw(self.probe.pick(raw.values)) for raw in self.given.raws]

    @property
    def quantiser(self) -> Quantiser:
        return self.given.quantiser

    @cached_property
    def truth(self) -> Floats:
        """(3, n)."""
        return self.probe.pick(self.given.mean)

    @cached_property
    def deviation(self) -> Floats:
        """Standard deviation (3, n) of one right image's noise."""
        noise = self.given.noise
        return np.sqrt(self.probe.variance if noise is None else self.probe.pick(noise))

    @cached_property
    def images(self) -> Floats:
        """(k, 3, n)."""
        return np.stack([self.quantiser.decode(raw) for raw in self.raws])

    @cached_property
    def observed(self) -> Floats:
        """Mean of the images (3, n); 0 where they are not finite."""
        return np.where(np.isfinite(self.images), self.images, 0.0).mean(axis=0)

    @cached_property
    def valid(self) -> Bools:
        """Pixels (n,) that are compared, finite in every image, and not cut off at the top."""
        kept = np.isfinite(self.images).all(axis=(0, 1)) & self.probe.pick(self.given.judged)
        cut_off = self.quantiser.saturated(self.truth, self.deviation).any(axis=0)
        return np.asarray(kept & ~(cut_off & self.lit))  # without noise the top is compared as it is

    @cached_property
    def lit(self) -> Bools:
        """Pixels (n,) that show a surface which reflects."""
        out = np.zeros(self.truth.shape[1], dtype=bool)
        out[self.probe.sight.lit] = True
        return out

    @cached_property
    def shaded(self) -> Bools:
        return self.valid & self.lit

    @cached_property
    def plain(self) -> Bools:
        return self.valid & ~self.lit

    @cached_property
    def variance(self) -> Floats:
        """Of the noise of ``observed`` (n,), channels averaged: the images own, or of one image the supposed."""
        if len(self.images) > 1:
            own = np.where(self.valid, self.images, 0.0).var(axis=0, ddof=1).mean(axis=0)
        else:
            own = (self.seen**2 * self.deviation**2 + self.quantiser.spread(self.truth)).mean(axis=0)
        return np.asarray(own * self.lit / len(self.images))

    @cached_property
    def seen(self) -> float:
        """How bright surfaces are over how bright they should be, from `DARK` to 1: noise is as much less."""
        some = self.shaded
        right = float(np.abs(self.truth)[:, some].mean()) if some.any() else 0.0
        return float(np.clip(np.abs(self.observed)[:, some].mean() / right, DARK, 1.0)) if right > 0 else 1.0

    @cached_property
    def floor(self) -> Floats:
        """(n,): see `FLOOR`; without the edges' part."""
        grey = np.abs(self.truth).mean(axis=0)
        usual = float(grey[self.shaded].mean()) if self.shaded.any() else float(grey.mean())
        usual = usual or float(grey.max()) or 1.0  # a scene that is black
        grey = np.where(self.shaded, self.seen * grey, grey)  # a dark image is looked at as closely
        step = 1.0 / self.quantiser.top if self.quantiser.top else 0.0
        return FLOOR * (grey + LEAST * self.seen * usual) + step

    @cached_property
    def beside(self) -> Bools:
        """Pixels (n,) with another thing beside them."""
        surface = self.probe.grid(self.probe.sight.surface)
        return np.asarray((ndimage.maximum_filter(surface, 3) != ndimage.minimum_filter(surface, 3)).ravel())

    @property
    def crowded(self) -> float:
        """How much larger errors of surfaces are beside another thing: their share over the pixels' share."""
        squares = (self.observed - self.truth)[:, self.shaded] ** 2
        squares = squares.mean(axis=0) / (self.smooth(self.variance, self.shaded) + self.floor**2)[self.shaded]
        beside = self.beside[self.shaded]
        if not beside.any():
            return 0.0
        return float(squares[beside].sum()) / max(float(squares.sum()), 1e-300) / float(beside.mean())

    @cached_property
    def weight(self) -> Floats:
        """One over the variance of each pixel's error (n,); 0 where it is not compared."""
        around = self.smooth(self.variance, self.shaded)
        grey, beside = (
            self.probe.grid(values) for values in (np.abs(self.truth).mean(axis=0), self.beside.astype(float))
        )
        next_to_it = np.where(ndimage.maximum_filter(beside, 3) > 0, FARTHER * ndimage.maximum_filter(grey, 5), 0.0)
        edge = np.where(beside > 0, EDGE * ndimage.maximum_filter(grey, 3), next_to_it).ravel()
        error = around + self.probe.pick(self.given.error) + self.floor**2 + edge**2
        return np.where(self.valid, 1 / error, 0.0)

    def smooth(self, values: Floats, some: Bools) -> Floats:
        """Mean (n,) over the neighbours of each pixel that are of ``some``; 0 elsewhere."""
        grid, mask = (self.probe.grid(v) for v in (np.where(some, values, 0.0), some.astype(float)))
        total, count = (ndimage.uniform_filter(v, AROUND, mode="constant") for v in (grid, mask))
        return np.asarray(np.where(mask > 0, total / np.maximum(count, 1e-9), 0.0).ravel())

    def expected(self, guess: Guess) -> tuple[Floats, Floats]:
        """What images show on average under a guess (3, n), and images (k, 3, n) as they are read then."""
        quantiser, images = self.quantiser, self.images
        if guess.rule and quantiser.top:
            quantiser = replace(quantiser, rule=guess.rule)
            images = np.stack([quantiser.decode(raw) for raw in self.raws])
        return quantiser.expected(guess.prediction, self.deviation), np.nan_to_num(images)

    def fit(self, guess: Guess) -> Fit:
        """What a guess leaves."""
        expected, images = self.expected(guess)
        left = np.where(self.valid, images - expected, 0.0)
        return Fit(self, guess, left)

    @cached_property
    def right(self) -> Fit:
        """What no mistake leaves."""
        return self.fit(Guess("", self.truth, ""))

    def distance(self, prediction: Floats) -> float:
        """Weighted sum of the squares of a prediction's errors, over pixels."""
        step = self.observed - self.quantiser.expected(prediction, self.deviation)
        return float((self.weight * (step * step).mean(axis=0)).sum())

    def nearest(self, family: Callable[[float], Floats], grid: Iterable[float]) -> float:
        """The parameter whose prediction is nearest."""
        return least(lambda value: self.distance(family(value)), grid, ROUNDS)

    def combined(self, parts: Floats, rest: Floats | None = None, some: Bools | None = None) -> Floats:
        """Factors (j,) of the parts (j, 3, n) whose sum, beside a fixed ``rest``, is nearest: least squares."""
        weight = np.sqrt(self.weight if some is None else self.weight * some)
        if self.quantiser.top:  # what is cut off tells of no factor
            weight = weight * (self.observed < self.quantiser.edges[-1]).all(axis=0)
        wanted = self.observed if rest is None else self.observed - rest
        table = (parts * weight).reshape(len(parts), -1)
        factors, *_ = np.linalg.lstsq(table.T, (wanted * weight).ravel(), rcond=1e-9)
        return np.asarray(factors)


@dataclass(frozen=True)
class Fit:
    """A guess and what it leaves (k, 3, n) of the images."""

    case: Case
    guess: Guess
    left: Floats

    @cached_property
    def squares(self) -> Floats:
        """Weighted squares (n,) of the mean image's errors."""
        mean = self.left.mean(axis=0)
        noise = self.guess.noise * self.case.lit if len(self.left) == 1 else 0.0
        return np.asarray(self.case.weight * ((mean * mean).mean(axis=0) - noise))

    @cached_property
    def halves(self) -> tuple[Floats, Floats]:
        """What is left (3, n) of two halves of the images; of one image the same twice."""
        half = max(len(self.left) // 2, 1)
        return self.left[:half].mean(axis=0), self.left[-half:].mean(axis=0)

    @cached_property
    def _noise(self) -> Floats:
        """What of a product of halves is noise (n,), weighted."""
        case = self.case
        noise = np.where(case.valid, self.guess.error + case.probe.pick(case.given.error), 0.0)
        if len(self.left) == 1:
            noise = noise + case.variance + self.guess.noise * case.lit
        return np.asarray(case.weight * noise)

    def pixels(self, some: Bools) -> tuple[float, float]:
        """What is left beyond noise over the pixels ``some``, and the standard error that noise gives it."""
        one, other = self.halves
        terms = (self.case.weight * (one * other).mean(axis=0) - self._noise)[some]
        return float(terms.sum()), math.sqrt(float((self._spread[some] ** 2).sum()))

    def tiles(self, some: Bools) -> tuple[float, float]:
        """The same of sums over tiles."""
        root = np.sqrt(self.case.weight) * some
        one, other = (np.stack([self._tiled(root * channel) for channel in half]) for half in self.halves)
        terms = (one * other).mean(axis=0) - self._tiled(self._noise * some)
        return float(terms.sum()), math.sqrt(float((self._tiled(self._spread * some) ** 2).sum()))

    @cached_property
    def _spread(self) -> Floats:
        """Standard deviation (n,) of a weighted product of two halves' noise: twice what one has of the mean's."""
        case = self.case
        own = case.smooth(case.variance, case.shaded) + self.guess.error + case.probe.pick(case.given.error)
        return np.asarray(2 * case.weight * (own + case.floor**2))

    def _tiled(self, values: Floats) -> Floats:
        grid = self.case.probe.grid(values)
        pad = [(0, -side % TILE) for side in grid.shape]
        whole = np.pad(grid, pad)
        rows, columns = (side // TILE for side in whole.shape)
        return np.asarray(whole.reshape(rows, TILE, columns, TILE).sum(axis=(1, 3)).ravel())

    def over(self, other: Fit) -> float:
        """Standard errors by which this fits better than another, pixel by pixel."""
        return nearer(self.squares[self.case.valid], other.squares[self.case.valid])

    @cached_property
    def plain_off(self) -> int:
        """Pixels without noise that are off."""
        worst = np.abs(self.left).max(axis=(0, 1))
        return int((worst > OFF * self.case.floor)[self.case.plain].sum())

    @cached_property
    def plain_left(self) -> float:
        """How far those are off in all: squares over that of a usual radiance, one at most of a pixel."""
        scale = self.case.floor / FLOOR
        one, other = self.halves
        noise = np.where(self.case.valid, self.guess.error, 0.0)
        if len(self.left) == 1:
            noise = noise + self.guess.noise
        squares = ((one * other).mean(axis=0) - noise) / scale**2
        return max(float(np.minimum(squares, 1.0)[self.case.plain].sum()), 0.0)


def least(distance: Callable[[float], float], grid: Iterable[float], rounds: int) -> float:
    """The value of least distance: the best of a grid, then of finer grids between its neighbours.

    Edges make the distance jagged, so that no slope is trusted.
    """
    values = np.asarray(list(grid), dtype=np.float64)
    for _ in range(rounds):
        best = int(np.argmin([distance(float(value)) for value in values]))
        chosen, low, high = float(values[best]), values[max(best - 1, 0)], values[min(best + 1, values.size - 1)]
        values = np.union1d(np.linspace(low, high, FINER), chosen)
    return chosen


def nearer(one: Floats, other: Floats) -> float:
    """By how many standard errors the squares ``one`` (n,) are the smaller, pixel by pixel."""
    step = other - one
    error = float(step.std()) / math.sqrt(step.size) if step.size else 0.0
    if error > 0:
        return float(step.mean()) / error
    return math.copysign(math.inf, float(step.mean())) if step.any() else 0.0
