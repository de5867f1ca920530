"""Is the normal approximation earned? Where it is not, a verdict is `undecided`, with advice.

A Student t on heavy-tailed data false-fails 23.5 % of the time at a nominal 1 % (64 samples, measured). What is known
to be bounded earns it by its samples (see `intervals.Bias`). Where no bound is known, three things are looked at on
either side: how many pixels the noise rests on, how many passes there are, and the skewness and excess kurtosis of the
pass means.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.experiments.verdict.evidence import Evidence
from nusselt.experiments.verdict.intervals import resting_on
from nusselt.experiments.verdict.rule import Finding
from nusselt.experiments.verdict.side import Side
from nusselt.renderer.vectors import Bools, Floats

FEWEST = 50
"""Noise that rests on fewer pixels than this is not taken for normal: at 30, lognormal noise of 2.9 means still
false-alarmed at 1.2 times the declared rate, at 50 at a quarter of it."""
PASSES = 32
"""Fewest passes from whose spread alone a standard error is taken: a t with 7 degrees of freedom costs 24
standard errors at a report's level, 12 at 14, 8.8 at 30."""
SURE = 1e-6
"""How often normal pass means are taken for heavy-tailed or skewed."""
ALIKE = 2e-14
"""Relative spread below which values are the same but for their rounding, which has no moments to speak of."""


@dataclass(frozen=True)
class Normality:
    """Objects where the interval of a mean may not be what Student's t says; it never fails."""

    name: str = "normality"
    share: float | None = None

    def __call__(self, evidence: Evidence, level: float) -> Finding:
        objections = [o for side in (evidence.ours, evidence.reference) for o in side_objections(side)]
        return Finding(
            evidence.nowhere,
            lambda k: next((sentence for rows, sentence in objections if rows[k]), ""),
            is_doubtful(evidence),
            np.full(evidence.nowhere.shape, 2.0),
            {"excess_kurtosis": {side.name: excess_kurtosis(side) for side in (evidence.ours, evidence.reference)}},
        )


def is_doubtful(evidence: Evidence) -> Bools:
    """Rows (b,) whose difference may not be normal."""
    sides = (evidence.ours, evidence.reference)
    return np.any([rows for side in sides for rows, _ in side_objections(side)], axis=0)


def side_objections(side: Side) -> list[tuple[Bools, str]]:
    """Rows (b,) in which something speaks against a side's mean being normal, with what would help."""
    count = side.passes.shape[-1]
    few = np.asarray(side.by_passes and count < PASSES)
    objections = [(few, f"{side.name} has {count} passes, fewer than {PASSES}: more passes would decide")]
    if side.grain is None:  # no bound of what a sample may bring: only what was seen can speak
        thin = resting_on(side.grey_variance) < FEWEST
        heavy = f"the passes of {side.name} are heavy-tailed or skewed: larger passes would decide"
        little = f"the noise of {side.name} rests on fewer than {FEWEST} pixels"
        objections += [
            (thin, f"{little}: a larger image or more samples would decide"),
            (is_heavy(side.passes), heavy),
        ]
    return [(side.is_random & rows, sentence) for rows, sentence in objections]


def excess_kurtosis(side: Side) -> Floats:
    """Of the pass means, (b,); NaN below four passes or without noise."""
    flat, varied = _varied(side.passes)
    if varied.shape[-1] < 4:
        return np.full(flat.shape, np.nan)
    from scipy import stats  # a second to import, where nothing else needs it

    return np.where(flat | ~side.is_random, np.nan, stats.kurtosis(varied, axis=-1, bias=False))


def is_heavy(values: Floats) -> Bools:
    """Whether independent values (..., r) are too long-tailed or too skewed for a t interval of their mean.

    D'Agostino's and Anscombe-Glynn's tests; below 20 values neither can tell, and nothing is said.
    """
    flat, varied = _varied(values)
    if varied.shape[-1] < 20:
        return np.zeros(flat.shape, dtype=bool)
    from scipy import stats

    tail = stats.kurtosistest(varied, axis=-1, alternative="greater").pvalue
    return np.asarray(~flat & (np.minimum(tail, stats.skewtest(varied, axis=-1).pvalue) < SURE / 2))


def _varied(values: Floats) -> tuple[Bools, Floats]:
    """Which rows (..., r) are alike but for rounding; and the values, an even ramp, which no test minds, for those."""
    flat = np.asarray(np.ptp(values, axis=-1) <= ALIKE * np.abs(values).max(axis=-1))
    return flat, np.where(flat[..., None], np.linspace(-1, 1, values.shape[-1]), values)
