"""Is the mean right? The pooled bias, which decides: its interval holds the noise of both sides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.experiments.verdict.evidence import ROUNDING, Evidence
from nusselt.experiments.verdict.intervals import weighted_bias
from nusselt.experiments.verdict.rule import Finding
from nusselt.renderer.vectors import Floats

from .normality import is_doubtful

POWER = 0.99
"""With which the smallest detectable bias is found."""


@dataclass(frozen=True)
class Mean:
    """Fails where the whole interval lies outside the margin, objects where it lies across its end."""

    name: str = "mean"
    share: float = 11.0

    def __call__(self, evidence: Evidence, level: float) -> Finding:
        scale, margin = evidence.scale, evidence.margin
        bias = weighted_bias(evidence.ours, evidence.reference)
        reach = bias.half_width(level, normal=~is_doubtful(evidence)) / scale + ROUNDING
        relative = bias.value / scale
        figures = {
            "reference_mean": evidence.reference_mean,
            "bias": bias.value,
            "bias_relative": relative,
            "bias_interval": np.stack((relative - reach, relative + reach), axis=-1),
            "bias_relative_standard_error": bias.standard_error / scale,
            "bias_relative_freedom": bias.freedom,
            "minimum_detectable_bias": margin + reach + bias.reserve(POWER) / scale,
        }
        whose = "the samples" if evidence.ours.is_random.any() else "the reference's samples"
        return of_interval(relative - reach, relative + reach, margin, figures, whose)


def of_interval(
    low: Floats, high: Floats, margin: float, figures: dict[str, Floats] | None = None, whose: str = "the samples"
) -> Finding:
    """What intervals (b,) of the relative bias say; ``whose`` samples would make them shorter."""
    outside = (low > margin) | (high < -margin)
    inside = (-margin <= low) & (high <= margin)
    middle = (low + high) / 2
    right = (low <= 0) & (high >= 0)
    more = np.where(
        right,
        _shrunk(high - low, np.full(middle.shape, 2 * margin)),
        _shrunk(high - low, 2 * np.abs(margin - np.abs(middle))),
    )

    def say(k: int) -> str:
        where = f"the bias lies in [{low[k]:+.3%}, {high[k]:+.3%}]"
        if outside[k] or inside[k]:
            return f"{where}, {'outside' if outside[k] else 'inside'} the margin of {margin:.3%}"
        if np.isinf(more[k]):
            where += ", across the margin's end" if not right[k] else ", far wider than the margin"
            return f"{where} of {margin:.3%}: declare another margin"
        seen = "if it is right" if right[k] else "if it is what it seems"
        return f"{where}: {seen}, about {more[k]:.0f} times {whose} would decide"

    return Finding(outside, say, ~(outside | inside), more, figures or {})


def _shrunk(length: Floats, room: Floats) -> Floats:
    """How many times the samples bring an interval to a length; inf where no feasible number does."""
    factor = 1.3 * np.divide(length, room, out=np.full(length.shape, np.inf), where=room > 0) ** 2
    return np.where(factor <= 1e4, np.maximum(2.0, np.ceil(factor)), np.inf)
