"""Rows of any experiment as a plain table."""

from __future__ import annotations

from typing import Any

from nusselt.experiments.results.schema import Row
from nusselt.experiments.results.work_precision import seconds_of

QUIET = ("experiment", "command", "seed", "figures", "images", "left_out", "warnings")
"""Said elsewhere, or the same in every row."""
MOST = 500
"""Rows shown; the rest is counted."""


def cell(value: Any) -> str:
    """A value in a few characters."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return " to ".join(map(cell, value)) if len(value) == 2 else ", ".join(map(cell, value))
    return str(value)


def _simple(value: Any) -> bool:
    short = isinstance(value, list) and len(value) <= 4 and not any(isinstance(v, (list, dict)) for v in value)
    return short or not isinstance(value, (list, dict))


def _is_number(value: Any) -> bool:
    return value is None or (isinstance(value, (int, float)) and not isinstance(value, bool))


def plain_table(rows: list[Row]) -> dict[str, Any] | None:
    """Columns with whether each holds numbers, and rows of texts with whether each is one; None without rows."""
    if not rows:
        return None
    rows = [row | {"seconds": seconds_of(row)} if "seconds" in row else row for row in rows]
    names = dict.fromkeys(name for row in rows for name, value in row.items() if _simple(value) and name not in QUIET)
    columns = [name for name in names if any(row.get(name) is not None for row in rows)]
    lines = [
        [{"text": cell(row.get(name)), "number": _is_number(row.get(name))} for name in columns] for row in rows[:MOST]
    ]
    heads = [
        {"name": name.replace("_", " "), "number": all(_is_number(row.get(name)) for row in rows)} for name in columns
    ]
    return {"columns": heads, "lines": lines, "more": max(len(rows) - MOST, 0)}
