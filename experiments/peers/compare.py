"""Two contestants against each other: the verdict's own rules of the mean and of the residual, and the lights seen."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nusselt.experiments.verdict.decision import Word, decide
from nusselt.experiments.verdict.evidence import Evidence
from nusselt.experiments.verdict.level import Level
from nusselt.experiments.verdict.rules import MEAN
from nusselt.experiments.verdict.rules.residual import ROOT_MARGIN, Residual
from nusselt.experiments.verdict.side import Seen
from nusselt.renderer.vectors import Bools

from .arbiter import Contestant

RESIDUAL = Residual()
LIGHTS = 1e-3
"""Relative difference of the lights' own radiance, which has no noise, that single precision does not bring."""


@dataclass(frozen=True)
class Difference:
    """The first of two less the second, relative to the second's mean; what the methods allow is in ``margin``.

    Parameters
    ----------
    word, reason
        As in a verdict.
    bias, standard_error : float
    interval : (float, float)
    z : float
        The bias in standard errors, methods' slack included.
    rms : float
        Pixel by pixel, without noise.
    finds : float
        The smallest bias that would have been called ``differs`` with 99 % power.
    margin : float
        Of the mean: what was declared, and what the methods may be off by.
    """

    word: Word
    reason: str
    bias: float
    standard_error: float
    interval: tuple[float, float]
    z: float
    rms: float
    rms_interval: tuple[float, float]
    finds: float
    margin: float

    def turned(self) -> Difference:
        """The second less the first."""
        low, high = self.interval
        return replace(self, bias=-self.bias, interval=(-high, -low), z=-self.z)


def difference(a: Contestant, b: Contestant, shaded: Bools, margin: float, level: Level) -> Difference:
    """Compare two; those without noise are allowed a row of their points where the verdict depends on it.

    Parameters
    ----------
    margin : float
        Relative bias declared not to matter.
    level : Level
        False-alarm rate, with as many rows as there are comparisons.
    """
    found = _difference(a, b, shaded, margin, level)
    if found.word != "differs" or not (a.row or b.row):
        return found
    return _difference(a.widened(), b.widened(), shaded, margin, level)


def _difference(a: Contestant, b: Contestant, shaded: Bools, margin: float, level: Level) -> Difference:
    nothing = np.zeros((1, a.side.mean.shape[-1]))
    allowed = margin + a.bias_slack + b.bias_slack
    seen = (Seen(a.side.mean, nothing, nothing), Seen(b.side.mean, nothing, nothing))
    evidence = Evidence(
        a.side, b.side, shaded.shape, np.flatnonzero(shaded), seen, np.zeros(shaded.size, dtype=bool), allowed
    )
    mean = MEAN(evidence, level.of(MEAN))
    by_pixel = replace(evidence, margin=margin + (a.rms_slack + b.rms_slack) / ROOT_MARGIN)
    residual = RESIDUAL(by_pixel, level.of(RESIDUAL))
    word, reason, _ = decide([mean, residual])
    lights = _lights(a, b)
    if lights:
        word, reason = "differs", "; ".join(filter(None, (reason if word == "differs" else "", lights)))
    figures: dict[str, Any] = mean.figures | residual.figures
    error, bias = float(figures["bias_relative_standard_error"][0]), float(figures["bias_relative"][0])
    unsure = float(np.hypot(error, a.bias_slack + b.bias_slack))
    return Difference(
        word,
        reason,
        bias,
        error,
        _pair(figures["bias_interval"]),
        bias / unsure if unsure else 0.0,
        float(figures["rms_denoised_relative"][0]),
        _pair(figures["rms_denoised_interval"]),
        float(figures["minimum_detectable_bias"][0]),
        allowed,
    )


def _pair(values: Any) -> tuple[float, float]:
    low, high = values[0]
    return float(low), float(high)


def _lights(a: Contestant, b: Contestant) -> str:
    """What is to be said where lights themselves are seen with another radiance."""
    size = np.abs(b.lights).max()
    if not np.isfinite(size) or not size or np.abs(a.lights - b.lights).max() <= LIGHTS * size:
        return ""
    return f"lights are seen {float(a.lights.sum() / b.lights.sum()) - 1:+.2%} off"
