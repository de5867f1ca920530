"""Results as tables in a terminal."""

from __future__ import annotations

from collections.abc import Callable

from rich import box
from rich.markup import escape
from rich.table import Table

from nusselt.experiments.console import WIDE
from nusselt.experiments.scenes.catalogue import CLASSIC

from .columns import COLUMNS, Column
from .rows import title
from .schema import Row

COLOURS = {"agrees": "green", "differs": "red", "undecided": "yellow"}


def _fixed(value: float, digits: int) -> str:
    """Without a sign before zeros."""
    return f"{round(value, digits) + 0.0:.{digits}f}"


def _cell(column: Column, row: Row) -> str:
    shown = escape(column.shown(row, unit="").replace("−", "-"))  # plain, for terminals that know no other
    if column.name != "verdict":
        return shown
    return f"[{COLOURS[row['verdict']]}]{shown}[/]{_unexpected(row)}"


def _unexpected(row: Row) -> str:
    """What a verdict does not say by itself: a difference that the claim admits, or anything else that it does not."""
    if (row["verdict"] == "differs") is (row["as_claimed"] is False):
        return ""
    return {True: " as claimed", False: " [red]not as claimed[/]", None: ""}[row["as_claimed"]]


def _scores(row: Row) -> str:
    if row["course_expected"] is None:
        return ""
    return f"{_fixed(row['course_bias'], 1)} / {_fixed(row['course_mse'], 2)}"


def _expected_scores(row: Row) -> str:
    if row["course_expected"] is None:
        return ""
    low, high = row["course_expected"]["mse"]
    return f"{low:.2f} to {high:.2f}"


def _seconds(row: Row) -> str:
    stages = ("pilot", "ours", "reference", "expectations")
    return f"{sum(value for key, value in row['seconds'].items() if key in stages):.1f}"


def verdict_table(rows: list[Row], alpha: float, width: int) -> Table:
    """One line a row: what was asked, the bias and how sure; where there is room the noise and the time.

    Scenes of the course have its scores too.
    """
    wide = width >= WIDE
    further: dict[str, Callable[[Row], str]] = {}
    what = "Bias and RMS" if wide else "Bias"
    notes = f"{what} in % of the reference's mean over shaded pixels; false-alarm rate {alpha:g} for the whole table."
    notes += " MDB: minimum detectable bias, found with 99 % power."
    if wide and any(row["scene"] in CLASSIC for row in rows):
        further = {"course": _scores, "expected": _expected_scores}
        notes += " course: bias / variance in 8-bit levels."
    further |= {"seconds": _seconds} if wide else {}
    # No more than a space between the columns of a narrow terminal.
    room = {} if wide else {"padding": 0, "pad_edge": False}
    table = Table(box=box.SIMPLE, title="Ours against Mitsuba's direct integrator", caption=notes, **room)  # type: ignore[arg-type]
    shown = [column for column in COLUMNS if wide or column.name != "RMS"]
    for column in shown:
        name, justify = (f"{column.name} %", "right") if column.number else (column.name, "left")
        # A name that is too long for the terminal goes on below: cut off, it would be no name.
        table.add_column(name, justify=justify, no_wrap=column.number, overflow="fold")  # type: ignore[arg-type]
    for name in further:
        table.add_column(name, justify="right", no_wrap=True)
    for row in rows:
        table.add_row(*(_cell(column, row) for column in shown), *(cell(row) for cell in further.values()))
    return table


VERBS = {
    "agrees": ("agrees", "agree"),
    "differs": ("differs", "differ"),
    "undecided": ("is undecided", "are undecided"),
}
"""Of one row, and of several."""
ADMITTED = {"differs as claimed": ("differs as claimed", "differ as claimed")}
"""The same of what claims no more."""
NAMED = 6
"""Rows of a kind that are named, at most; of further ones the number is."""


def closing(rows: list[Row]) -> str:
    """One line for all of it: "14 of 16 agree; glossy area 25 differs; cornell exact is undecided"."""
    if not rows:
        return "nothing could be judged"
    verbs = VERBS | ADMITTED
    names: dict[str, list[str]] = {word: [] for word in verbs}
    for row in rows:
        admitted = row["verdict"] == "differs" and row["as_claimed"]
        names["differs as claimed" if admitted else row["verdict"]].append(title(row))
    number = len(names.pop("agrees"))
    parts = [f"{number} of {len(rows)} {VERBS['agrees'][number != 1]}"]
    for word, some in names.items():
        more = f" and {len(some) - NAMED} more" if len(some) > NAMED else ""
        parts += [f"{', '.join(some[:NAMED])}{more} {verbs[word][len(some) > 1]}"] if some else []
    return "; ".join(parts)


def left_out_table(rows: list[Row]) -> Table:
    """What each scene did not need, and why."""
    table = Table(box=box.SIMPLE, title="Left out, because the scene does not need it")
    for name in ("scene", "what", "why"):
        table.add_column(name)
    for row in rows:
        for number, entry in enumerate(row["left_out"]):
            table.add_row("" if number else escape(row["scene"]), escape(entry["what"]), escape(entry["why"]))
    return table
