"""Rows of any experiment as a table in the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich import box
from rich.markup import escape
from rich.table import Table

from .schema import Row

HIDDEN = ("experiment", "command", "seed", "seconds")
"""The same in every row, or for machines."""


def single(rows: Sequence[Row]) -> list[Row]:
    """The rows' entries that fit a cell."""
    return [{name: value for name, value in row.items() if not isinstance(value, (dict, list))} for row in rows]


def cell(value: Any) -> str:
    """A value as people read it."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float) else escape(str(value))


def table(rows: Sequence[Row], title: str) -> Table:
    """One line a row."""
    found = Table(box=box.SIMPLE, title=title)
    names = [name for name in dict.fromkeys(n for row in single(rows) for n in row) if name not in HIDDEN]
    for name in names:
        numbers = all(isinstance(row.get(name), (int, float, type(None))) for row in rows)
        # What is too long goes on below: cut off, it would be another name, another number.
        found.add_column(name.replace("_", " "), justify="right" if numbers else "left", overflow="fold")
    for row in rows:
        cells = [cell(row.get(name)) for name in names]
        found.add_row(*cells, style="red" if row.get("as_claimed") is False else None)
    return found
