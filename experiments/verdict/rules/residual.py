"""Is the limit right pixel by pixel? The root mean square of the difference, both sides' noise taken out."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nusselt.experiments.verdict.evidence import ROUNDING, Evidence
from nusselt.experiments.verdict.intervals import average, resting_on
from nusselt.experiments.verdict.quantiles import student_quantile
from nusselt.experiments.verdict.rule import Finding
from nusselt.experiments.verdict.side import Side
from nusselt.renderer.vectors import Floats

from .mean import POWER

ROOT_MARGIN = 2
"""The residual's margin, in margins of the pooled mean."""


@dataclass(frozen=True)
class Residual:
    """Fails where the residual's interval lies beyond its margin and what the reference's own shadow rays bring.

    The squares' noise is estimated from the squares: the largest of them, as a grain (see `Bias.half_width`), keeps a
    few wild ones from deciding. What no pass saw is allowed too: of samples that were all missed there are at most
    ln(2/level), of a grain each, and a pixel is no darker for it than by the most that any is. Where pixels share their
    light points their noise is not known to cancel.
    """

    name: str = "residual"
    share: float = 1.0

    def __call__(self, evidence: Evidence, level: float) -> Finding:
        ours, theirs = evidence.ours, evidence.reference  # by channels: a grey image may be right on average
        square = ((ours.mean - theirs.mean) ** 2 - ours.variance - theirs.variance).mean(axis=1)
        count = max(square.shape[-1], 1)
        mean, scale = average(square), evidence.scale
        spread = square**2 / count**2  # not about their mean: of one pixel that would be nothing
        error = np.sqrt(spread.sum(axis=-1) + math.log(2 / level) * spread.max(axis=-1, initial=0.0))
        freedom = 2 * resting_on(spread)
        reach = student_quantile(level / 2, freedom) * error
        own = float(average(np.broadcast_to(evidence.offset, (count,)) ** 2)) if square.size else 0.0
        unseen = math.log(2 / level) * (_missed(ours, theirs) + _missed(theirs, ours))
        allowed = ((ROOT_MARGIN * evidence.margin + ROUNDING) * scale) ** 2 + 3 * own + unseen
        fails = (mean - reach > allowed) & (not evidence.shares_points)
        interval = np.stack((_root(mean - reach), _root(mean + reach)), axis=-1) / scale[:, None]
        figures = {
            "rms_denoised_relative": _root(mean) / scale,
            "rms_denoised_interval": interval,
            "finds_rms": _root(allowed + reach + student_quantile(1 - POWER, freedom) * error) / scale,
        }
        return Finding(
            fails,
            lambda k: (
                f"pixels are off by {figures['rms_denoised_relative'][k]:.2%} (RMS) beyond noise" if fails[k] else ""
            ),
            figures=figures,
        )


def _missed(side: Side, other: Side) -> Floats:
    """What one sample that a side has missed brings to the mean square, at most, (b,)."""
    darker = np.maximum(other.mean - side.mean, 0.0).max(axis=(1, 2), initial=0.0)
    return np.asarray(darker * side.grain_of(1 / max(side.mean.shape[-1], 1)))


def _root(values: Floats) -> Floats:
    return np.asarray(np.sqrt(np.maximum(values, 0.0)))
