"""A row's figures over many runs, and the runs in which they changed.

The largest step of a figure is looked for (the mean of all runs before against that of all from there on, each weighed
by its noise); if it is beyond noise, both sides are searched in the same way.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from nusselt.experiments.results.rows import title
from nusselt.experiments.results.schema import Row
from nusselt.experiments.results.status import EXIT
from nusselt.experiments.verdict.intervals import Bias
from nusselt.renderer.words import count

from .change import Change, step_in_words
from .figures import FIGURES, Figure, by_identity, chance, value_of

BARS = "▁▂▃▄▅▆▇█"


@dataclass(frozen=True)
class Series:
    """A figure of a row over the runs that have it.

    Parameters
    ----------
    row : str
    figure : Figure
    runs : tuple of int
    values, errors, freedoms : tuple of float
    command : str
    """

    row: str
    figure: Figure
    runs: tuple[int, ...]
    values: tuple[float, ...]
    errors: tuple[float, ...]
    freedoms: tuple[float, ...]
    command: str

    def drawn(self, runs: int) -> str:
        """A bar a run, from the smallest value to the largest; a space where a run has none."""
        low, span = min(self.values), max(self.values) - min(self.values)
        bars = [" "] * runs
        for run, value in zip(self.runs, self.values, strict=True):
            bars[run] = BARS[round((len(BARS) - 1) * (value - low) / span)] if span > 0 else BARS[0]
        return "".join(bars)

    def steps(self, level: float) -> Iterator[tuple[int, Change]]:
        """Runs in which it changed, and how; any false one is at most ``level`` likely."""
        yield from self._within(0, len(self.values), level / max(len(self.values) - 1, 1))

    def _within(self, first: int, end: int, level: float) -> Iterator[tuple[int, Change]]:
        cuts = [self._cut(first, middle, end) for middle in range(first + 1, end)]
        if not cuts:
            return
        p, _, middle, step, before, after = min(cuts, key=lambda cut: cut[:2])
        if p > level:
            return
        yield from self._within(first, middle, level)
        worse = self.figure.worse(before, after)
        words = step_in_words(self.figure, before, after, step, level)
        yield self.runs[middle], Change(self.row, self.figure.words, before, after, worse, p, words, self.command)
        yield from self._within(middle, end, level)

    def _cut(self, first: int, middle: int, end: int) -> tuple[float, float, int, Bias, float, float]:
        (before, old), (after, new) = self._mean(first, middle), self._mean(middle, end)
        error = np.hypot(old, new)
        # The freedom of the least sure run: never more than there is.
        step = Bias(np.asarray(after - before), np.asarray(error), np.asarray(min(self.freedoms[first:end])))
        p = chance(step, before, after)
        return p, -abs(float(step.value)) / (error or 1.0), middle, step, before, after

    def _mean(self, first: int, end: int) -> tuple[float, float]:
        """Weighed by the noise, and its standard error; of values without noise their plain mean."""
        values, errors = np.array(self.values[first:end]), np.array(self.errors[first:end])
        if (errors == 0).any():
            return float(values.mean()), 0.0
        weights = errors**-2
        return float((weights * values).sum() / weights.sum()), float(weights.sum() ** -0.5)


@dataclass(frozen=True)
class History:
    """What `compare` finds in several runs.

    Parameters
    ----------
    runs : tuple of str
        Their files, the oldest first.
    series : tuple of Series
    steps : tuple of (str, Change)
        The run in which something changed, and what.
    alpha : float
    """

    runs: tuple[str, ...]
    series: tuple[Series, ...]
    steps: tuple[tuple[str, Change], ...]
    alpha: float

    @property
    def status(self) -> int:
        """1 where something became worse, 3 where nothing could be tested."""
        if not any(len(one.values) > 1 for one in self.series):
            return EXIT["undecided"]
        return EXIT["not as claimed" if any(change.worse for _, change in self.steps) else "as claimed"]

    def headline(self) -> str:
        """What came out, in a sentence."""
        if self.status == EXIT["undecided"]:
            return "Nothing could be tested: no figure with its noise is in two runs."
        if not self.steps:
            return "Nothing changed beyond noise."
        first = self.runs.index(self.steps[0][0])
        return f"{count(len(self.steps), 'figure')} changed, the first in run {first + 1} of {len(self.runs)}."

    def notes(self) -> list[str]:
        """What was tested."""
        return [f"{count(len(self.runs), 'run')}, {count(len(self.series), 'noisy figure')}, level {self.alpha:g}."]

    def lines(self) -> list[str]:
        """All of it in plain words: what changed where, and every series that did, drawn."""
        told = [f"{run}: {change.row}: {change}" for run, change in self.steps]
        changed = {(change.row, change.figure) for _, change in self.steps}
        drawn = [one for one in self.series if (one.row, one.figure.words) in changed]
        told += [f"{one.drawn(len(self.runs))}  {one.row}: {one.figure.words}" for one in drawn]
        return [*told, self.headline(), *self.notes()]


def history(runs: dict[str, list[Row]], alpha: float = 1e-3) -> History:
    """The rows of several runs, by their names, the oldest first.

    Parameters
    ----------
    runs : dict of str to list of dict
    alpha : float
        The chance that any change is named although there was none.
    """
    rows = [by_identity(rows) for rows in runs.values()]
    keys = list(dict.fromkeys(key for run in rows for key in run))
    series = [_series(key, figure, rows) for key in keys for figure in FIGURES]
    kept = tuple(one for one in series if one is not None)
    names = tuple(runs)
    steps = [step for one in kept for step in one.steps(alpha / max(len(kept), 1))]
    steps.sort(key=lambda step: step[0])
    return History(names, kept, tuple((names[run], change) for run, change in steps), alpha)


def _series(key: tuple[Any, ...], figure: Figure, rows: list[dict[tuple[Any, ...], Row]]) -> Series | None:
    known = [(run, value_of(figure, of[key]), of[key]) for run, of in enumerate(rows) if key in of]
    some = [(run, *value, row) for run, value, row in known if value is not None]
    if not some:
        return None
    numbers, values, errors, freedoms, of = zip(*some, strict=True)
    return Series(title(of[-1]), figure, numbers, values, errors, freedoms, str(of[-1].get("command") or ""))
