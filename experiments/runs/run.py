"""Experiments one after the other, each resumed where it was left."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from rich.console import Console, RenderableType

from nusselt.experiments.console import console, say, say_command
from nusselt.experiments.files import replacing
from nusselt.experiments.results.document import document, exit_code, write_json
from nusselt.experiments.results.exports import write_exports
from nusselt.experiments.results.exports.csv_table import csv_rows
from nusselt.experiments.results.figures import footnote, save
from nusselt.experiments.results.rows import status, title, urgent_first
from nusselt.experiments.results.schema import Row
from nusselt.experiments.results.store import Store
from nusselt.experiments.results.study_tables import single, table
from nusselt.experiments.results.summary import headline
from nusselt.experiments.results.tables import NAMED, verdict_table
from nusselt.experiments.terminal.progress import progress_bar
from nusselt.experiments.verdict.level import Level
from nusselt.experiments.workers import worker_pool
from nusselt.renderer.errors import InputError
from nusselt.renderer.words import count

from .experiment import Experiment, Outcome, Settings
from .runner import run_jobs

JOBS = "jobs"
"""Folder of the finished jobs."""
OBJECTIONS = {"failing": "is not as claimed", "undecided": "is undecided"}
"""What is said of a row without a verdict, by its status."""


@dataclass(frozen=True)
class Request:
    """What was asked, and where to put it.

    Parameters
    ----------
    settings : Settings
    out : Path or None
        Folder of figures, tables and finished jobs; None: none are written.
    target : str or None
        File of the results, "-" for standard output.
    cluster : str or None
        Address of a Dask scheduler, where jobs go that need not be alone.
    csv, junit, summary : str or None
        Files for other programs.
    """

    settings: Settings
    out: Path | None = None
    target: str | None = None
    cluster: str | None = None
    csv: Path | None = None
    junit: Path | None = None
    summary: Path | None = None

    @property
    def results(self) -> str | None:
        """Where the results go."""
        return self.target or (str(self.out / "results.json") if self.out else None)

    def save(self, rows: Sequence[Row], **head: Any) -> None:
        """Write the results so far, if they go anywhere."""
        found = document(list(rows), seed=self.settings.seed, quick=self.settings.quick, **head)
        if self.results:
            write_json(found, self.results)
        write_exports(found, vars(self))


def chosen(names: Sequence[str], experiments: Sequence[Experiment]) -> list[Experiment]:
    """Experiments by name, in the order asked for, each once.

    Raises
    ------
    InputError
        If there is none of a name.
    """
    known = {experiment.name: experiment for experiment in experiments}
    for name in names:
        if name != "all" and name not in known:
            raise InputError("experiment", name, "all, or one of " + ", ".join(known))
    if "all" in names:
        return list(experiments)
    return [known[name] for name in dict.fromkeys(names)]


def again(experiment: Experiment, settings: Settings) -> str:
    """The command that makes an experiment's rows again."""
    words = ["nusselt", "run", experiment.name, *(["--quick"] if settings.quick else [])]
    words += ["--long"] if settings.long else []
    words += ["--seed", str(settings.seed)] if settings.seed else []
    for scene in settings.scenes if experiment.scenes else ():
        words += ["--scenes", scene]
    words += settings.own.words
    return shlex.join(words)


def run_one(
    experiment: Experiment,
    request: Request,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[list[Row], list[Outcome]]:
    """Rows of one experiment, and its figures and table if there is a folder for them."""
    settings, out = request.settings, request.out
    store = Store(out / JOBS if out else None)
    outcomes = run_jobs(experiment.jobs(settings), store, executor, progress)
    head = {"experiment": experiment.name}
    tail = {"seed": settings.seed, "command": again(experiment, settings)}
    rows = [head | row | tail for outcome in outcomes for row in outcome.rows]
    if out and rows:
        folder = out / experiment.name
        texts = {"rows.csv": csv_rows(single(rows))}
        texts |= {"rows.md": experiment.text(rows)} if experiment.text else {}
        texts |= experiment.files(rows) if experiment.files else {}
        for name, words in texts.items():
            with replacing(folder / name) as beside:
                beside.write_text(words, encoding="utf-8", newline="")
        for name, figure in experiment.figures(outcomes).items():
            footnote(figure, f"seed {settings.seed}: {tail['command']}")
            save(figure, folder, name)
    return rows, outcomes


def run_experiments(experiments: Sequence[Experiment], request: Request) -> int:
    """Run experiments; returns the exit status. No rows are a failure."""
    told = console(stderr=request.target == "-")
    files = replace(request, target=None if request.target == "-" else request.target)
    rows: list[Row] = []
    empty: list[str] = []
    with worker_pool(request.cluster) as pool:
        for experiment in experiments:
            if request.settings.scenes and not experiment.scenes:
                say(told, f"{experiment.name}: makes its own scenes; those named are not used")
            with progress_bar(experiment.name) as report:
                found, _ = run_one(experiment, request, pool, lambda done, total: report("jobs", done, total))
            rows += found
            files.save(rows)
            told.print(_table(found, experiment, told.width))
            _object(found, told)
            if not found:
                empty.append(experiment.name)
    if request.target == "-":
        request.save(rows)
    for name in empty:
        say(told, f"{name}: no row, which is a failure")
    say(told, headline(rows)[1])
    return exit_code([] if empty else rows)


def _object(rows: list[Row], told: Console) -> None:
    """The rows of an experiment that are not as claimed, or undecided: why, and the command that makes them again."""
    found = [row for row in urgent_first(rows) if status(row) in OBJECTIONS]
    for row in found[:NAMED]:
        why = f": {row['reason']}" if row.get("reason") else ""
        say(told, f"{title(row)} {row.get('verdict') or OBJECTIONS[status(row)]}{why}")
    if len(found) > NAMED:
        say(told, f"and {count(len(found) - NAMED, 'further row')}")
    if found:
        say_command(told, f"  again: {found[0]['command']}")


def _table(rows: list[Row], experiment: Experiment, width: int) -> RenderableType:
    """As the experiment wants it; else verdicts as `nusselt check` shows them, and other rows as they are."""
    if experiment.table:
        found: RenderableType = experiment.table(rows, width)
        return found
    if rows and all("bias_interval" in row for row in rows):
        return verdict_table(rows, Level().alpha, width)
    return table(rows, f"{experiment.name}: {experiment.summary}", width)
