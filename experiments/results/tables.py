"""Results as tables in a terminal."""

from __future__ import annotations

from typing import Any

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

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


def _percent(value: float) -> str:
    return f"{100 * value:+.3f}"


def _cells(row: dict[str, Any]) -> dict[str, str]:
    """One row by column; empty where nothing was measured."""
    kind = "" if row["claim"] == "exact" else f" {row['samples']}{' strat' if row['stratified'] else ''}"
    mark = "" if row["as_claimed"] in (True, None) else " [red]not as claimed[/]"
    seconds = sum(
        value for key, value in row["seconds"].items() if key in ("pilot", "ours", "reference", "expectations")
    )
    told = {
        "scene": escape(row["scene"]),
        "estimator": row["estimator"] + kind,
        "verdict": f"[{COLOURS[row['verdict']]}]{row['verdict']}[/]{mark}",
        "seconds": f"{seconds:.1f}",
    }
    if row["bias_interval"] is None:
        return told
    low, high = row["bias_interval"]
    expected = row["course_expected"]["mse"]
    return told | {
        "bias %": _percent(row["bias_relative"]),
        "its interval %": f"{_percent(low)} to {_percent(high)}",
        "finds %": f"{100 * row['minimum_detectable_bias']:.3f}",
        "RMS %": f"{100 * row['rms_relative']:.2f}",
        "course": f"{_fixed(row['course_bias'], 1)} / {_fixed(row['course_mse'], 2)}",
        "expected": f"{expected[0]:.2f} to {expected[1]:.2f}",
    }


def verdict_table(rows: list[dict[str, Any]], alpha: float, width: int) -> Table:
    """One line a row: what was asked, the bias and how sure, the noise, the course's scores."""
    columns = ["scene", "estimator", "verdict", "bias %", "its interval %", "finds %", "RMS %", "course", "expected"]
    if width < WIDE:
        columns = ["scene", "verdict", "bias %", "its interval %", "finds %"]
    else:
        columns.append("seconds")
    table = Table(
        box=box.SIMPLE,
        title="Ours against Mitsuba's direct integrator",
        caption="Bias and RMS in % of the reference's mean over shaded pixels; "
        f"false-alarm rate {alpha:g} for the whole table. "
        "finds: the smallest bias found with 99 % power. course: bias / variance in 8-bit levels.",
    )
    for name in columns:
        table.add_column(name, justify="left" if name in ("scene", "estimator", "verdict") else "right", no_wrap=True)
    for row in rows:
        cells = _cells(row)
        table.add_row(*(cells.get(name, "") for name in columns))
    return table


def left_out_table(rows: list[dict[str, Any]]) -> Table:
    """What each scene did not need, and why."""
    table = Table(box=box.SIMPLE, title="Left out, because the scene does not need it")
    for name in ("scene", "what", "why"):
        table.add_column(name)
    for row in rows:
        for number, entry in enumerate(row["left_out"]):
            table.add_row("" if number else escape(row["scene"]), escape(entry["what"]), escape(entry["why"]))
    return table
