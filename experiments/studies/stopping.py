"""How many samples a decision takes where it may be looked for at any time, and where they are doubled at each look."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from nusselt.experiments.check.sequential import LOOKS, time_of
from nusselt.experiments.verdict.level import Level
from nusselt.experiments.verdict.rules import MEAN
from nusselt.renderer.vectors import Floats

ALPHA = 1e-3
ERRORS = (0.125, 0.5, 2.0)
"""Standard errors of the first look, in margins: a check's own first look has an eighth."""
BIASES = (0.0, 3.0)
"""True biases, in margins."""
DOUBLINGS = 20
SURE = 1e-6
"""How often more rows are decided wrongly by chance than the level says."""


@dataclass(frozen=True)
class Looking:
    """When it is looked, in samples of the first look, and at what level."""

    times: tuple[float, ...]
    level_at: Callable[[int], float]


def _at_any_time(number: int) -> float:
    return Level(ALPHA).at_time(time_of(number)).of(MEAN)


def _doubling(number: int) -> float:
    """The share alpha/(k (k+1)) of look k."""
    return Level(ALPHA).of(MEAN) / (number * (number + 1))


AT_ANY_TIME = Looking(tuple(time_of(k) for k in range(1, LOOKS + 1)), _at_any_time)
DOUBLING = Looking(tuple(2.0 ** (k - 1) for k in range(1, DOUBLINGS + 1)), _doubling)


def times_to_decide(
    looking: Looking, bias: float, error: float, rng: np.random.Generator, rows: int
) -> tuple[Floats, int]:
    """When each row's interval lies inside the margin or outside, and how many rows lie on the wrong side of it.

    Returns
    -------
    times : (rows,) float64
        Samples, in those of the first look.
    wrong : int
    """
    times = np.array(looking.times)
    steps = rng.standard_normal((rows, times.size)) * np.sqrt(np.diff(times, prepend=0.0))
    middle = bias + error * steps.cumsum(axis=1) / times
    half = np.array([stats.norm.isf(looking.level_at(k) / 2) for k in range(1, times.size + 1)]) * error / times**0.5
    inside, outside = np.abs(middle) + half < 1, np.abs(middle) - half > 1
    decided = inside | outside
    first = decided.argmax(axis=1)
    wrong = (outside if abs(bias) < 1 else inside)[np.arange(rows), first]
    return np.where(decided.any(axis=1), times[first], times[-1]), int(wrong.sum())


def stopping_rows(rows: int, seed: int) -> list[dict[str, Any]]:
    """For a right and a wrong image, and first looks of several errors: the mean number of samples, both ways."""
    made = []
    for bias in BIASES:
        for error in ERRORS:
            rng = np.random.default_rng(seed)
            (now, wrong), (before, _) = (
                times_to_decide(way, bias, error, rng, rows) for way in (AT_ANY_TIME, DOUBLING)
            )
            case = f"samples to decide: bias {bias:g} margins, first error {error:g}"
            times = {"times": float(now.mean()), "times_doubling": float(before.mean())}
            claimed = wrong <= stats.binom.isf(SURE, rows, ALPHA)
            made.append(
                {"case": case, "level": ALPHA, "reports": rows, "hits": wrong, **times, "as_claimed": bool(claimed)}
            )
    return made
