"""What changed between two runs beyond their noise, at one family-wise level.

Rows are paired by what they are of, not by seed. Figures with a standard error are tested by Welch's t, all of
them together by Holm's method; figures without noise must not move. Time is told and never judged.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from nusselt.experiments.results.rows import number, title
from nusselt.experiments.results.schema import Row
from nusselt.experiments.results.status import EXIT
from nusselt.experiments.results.work_precision import seconds_of
from nusselt.experiments.verdict.quantiles import normal_quantile
from nusselt.renderer.words import count

from .change import Change, step_in_words
from .figures import FIGURES, by_identity, holm, moved

POWER = 0.99
RELATIVE = "relative_error"
EXACT = (("non_finite", "pixels that are not finite", 1.0), (RELATIVE, "relative error", 2.0))
"""Figures without noise, and the factor by which rounding may move them."""
SLOWER = 1.3
"""Times the baseline's time from which a row is told by its name."""


@dataclass(frozen=True)
class Comparison:
    """What `compare_rows` found.

    Parameters
    ----------
    changes : tuple of Change
    missing, new : tuple of str
        Rows of the baseline alone, and of the results alone.
    rows, tests : int
        Rows on both sides, and noisy figures tested there.
    untested : tuple of str
        Rows on both sides of which nothing but the verdict could be compared.
    alpha : float
        The chance that anything noisy is named although nothing changed.
    detectable : float or None
        The change of variance that half of the noisy rows would show, relative, with 99 % power.
    times : tuple of (str, float)
        Seconds an image, new over old; told, never judged.
    names : tuple of str
        Of the rows on both sides.
    """

    changes: tuple[Change, ...]
    missing: tuple[str, ...]
    new: tuple[str, ...]
    rows: int
    tests: int
    untested: tuple[str, ...]
    alpha: float
    detectable: float | None
    times: tuple[tuple[str, float], ...]
    names: tuple[str, ...] = ()

    @property
    def status(self) -> int:
        """1 where something is worse or no longer measured, 3 where nothing could be tested."""
        worse = bool(self.missing) or any(change.worse for change in self.changes)
        return EXIT["not as claimed" if worse else "undecided" if len(self.untested) == self.rows else "as claimed"]

    def by_row(self) -> dict[str, list[Change]]:
        """The changes, each row's together; what is worse first."""
        found: dict[str, list[Change]] = {}
        for change in sorted(self.changes, key=lambda change: not change.worse):
            found.setdefault(change.row, []).append(change)
        return found

    def headline(self) -> str:
        """What came out, in a sentence."""
        if self.rows == len(self.untested):
            return "Nothing could be tested: no row of both files has a figure with its noise."
        if not (self.changes or self.missing):
            return "Nothing changed beyond noise."
        worse = {change.row for change in self.changes if change.worse} | set(self.missing)
        better = {change.row for change in self.changes} - worse
        told = [f"{count(len(worse), 'row', 'is')} worse"] if worse else []
        return "; ".join([*told, *([f"{count(len(better), 'row', 'is')} better"] if better else [])]) + "."

    def notes(self) -> list[str]:
        """What there is to know besides: rows that came and went, what was tested, how finely, and time."""
        told = [f"{name}: new" for name in self.new]
        if self.untested and len(self.untested) < self.rows:
            told.append(f"{count(len(self.untested), 'row')} could not be tested: no figure with its noise.")
        tested = f"{count(self.rows, 'row')}, {count(self.tests, 'noisy figure')}, family-wise level {self.alpha:g}."
        told.append(tested)
        if self.detectable is not None:
            told.append(f"Half of the noisy rows would show a change of variance of {self.detectable:.1%}.")
        if self.times:
            ratios = [ratio for _, ratio in self.times]
            spread = f"{min(ratios):.2f} to {max(ratios):.2f}"
            told.append(f"Time, never judged: {np.median(ratios):.2f} times the baseline's (median; {spread}).")
            told += [f"{name} took {ratio:.2f} times as long" for name, ratio in self.times if ratio >= SLOWER]
        return told

    def lines(self) -> list[str]:
        """All of it in plain words."""
        told = []
        for row, changes in self.by_row().items():
            told.append(f"{row}: {'; '.join(map(str, changes))}")
            told += [f"  again: {changes[0].command}"] if changes[0].command else []
        told += [f"{name}: no longer there, worse" for name in self.missing]
        return [*told, self.headline(), *self.notes()]

    def _repr_html_(self) -> str:
        from markupsafe import escape

        return "<ul>" + "".join(f"<li>{escape(line)}</li>" for line in self.lines()) + "</ul>"


def _exact_changes(name: str, before: Row, after: Row) -> Iterator[Change]:
    command = str(after.get("command") or "")
    if before.get("as_claimed") is True and after.get("as_claimed") is not True:
        yield Change(name, "as claimed", True, after.get("as_claimed"), True, command=command)
    elif before.get("as_claimed") is False and after.get("as_claimed") is True:
        yield Change(name, "as claimed", False, True, False, command=command)
    for figure, words, factor in EXACT:
        old, new = number(before.get(figure)), number(after.get(figure))
        if old is not None and new is None:
            yield Change(name, words, old, None, True, command=command)
        elif old is not None and new is not None and not old / factor <= new <= old * factor:
            yield Change(name, words, old, new, new > old, command=command)


def _noisy_changes(before: Row, after: Row, level: float) -> Iterator[tuple[Change, float]]:
    """Every noisy figure of a pair of rows, and the standard error of its step."""
    for figure in FIGURES:
        found = moved(figure, before, after)
        if found:
            (step, p), old, new = found, before[figure.name], after[figure.name]
            words = step_in_words(figure, old, new, step, level)
            worse, again = figure.worse(old, new), str(after.get("command") or "")
            yield Change(title(before), figure.words, old, new, worse, p, words, again), float(step.standard_error)


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
    untested = []
    level = alpha / max(len(both) * len(FIGURES), 1)
    for key in both:
        exact += _exact_changes(title(old[key]), old[key], new[key])
        tested = list(_noisy_changes(old[key], new[key], level))
        noisy += tested
        alone = number(old[key].get(RELATIVE)) is not None and number(new[key].get(RELATIVE)) is not None
        untested += [] if tested or alone else [title(old[key])]
    named = holm([change.p or 0.0 for change, _ in noisy], alpha)
    return Comparison(
        changes=(*exact, *(change for (change, _), is_named in zip(noisy, named, strict=True) if is_named)),
        missing=tuple(title(row) for key, row in old.items() if key not in new),
        new=tuple(title(row) for key, row in new.items() if key not in old),
        rows=len(both),
        tests=len(noisy),
        untested=tuple(untested),
        alpha=alpha,
        detectable=_detectable(noisy, alpha),
        times=tuple(_times(old[key], new[key]) for key in both if seconds_of(old[key]) and seconds_of(new[key])),
        names=tuple(title(old[key]) for key in both),
    )


def _detectable(noisy: list[tuple[Change, float]], alpha: float) -> float | None:
    sigmas = normal_quantile(alpha / 2 / max(len(noisy), 1)) + normal_quantile(1 - POWER)
    shares = [sigmas * error / c.before for c, error in noisy if c.figure == "variance" and c.before and error > 0]
    return float(np.median(shares)) if shares else None


def _times(before: Row, after: Row) -> tuple[str, float]:
    return title(before), (seconds_of(after) or math.nan) / (seconds_of(before) or math.nan)
