"""Readings as a table in a terminal."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from rich.console import Group

from nusselt.experiments.results.rows import method
from nusselt.experiments.results.schema import Row
from nusselt.experiments.results.study_tables import table

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
    return "" if interval is None else f"{100 * interval[0]:+.3f} to {100 * interval[1]:+.3f}"


def _place(values: list[float]) -> str:
    return " ".join(f"{value:.5g}" for value in values)


def _line(row: Row, asked: bool, expecting: bool) -> Row:
    """A sensor's cells: the verdict and what it rests on come first."""
    told: Row = {"scene": row["scene"], "sensor": row["sensor"], "verdict": row.get("verdict", "")}
    told |= {"ours less Mitsuba %": _percent(row.get("difference_interval"))} if asked else {}
    told |= {"ours less expected %": _percent(row.get("expected_interval"))} if expecting else {}
    told["ours"] = _reading(row["reading"], row["reading_standard_error"])
    if asked:
        told["Mitsuba"] = _reading(row.get("reference_reading"), row.get("reference_standard_error"))
    told |= {"expected": _reading(row.get("expected_reading"))} if expecting else {}
    told |= {"at": _place(row["position"]), "facing": _place(row["normal"]), "estimator": method(row)}
    return told | {"as_claimed": row.get("as_claimed")}


def sensor_table(rows: Sequence[Row], width: int) -> Group:
    """One line a sensor: what it reads by ours and by Mitsuba, what it should, and the verdict."""
    asked = any("reference_reading" in row for row in rows)
    expecting = any("expected_reading" in row for row in rows)
    lines = [_line(row, asked, expecting) for row in rows]
    return table(lines, "Irradiance, W/m², and differences in % of the reading", width, hidden=("as_claimed",))
