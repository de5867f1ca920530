"""Is the variance right? An unbiased estimator with ten times the variance passes every test of means.

Ours is compared with what Mitsuba's `direct` has for the same strategy and number of samples, one light at a time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.experiments.verdict.evidence import Evidence
from nusselt.experiments.verdict.intervals import Ratio, average, resting_on
from nusselt.experiments.verdict.quantiles import student_quantile
from nusselt.experiments.verdict.rule import Finding
from nusselt.renderer.vectors import Floats

RESAMPLES = 400
BATCH = 10
FIGURES = ("variance_ratio", "variance_ratio_interval", "variance_off")
TINY = 1e-300
"""In place of none: a resample may miss the only noisy pixel."""


def log_ratio_error(ours: Floats, theirs: Floats) -> Floats:
    """Standard error (b,) of log(sum ours / sum theirs) by resampling pixels (b, n), both sides together.

    Bootstrap (Efron 1979), the same resamples for every row: how often each pixel is drawn, times the values, is
    one product of matrices.
    """
    rng, count = np.random.default_rng(0), ours.shape[-1]
    logs = []
    for _ in range(RESAMPLES // BATCH):
        picks = rng.integers(count, size=(BATCH, count)) + count * np.arange(BATCH)[:, None]
        times = np.bincount(picks.ravel(), minlength=BATCH * count).reshape(BATCH, count).T / count
        logs.append(np.log(np.maximum(ours @ times, TINY) / np.maximum(theirs @ times, TINY)))
    return np.asarray(np.concatenate(logs, axis=-1).std(axis=-1, ddof=1))


def variance_ratio(ours: Floats, theirs: Floats, level: float) -> Ratio:
    """Ratio of two mean variances over the same pixels (b, n); none where neither side has any.

    Each pixel's variance is itself an estimate; resampling pixels takes that in. The quantile is Student's, by
    how many pixels carry the variance.
    """
    mine, other = average(ours), average(theirs)
    value = np.divide(mine, other, out=np.where(mine > 0, np.inf, np.nan), where=other > 0)
    noisy = (mine > 0) & (other > 0)
    x, y = ours[noisy] / mine[noisy, None], theirs[noisy] / other[noisy, None]
    freedom = np.maximum(np.minimum(resting_on(x), resting_on(y)) - 1, 1.0)
    reach = np.zeros(value.shape)
    reach[noisy] = np.minimum(student_quantile(level / 2, freedom) * log_ratio_error(x, y), 600)
    return Ratio(value, value * np.exp(-reach), value * np.exp(reach))


@dataclass(frozen=True)
class VarianceRatio:
    """Fails where the whole interval of the ratio lies beyond its margin and the variance is claimed, else says so.

    Says nothing of fewer than two pixels or passes.
    """

    name: str = "variance ratio"
    share: float = 1.0

    def __call__(self, evidence: Evidence, level: float) -> Finding:
        if evidence.variance is None or min(evidence.variance.shape[-1], evidence.ours.passes.shape[-1]) < 2:
            return Finding(evidence.nowhere, lambda k: "", figures=dict.fromkeys(FIGURES))
        ratio = variance_ratio(evidence.ours.grey_variance, evidence.variance, level)
        off, claimed = ratio.fails, evidence.claims_variance

        def say(k: int) -> str:
            if claimed:
                told = f"the variance is {ratio.value[k]:.3g} times Mitsuba's for the same strategy"
            else:
                told = f"{_compared(ratio, k)}: {ratio.value[k]:.3g} times the expected variance"
                told += f" [{ratio.low[k]:.3g}, {ratio.high[k]:.3g}]"
            return told if off[k] else ""

        return Finding(off & claimed, say, figures=dict(zip(FIGURES, (ratio.value, ratio.interval, off), strict=True)))


def _compared(ratio: Ratio, k: int) -> str:
    return "noisier" if ratio.value[k] > 1 else "quieter"
