"""Progress with the time left, and a line that says beforehand what will take long."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from nusselt.experiments.console import say

ERRORS = Console(stderr=True, highlight=False)
Report = Callable[[str, int, int], None]
LONG = 10.0
"""Seconds of work that are announced."""
LESS = "twice the margin takes a quarter of it, half the pixels half of it"
KNOWN = 1 / 20
"""Share of the work after which its rate is known: a renderer's first images may be all start-up."""
SHORTER = {
    "reference": f"{LESS}, and one that --cache has kept takes none",
    "ours": LESS,
    "renderer": "one --steps less takes a quarter of it, half the pixels half of it",
}
"""What is announced, by its stage, and what would take less."""


@dataclass
class Forecast:
    """What a stage will take, from the rate at which its last part was done.

    Parameters
    ----------
    clock : callable
        Seconds from any beginning.
    """

    clock: Callable[[], float] = time.monotonic
    _last: dict[str, tuple[float, int]] = field(default_factory=dict)
    _told: set[str] = field(default_factory=set)

    def __call__(self, stage: str, done: int, total: int) -> str | None:
        """A sentence, once a stage, where `LONG` or more is left when its rate is first known."""
        if stage not in SHORTER or stage in self._told:
            return None
        now = self.clock()
        before, last = self._last.get(stage, (now, done))
        if done > last or stage not in self._last:
            self._last[stage] = now, done
        if done <= max(last, KNOWN * total):
            return None
        self._told.add(stage)
        left = (now - before) / (done - last) * (total - done)
        return f"{stage} will take about {_spoken(left)} more: {SHORTER[stage]}" if left >= LONG else None


def _spoken(seconds: float) -> str:
    for unit, size in (("h", 3600), ("min", 60)):
        if seconds >= 2 * size:
            return f"{seconds / size:.0f} {unit}"
    return f"{seconds:.0f} s"


@contextmanager
def progress_bar(title: str) -> Iterator[Report]:
    """Progress with the time left, on a terminal only; what will take long is said in any case."""
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        console=ERRORS,
        transient=True,
        disable=not ERRORS.is_terminal,
    )
    forecast = Forecast()
    with bar:
        task = bar.add_task(title)

        def report(stage: str, done: int, total: int) -> None:
            bar.update(task, description=f"{title}: {stage}", completed=done, total=total)
            if line := forecast(stage, done, total):
                say(bar.console, f"{title}: {line}")

        yield report
