"""`nusselt compare`: what changed between two runs beyond their noise, at one family-wise level.

Rows are paired by what they are of, not by seed. Figures with a standard error are tested by Welch's t, all of
them together by Holm's method; figures without noise must not move. Time is told and never judged.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from nusselt.experiments.verdict.intervals import Bias, welch
from nusselt.renderer.errors import InputError
from nusselt.renderer.words import count

from .document import read_json
from .rows import number, title
from .schema import Row
from .status import EXIT
from .work_precision import seconds_of

IDENTITY = ("experiment", "scene", "estimator", "method", "renderer", "case", "defect", "samples", "stratified")
"""What makes two rows the same question."""
POWER = 0.99


@dataclass(frozen=True)
class Figure:
    """A figure with noise.

    Parameters
    ----------
    name, words : str
        In `results.json`, and for people. ``name_standard_error`` and ``name_freedom`` stand beside it there.
    worse : callable
        Whether going from one value to another is for the worse.
    """

    name: str
    words: str
    worse: Callable[[float, float], bool]


def _grows(before: float, after: float) -> bool:
    return after > before


FIGURES = (
    Figure("bias_relative", "bias", lambda before, after: abs(after) > abs(before)),
    Figure("variance", "variance", _grows),
    Figure("mse_relative", "mean square error", _grows),
    Figure("slope", "slope", _grows),
)
RELATIVE = "relative_error"
EXACT = (("non_finite", "pixels that are not finite", 1.0), (RELATIVE, "relative error", 2.0))
"""Figures without noise, and the factor by which rounding may move them."""


@dataclass(frozen=True)
class Change:
    """One figure of one row that moved; ``p`` is None where there is no noise to hide in."""

    row: str
    figure: str
    before: Any
    after: Any
    worse: bool
    p: float | None = None

    def __str__(self) -> str:
        chance = "" if self.p is None else f" (chance of this in noise: {self.p:.1g})"
        word = "worse" if self.worse else "better"
        return f"{self.row}: {self.figure}: {_told(self.before)} to {_told(self.after)}, {word}{chance}"


def _told(value: Any) -> str:
    return f"{value:.5g}" if isinstance(value, float) else str(value)


@dataclass(frozen=True)
class Comparison:
    """What `compare` found.

    Parameters
    ----------
    changes : tuple of Change
    missing, new : tuple of str
        Rows of the baseline alone, and of the results alone.
    rows, tests : int
        Rows on both sides, and noisy figures tested there.
    untested : int
        Rows on both sides of which nothing but the verdict could be compared.
    alpha : float
        The chance that anything noisy is named although nothing changed.
    detectable : float or None
        The change of variance that half of the noisy rows would show, relative, with 99 % power.
    times : tuple of (str, float)
        Seconds an image, new over old; told, never judged.
    """

    changes: tuple[Change, ...]
    missing: tuple[str, ...]
    new: tuple[str, ...]
    rows: int
    tests: int
    untested: int
    alpha: float
    detectable: float | None
    times: tuple[tuple[str, float], ...]

    @property
    def status(self) -> int:
        """1 where something is worse or no longer measured, 3 where nothing could be tested."""
        worse = bool(self.missing) or any(change.worse for change in self.changes)
        return EXIT["not as claimed" if worse else "undecided" if self.untested == self.rows else "as claimed"]

    def lines(self) -> list[str]:
        """All of it in plain words."""
        told = [str(change) for change in self.changes]
        told += [f"{name}: no longer there, worse" for name in self.missing]
        told += [f"{name}: new" for name in self.new]
        if self.untested == self.rows:
            told.append("Nothing could be tested: no row of both files has a figure with its noise.")
        elif self.untested:
            told.append(f"{count(self.untested, 'row')} could not be tested: no figure with its noise.")
        if not (self.changes or self.missing or self.untested == self.rows):
            told.append("Nothing changed beyond noise.")
        told.append(
            f"{count(self.rows, 'row')}, {count(self.tests, 'noisy figure')}, family-wise level {self.alpha:g}."
        )
        if self.detectable is not None:
            told.append(f"Half of the noisy rows would show a change of variance of {self.detectable:.1%}.")
        if self.times:
            ratios = [ratio for _, ratio in self.times]
            spread = f"{min(ratios):.2f} to {max(ratios):.2f}"
            told.append(f"Time, never judged: {np.median(ratios):.2f} times the baseline's (median; {spread}).")
        return told

    def _repr_html_(self) -> str:
        from markupsafe import escape

        return "<ul>" + "".join(f"<li>{escape(line)}</li>" for line in self.lines()) + "</ul>"


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


def moved(figure: Figure, before: Row, after: Row) -> tuple[Bias, float] | None:
    """By how much a figure moved, and the chance of that in noise; None if it is missing on a side."""
    old, new = number(before.get(figure.name)), number(after.get(figure.name))
    errors = [number(row.get(f"{figure.name}_standard_error")) for row in (before, after)]
    if old is None or new is None or errors[0] is None or errors[1] is None:
        return None
    freedoms = [number(row.get(f"{figure.name}_freedom")) or 1e9 for row in (before, after)]
    sides = zip(np.array(errors, dtype=float) ** 2, np.array(freedoms), strict=True)
    step = welch(np.asarray(new - old), *sides)
    if step.standard_error == 0:
        return step, 1.0 if math.isclose(old, new, rel_tol=1e-6, abs_tol=1e-300) else 0.0
    return step, float(2 * stats.t.sf(abs(step.value) / step.standard_error, step.freedom))


def holm(p: list[float], alpha: float) -> list[bool]:
    """Which are rejected so that any false one is at most ``alpha`` likely (Holm 1979)."""
    rejected = [False] * len(p)
    for rank, index in enumerate(sorted(range(len(p)), key=p.__getitem__)):
        if p[index] > alpha / (len(p) - rank):
            break
        rejected[index] = True
    return rejected


def _exact_changes(name: str, before: Row, after: Row) -> Iterator[Change]:
    if before.get("as_claimed") is True and after.get("as_claimed") is not True:
        yield Change(name, "as claimed", True, after.get("as_claimed"), True)
    elif before.get("as_claimed") is False and after.get("as_claimed") is True:
        yield Change(name, "as claimed", False, True, False)
    for figure, words, factor in EXACT:
        old, new = number(before.get(figure)), number(after.get(figure))
        if old is not None and new is None:
            yield Change(name, words, old, None, True)
        elif old is not None and new is not None and not old / factor <= new <= old * factor:
            yield Change(name, words, old, new, new > old)


def compare_rows(baseline: list[Row], results: list[Row], alpha: float = 1e-3) -> Comparison:
    """Compare the rows of two runs.

    Parameters
    ----------
    baseline, results : list of dict
    alpha : float
        Family-wise: the chance that anything noisy is named although nothing changed.
    """
    old, new = by_identity(baseline), by_identity(results)
    both = [key for key in old if key in new]
    exact: list[Change] = []
    noisy: list[tuple[Change, float]] = []
    untested = 0
    for key in both:
        name, tested = title(old[key]), len(noisy)
        exact += _exact_changes(name, old[key], new[key])
        for figure in FIGURES:
            found = moved(figure, old[key], new[key])
            if found:
                (step, p), before, after = found, old[key][figure.name], new[key][figure.name]
                change = Change(name, figure.words, before, after, figure.worse(before, after), p)
                noisy.append((change, float(step.standard_error)))
        alone = number(old[key].get(RELATIVE)) is not None and number(new[key].get(RELATIVE)) is not None
        untested += len(noisy) == tested and not alone
    named = holm([change.p or 0.0 for change, _ in noisy], alpha)
    return Comparison(
        changes=(*exact, *(change for (change, _), is_named in zip(noisy, named, strict=True) if is_named)),
        missing=tuple(title(row) for key, row in old.items() if key not in new),
        new=tuple(title(row) for key, row in new.items() if key not in old),
        rows=len(both),
        tests=len(noisy),
        untested=untested,
        alpha=alpha,
        detectable=_detectable(noisy, alpha),
        times=tuple(_times(old[key], new[key]) for key in both if seconds_of(old[key]) and seconds_of(new[key])),
    )


def _detectable(noisy: list[tuple[Change, float]], alpha: float) -> float | None:
    sigmas = float(stats.norm.isf(alpha / 2 / max(len(noisy), 1)) + stats.norm.isf(1 - POWER))
    shares = [sigmas * error / c.before for c, error in noisy if c.figure == "variance" and c.before and error > 0]
    return float(np.median(shares)) if shares else None


def _times(before: Row, after: Row) -> tuple[str, float]:
    return title(before), (seconds_of(after) or math.nan) / (seconds_of(before) or math.nan)


def compare(baseline: str | Path, results: str | Path, alpha: float = 1e-3) -> Comparison:
    """Compare two results files.

    Raises
    ------
    InputError
        If one cannot be read, or has no rows.
    """
    if not 0 < alpha <= 0.5:
        raise InputError("alpha", alpha, "a number above 0, at most 0.5")
    documents = [read_json(Path(path)) for path in (baseline, results)]
    for path, document in zip((baseline, results), documents, strict=True):
        if not document["rows"]:
            raise InputError("results", str(path), "a file with rows: nothing was measured here")
    return compare_rows(documents[0]["rows"], documents[1]["rows"], alpha)
