"""What moved, in the words of one line."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from nusselt.experiments.results.rows import percent
from nusselt.experiments.verdict.intervals import Bias

from .figures import Figure


@dataclass(frozen=True)
class Change:
    """A figure of a row that moved.

    Parameters
    ----------
    row, figure : str
    before, after
        Its values.
    worse : bool
    p : float or None
        The chance of it in noise; None where there is no noise to hide in.
    words : str
        By how much, with its interval.
    command : str
        Makes the row again.
    """

    row: str
    figure: str
    before: Any
    after: Any
    worse: bool
    p: float | None = None
    words: str = ""
    command: str = ""

    def __str__(self) -> str:
        told = self.words or f"{_told(self.before)} to {_told(self.after)}"
        return f"{self.figure} {told}, {'worse' if self.worse else 'better'}"


def _told(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.5g}" if isinstance(value, float) else "nothing" if value is None else str(value)


def step_in_words(figure: Figure, before: float, after: float, step: Bias, level: float) -> str:
    """By how much a figure moved, and its interval: "+10.0 % [8.1, 12.0]", "+0.01 % to +0.21 %, by [0.17, 0.23]"."""
    half = float(step.half_width(level)) if step.standard_error > 0 else 0.0
    ends = [float(step.value) - half, float(step.value) + half]
    if figure.is_ratio and before > 0:
        share, digits = float(step.value) / before, _digits(half / before)
        return f"{percent(share, digits, True)} [{', '.join(percent(end / before, digits, unit='') for end in ends)}]"
    if figure.is_ratio or math.isclose(before, after, rel_tol=1e-12):
        return f"{before:.4g} to {after:.4g}"
    if figure.name.endswith("_relative"):
        digits = _digits(half)
        first, last = (percent(value, digits, True) for value in (before, after))
        return f"{first} to {last}, by [{', '.join(percent(end, digits, True, unit='') for end in ends)}]"
    return f"{before:+.3f} to {after:+.3f}, by [{ends[0]:+.3f}, {ends[1]:+.3f}]"


def _digits(half: float) -> int:
    """Of a percentage, so that two of its interval's half width are seen."""
    return max(1, min(6, 1 - math.floor(math.log10(100 * half)))) if half > 0 else 4
