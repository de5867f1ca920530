"""Readings as a table in a terminal."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from rich import box
from rich.markup import escape
from rich.table import Table

from nusselt.experiments.results.schema import Row
from nusselt.experiments.results.tables import COLOURS

DIGITS = 6


def _reading(values: list[float] | None, errors: list[float] | None = None) -> str:
    """One number where the channels are alike, else three; the standard error of their average behind."""
    if values is None:
        return ""
    alike = max(values) - min(values) <= 1e-9 * max(map(abs, values))
    shown = " ".join(f"{value:.{DIGITS}g}" for value in (values[:1] if alike else values))
    noise = float(np.mean(errors)) if errors else 0.0
    return f"{shown} ± {noise:.1g}" if noise else shown


def _percent(interval: list[float] | None) -> str:
    return "" if interval is None else f"{100 * interval[0]:+.3f} … {100 * interval[1]:+.3f}"


def _place(values: list[float]) -> str:
    return " ".join(f"{value:.5g}" for value in values)


def sensor_table(rows: Sequence[Row]) -> Table:
    """One line a sensor: what it reads by ours and by Mitsuba, what it should, and the verdict."""
    asked = any("reference_reading" in row for row in rows)
    expecting = any("expected_reading" in row for row in rows)
    table = Table(box=box.SIMPLE, title="Irradiance, W/m²", caption="Differences in % of the reading.")
    names = ["scene", "", "at", "facing", "ours"]
    names += ["Mitsuba", "ours less it, %"] if asked else []
    names += ["expected", "ours less it, %"] if expecting else []
    for name in (*names, "verdict"):
        table.add_column(name, justify="left" if name in ("scene", "verdict") else "right", overflow="fold")
    for row in rows:
        cells = [escape(row["scene"]), str(row["sensor"]), _place(row["position"]), _place(row["normal"])]
        cells.append(_reading(row["reading"], row["reading_standard_error"]))
        if asked:
            cells.append(_reading(row.get("reference_reading"), row.get("reference_standard_error")))
            cells.append(_percent(row.get("difference_interval")))
        if expecting:
            cells += [_reading(row.get("expected_reading")), _percent(row.get("expected_interval"))]
        word = row.get("verdict", "")
        table.add_row(*cells, f"[{COLOURS[word]}]{word}[/]" if word else "")
    return table
