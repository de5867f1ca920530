"""Results as tables in a terminal."""

from __future__ import annotations

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from .columns import COLUMNS, Column
from .schema import Row

COLOURS = {"agrees": "green", "differs": "red", "undecided": "yellow"}
WIDE = 140
"""Columns from which everything is shown; what is not a terminal has them."""


def console(stderr: bool = False) -> Console:
    """A console as wide as its terminal, or wide enough for every column where it is none."""
    found = Console(stderr=stderr, highlight=False)
    return found if found.is_terminal else Console(stderr=stderr, highlight=False, width=WIDE)


def _fixed(value: float, digits: int) -> str:
    """Without a sign before zeros."""
    return f"{round(value, digits) + 0.0:.{digits}f}"


def _cell(column: Column, row: Row) -> str:
    shown = escape(column.shown(row, unit="").replace("−", "-"))  # plain, for terminals that know no other
    if column.name != "verdict":
        return shown
    mark = " [red]not as claimed[/]" if row["as_claimed"] is False else ""
    return f"[{COLOURS[row['verdict']]}]{shown}[/]{mark}"


def _further(row: Row) -> tuple[str, str, str]:
    """The course's scores, what a right image gets, and seconds."""
    stages = ("pilot", "ours", "reference", "expectations")
    seconds = f"{sum(value for key, value in row['seconds'].items() if key in stages):.1f}"
    if row["course_expected"] is None:
        return "", "", seconds
    low, high = row["course_expected"]["mse"]
    scores = f"{_fixed(row['course_bias'], 1)} / {_fixed(row['course_mse'], 2)}"
    return scores, f"{low:.2f} to {high:.2f}", seconds


def verdict_table(rows: list[Row], alpha: float, width: int) -> Table:
    """One line a row: what was asked, the bias and how sure, the noise, the course's scores."""
    wide = width >= WIDE
    table = Table(
        box=box.SIMPLE,
        title="Ours against Mitsuba's direct integrator",
        caption="Bias and RMS in % of the reference's mean over shaded pixels; "
        f"false-alarm rate {alpha:g} for the whole table. "
        "finds: the smallest bias found with 99 % power. course: bias / variance in 8-bit levels.",
    )
    shown = [column for column in COLUMNS if wide or column.name not in ("estimator", "RMS")]
    for column in shown:
        name, justify = (f"{column.name} %", "right") if column.number else (column.name, "left")
        # A name that is too long for the terminal goes on below: cut off, it would be no name.
        table.add_column(name, justify=justify, no_wrap=column.number, overflow="fold")  # type: ignore[arg-type]
    for name in ("course", "expected", "seconds") if wide else ():
        table.add_column(name, justify="right", no_wrap=True)
    for row in rows:
        table.add_row(*(_cell(column, row) for column in shown), *(_further(row) if wide else ()))
    return table


def left_out_table(rows: list[Row]) -> Table:
    """What each scene did not need, and why."""
    table = Table(box=box.SIMPLE, title="Left out, because the scene does not need it")
    for name in ("scene", "what", "why"):
        table.add_column(name)
    for row in rows:
        for number, entry in enumerate(row["left_out"]):
            table.add_row("" if number else escape(row["scene"]), escape(entry["what"]), escape(entry["why"]))
    return table
