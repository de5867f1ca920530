"""The figures of a row that a comparison looks at, and how sure it is that one moved."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from nusselt.experiments.results.rows import number
from nusselt.experiments.results.schema import Row
from nusselt.experiments.verdict.intervals import Bias, welch
from nusselt.experiments.verdict.quantiles import student_tail

IDENTITY = ("experiment", "scene", "estimator", "method", "renderer", "case", "defect", "samples", "stratified")
"""What makes two rows the same question."""


@dataclass(frozen=True)
class Figure:
    """A figure with noise.

    Parameters
    ----------
    name, words : str
        In `results.json`, and for people. ``name_standard_error`` and ``name_freedom`` stand beside it there.
    worse : callable
        Whether going from one value to another is for the worse.
    is_ratio : bool
        Whether a change is told as a share of what it was; else as a difference, of shares in points.
    """

    name: str
    words: str
    worse: Callable[[float, float], bool]
    is_ratio: bool = True


def _grows(before: float, after: float) -> bool:
    return after > before


FIGURES = (
    Figure("bias_relative", "bias", lambda before, after: abs(after) > abs(before), is_ratio=False),
    Figure("variance", "variance", _grows),
    Figure("mse_relative", "mean square error", _grows),
    Figure("slope", "slope", _grows, is_ratio=False),
)


def value_of(figure: Figure, row: Row) -> tuple[float, float, float] | None:
    """A row's value, standard error and degrees of freedom; None where it has no noise of its own."""
    value, error = number(row.get(figure.name)), number(row.get(f"{figure.name}_standard_error"))
    if value is None or error is None:
        return None
    return value, error, number(row.get(f"{figure.name}_freedom")) or 1e9


def moved(figure: Figure, before: Row, after: Row) -> tuple[Bias, float] | None:
    """By how much a figure moved, and the chance of that in noise; None if it is missing on a side."""
    old, new = value_of(figure, before), value_of(figure, after)
    if old is None or new is None:
        return None
    step = welch(np.asarray(new[0] - old[0]), *((np.array(side[1] ** 2), np.array(side[2])) for side in (old, new)))
    return step, chance(step, old[0], new[0])


def chance(step: Bias, before: float, after: float) -> float:
    """Of so large a step, or a larger one, where nothing changed."""
    if step.standard_error == 0:
        return 1.0 if math.isclose(before, after, rel_tol=1e-6, abs_tol=1e-300) else 0.0
    return float(2 * student_tail(abs(step.value) / step.standard_error, step.freedom))


def holm(p: Sequence[float], alpha: float) -> list[bool]:
    """Which are rejected so that any false one is at most ``alpha`` likely (Holm 1979)."""
    rejected = [False] * len(p)
    for rank, index in enumerate(sorted(range(len(p)), key=p.__getitem__)):
        if p[index] > alpha / (len(p) - rank):
            break
        rejected[index] = True
    return rejected


def by_identity(rows: list[Row]) -> dict[tuple[Any, ...], Row]:
    """Rows by what they are of; equal ones are told apart by their order."""
    found: dict[tuple[Any, ...], Row] = {}
    for row in rows:
        key = tuple(str(row.get(name)) for name in IDENTITY)
        turn = 0
        while (*key, turn) in found:
            turn += 1
        found[*key, turn] = row
    return found
