"""Every hypothesis against one image, ranked by the share of the difference that it explains.

explained = 1 - (M_h - N) / (M_0 - N), M the mean squared difference in levels under the hypothesis and under none, N
the part of it that is noise. A hypothesis is told only if it fits better beyond chance, pixel by pixel.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from nusselt.experiments.images.formats import Raw
from nusselt.experiments.images.transfer import Quantiser
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats

from .case import Case, Guess, nearer
from .hypotheses import HYPOTHESES
from .probe import Probe
from .shared_points import shared_points

SURE = 4.0
"""Standard errors by which a hypothesis must fit better than none."""
TOLD = 0.05
"""Least share of the difference worth telling."""
TIE = 0.005
"""Shares this close are one: the simpler hypothesis comes first."""
MOST = 5


@dataclass(frozen=True)
class Mistake:
    """One entry of ``likely_mistakes``."""

    name: str
    explained: float
    detail: str


@dataclass(frozen=True)
class Diagnosis:
    """What an image looks like.

    Parameters
    ----------
    mistakes : tuple of Mistake
        The likeliest first; empty where none fits better than no mistake at all.
    difference, noise : float
        Mean squared difference at the probe's pixels, and its part that is noise: 8-bit levels squared.
    """

    mistakes: tuple[Mistake, ...]
    difference: float
    noise: float

    def rows(self) -> list[dict[str, Any]]:
        return [asdict(mistake) for mistake in self.mistakes]


@dataclass(frozen=True)
class _Found:
    name: str
    guess: Guess
    squares: Floats

    @property
    def distance(self) -> float:
        return float(self.squares.mean())

    @property
    def beyond_noise(self) -> float:
        """Without the noise that the mistake itself brings."""
        return self.distance - self.guess.noise


def diagnose(
    scene: Scene,
    raws: list[Raw],
    quantiser: Quantiser,
    samples: int,
    stratified: bool,
    progress: Callable[[str, int, int], None] | None = None,
) -> Diagnosis:
    """Rank the hypotheses for the images of one renderer.

    Parameters
    ----------
    raws : list of Raw
        Whole images.
    quantiser : Quantiser
        How they are to be read if nothing is wrong.
    samples, stratified
        Of the estimator they were made with.
    """
    probe = Probe(scene, samples, stratified)
    case = Case(probe, tuple(Raw(probe.pick(raw.values)) for raw in raws), quantiser)
    if not case.valid.any():
        return Diagnosis((), math.nan, case.noise)
    right = _Found("", Guess(probe.truth, ""), case.squares(Guess(probe.truth, "")))
    found = []
    for number, (name, guesses) in enumerate(HYPOTHESES.items()):
        if progress:
            progress("mistakes", number, len(HYPOTHESES))
        tried = [_Found(name, guess, case.squares(guess)) for guess in guesses(case)]
        if tried:
            found.append(min(tried, key=lambda one: one.beyond_noise))
    noise = min([case.noise, right.distance, *(one.distance for one in found)])
    shared = shared_points(case, right.distance)
    if shared is not None:
        found.append(_Found("correlated-seeds", shared[0], shared[1]))
        noise = min(noise, found[-1].distance)
    return Diagnosis(tuple(_ranked(found, right, noise)), right.distance, case.noise)


def _ranked(found: list[_Found], right: _Found, noise: float) -> list[Mistake]:
    whole = right.distance - noise
    if whole <= 0:
        return []

    def explained(one: _Found) -> float:
        return float(np.clip(1 - (one.beyond_noise - noise) / whole, 0, 1))

    likely = [one for one in found if explained(one) >= TOLD and nearer(one.squares, right.squares) > SURE]
    likely.sort(key=lambda one: -explained(one))
    if likely:
        best = likely[0]
        even = [one for one in likely if explained(best) - explained(one) < TIE]
        even.sort(key=lambda one: one.guess.fitted)
        likely = even + [one for one in likely if one not in even]
    return [Mistake(one.name, explained(one), one.guess.detail) for one in likely[:MOST]]
