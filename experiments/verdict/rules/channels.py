"""Is each channel right? The pooled mean averages them, and cannot see two of them swapped."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nusselt.experiments.verdict.evidence import ROUNDING, TILE_MARGIN, Evidence
from nusselt.experiments.verdict.intervals import average, freedom_of
from nusselt.experiments.verdict.quantiles import student_quantile
from nusselt.experiments.verdict.rule import Finding
from nusselt.renderer.vectors import Floats

NAMES = ("red", "green", "blue")


@dataclass(frozen=True)
class Channels:
    """Fails where a channel's bias is further than the margin from that of the channels' average.

    Channels share their samples, in an unknown measure: the error of the difference is at most the sum of both. One
    channel has at most as many times their average's grain (see `Bias.half_width`) as there are channels.
    """

    name: str = "channels"
    share: float = 1.0

    def __call__(self, evidence: Evidence, level: float) -> Finding:
        step = average(evidence.ours.mean - evidence.reference.mean)
        bias = np.abs(step - step.mean(axis=1, keepdims=True))
        ours, reference = evidence.ours, evidence.reference
        error, freedom = _error_of_mean(ours.variance, reference.variance, evidence)
        grey_error, grey_freedom = _error_of_mean(ours.grey_variance, reference.grey_variance, evidence)
        freedom = np.minimum(freedom.min(axis=1), grey_freedom)
        share = 1 / max(ours.grey.shape[-1], 1)
        unseen = math.log(2 * bias.shape[1] / level) * (ours.grain_of(share) ** 2 + reference.grain_of(share) ** 2)
        error, grey_error = np.sqrt(error**2 + bias.shape[1] ** 2 * unseen), np.sqrt(grey_error**2 + unseen)
        quantile = student_quantile(level / 2 / bias.shape[1], freedom)[:, None]
        margin = (TILE_MARGIN * evidence.margin + ROUNDING) * evidence.scale[:, None]
        off = bias > quantile * (error + grey_error[:, None]) + margin
        return Finding(
            off.any(axis=1),
            lambda k: "; ".join(
                f"{NAMES[c]} is off by {bias[k, c]:.3g} beyond the average of the channels"
                for c in np.flatnonzero(off[k])
            ),
        )


def _error_of_mean(ours: Floats, theirs: Floats, evidence: Evidence) -> tuple[Floats, Floats]:
    """Standard error of the mean over pixels, and its degrees of freedom, from both sides' variances (..., n).

    Pixels that share their light points do so in an unknown measure: then the deviation of our sum is at most the
    sum of the deviations, and all of them may be known from one set of passes.
    """
    freedom, count = freedom_of(ours + theirs), max(ours.shape[-1], 1)
    if not evidence.shares_points:
        return np.sqrt((ours + theirs).sum(axis=-1)) / count, freedom
    shared = np.sqrt(ours).sum(axis=-1) ** 2
    passes = evidence.ours.passes.shape[-1]
    return np.sqrt(shared + theirs.sum(axis=-1)) / count, np.minimum(freedom, max(passes - 1, 1))
