"""Results as tables in a terminal."""

from __future__ import annotations

from typing import Any

from rich.markup import escape
from rich.table import Table

COLOURS = {"agrees": "green", "differs": "red", "undecided": "yellow"}


def percent(value: float | None, digits: int = 3) -> str:
    return "" if value is None else f"{100 * value:+.{digits}f}"


def verdict_table(rows: list[dict[str, Any]], alpha: float) -> Table:
    """One line a row: what was asked, the bias and how sure, the noise, the course's scores."""
    table = Table(
        title="Nusselt: ours against Mitsuba's direct integrator",
        caption=f"bias and RMS in % of the reference's mean over shaded pixels; false-alarm rate {alpha:g} "
        "for the whole table; smallest bias found with 99 % power; course scores in 8-bit levels",
    )
    for name, justify in (
        *(("scene", "left"), ("estimator", "left"), ("verdict", "left"), ("bias %", "right")),
        *(("interval %", "right"), ("finds %", "right"), ("RMS %", "right")),
        *(("course", "right"), ("expected", "right"), ("s", "right")),
    ):
        table.add_column(name, justify=justify, no_wrap=name != "expected")  # type: ignore[arg-type]
    for row in rows:
        word = row["verdict"]
        kind = f"{row['samples']}{' strat' if row['stratified'] else ''}" if row["estimator"] != "analytic" else ""
        low, high = row["bias_interval"] or (None, None)
        expected = row["course_expected"]
        table.add_row(
            escape(row["scene"]),
            f"{row['estimator']} {kind}".strip(),
            f"[{COLOURS[word]}]{word}[/]" + ("" if row["as_claimed"] in (True, None) else " [red]!"),
            percent(row["bias_relative"]),
            "" if low is None else f"{percent(low)} {percent(high)}",
            "" if low is None else f"{100 * row['minimum_detectable_bias']:.3f}",
            "" if low is None else f"{100 * row['rms_relative']:.2f}",
            "" if low is None else f"{row['course_bias']:.1f} / {row['course_mse']:.2f}",
            "" if low is None else f"{expected['mse'][0]:.2f} to {expected['mse'][1]:.2f}",
            f"{sum(v for k, v in row['seconds'].items() if k in ('pilot', 'ours', 'reference')):.1f}",
        )
    return table


def left_out_table(rows: list[dict[str, Any]]) -> Table:
    """What each scene did not need, and why."""
    table = Table(title="Left out, because the scene does not need it")
    for name in ("scene", "what", "why"):
        table.add_column(name)
    for row in rows:
        for number, entry in enumerate(row["left_out"]):
            table.add_row("" if number else escape(row["scene"]), escape(entry["what"]), escape(entry["why"]))
        table.add_section()
    return table
