"""`nusselt stability`: rows worst first."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import click
from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from nusselt.experiments.console import console, say
from nusselt.experiments.results.schema import Row
from nusselt.experiments.results.status import EXIT
from nusselt.experiments.runs.experiment import Settings
from nusselt.experiments.runs.run import Request, run_one
from nusselt.experiments.studies.stability.study import STABILITY, file_jobs
from nusselt.experiments.terminal.options import Output, output_options, quick_option, seed_option
from nusselt.experiments.terminal.progress import progress_bar
from nusselt.experiments.workers import worker_pool
from nusselt.renderer.words import count

COLUMNS = (
    *("name", "kind", "dtype", "form", "value", "error_bound", "oracle", "relative_error", "bound_held"),
    *("condition", "textbook_error", "mitsuba"),
)
WIDE = 110
"""Columns of a terminal from which every figure is shown."""
SHOWN = 40
"""Rows in the terminal; the files have all."""


@click.command()
@click.argument("cases", metavar="CASES.json...", nargs=-1)
@quick_option
@seed_option
@output_options
def command(*, cases: tuple[str, ...], quick: bool, seed: int, output: Output) -> None:
    """The closed forms on stiff and extreme cases, against values known to many digits.

    Without files: the project's own cases, and whole images against their scaled, moved or exact twins.

    \b
    nusselt stability --out out
    nusselt stability my-cases.json --json -
    """
    sys.exit(run_stability(cases, Request(Settings(quick, seed), **vars(output))))


def run_stability(files: Sequence[str], request: Request) -> int:
    """Run it; returns the exit status: 1 if a bound is violated, a value is not finite, or there is no row."""
    asked = replace(STABILITY, jobs=partial(file_jobs, files)) if files else STABILITY
    with worker_pool() as pool, progress_bar("stability") as report:
        found, _ = run_one(asked, request, pool, lambda done, total: report("jobs", done, total))
    rows = [{name: row[name] for name in COLUMNS} for row in found]
    request.save(rows)
    told = console(stderr=request.target == "-")
    show(rows, told)
    right = bool(rows) and all(row["bound_held"] and row["value"] is not None for row in rows)
    return EXIT["as claimed"] if right else EXIT["not as claimed"]


def badness(row: Row) -> tuple[bool, float]:
    """What is worst: a broken bound, then the largest error of what stands in double precision."""
    error = math.inf if row["relative_error"] is None else row["relative_error"]
    return not row["bound_held"], error * (1e-9 if row["dtype"] == "float32" else 1.0)


def _number(value: float | None, sign: str = "") -> str:
    return "" if value is None else "0" if value == 0 else f"{value:{sign}.1e}"


def show(rows: Sequence[Row], told: Console) -> None:
    """A table, worst first, and a sentence."""
    wide = told.width >= WIDE
    # A narrow terminal has the names whole, and what a bound is held to; the files have the rest.
    room: dict[str, Any] = {} if wide else {"padding": 0, "pad_edge": False}
    found = Table(box=box.SIMPLE, title="Closed forms and images against what they should give, worst first", **room)
    heads = ("case", "type", "form", "error", "its bound", *(("condition", "textbook", "Mitsuba") if wide else ()))
    for name in heads:
        found.add_column(name, justify="left" if name in ("case", "type", "form") else "right", no_wrap=name != "case")
    for row in sorted(rows, key=badness, reverse=True)[:SHOWN]:
        cells = (
            *(escape(row["name"]), row["dtype"], row["form"]),
            *(_number(row["relative_error"]) or "none", _number(row["error_bound"])),
            *(_number(row["condition"]), _number(row["textbook_error"]), _number(row["mitsuba"], "+")),
        )
        found.add_row(*cells[: len(heads)], style=None if row["bound_held"] else "red")
    told.print(found)
    broken = count(sum(not row["bound_held"] for row in rows), "bound")
    say(told, f"{count(len(rows), 'row')}, {min(SHOWN, len(rows))} shown; {broken} violated or values not finite")
