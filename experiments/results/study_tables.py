"""Rows of any experiment as a table in the terminal and as CSV."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich import box
from rich.markup import escape
from rich.table import Table

from nusselt.experiments.files import replacing

from .rows import Row

HIDDEN = ("experiment", "command", "seed", "seconds")
"""The same in every row, or for machines."""


def columns(rows: Sequence[Row]) -> list[str]:
    """Names of the entries that fit a cell, in the order in which rows bring them."""
    found: dict[str, None] = {}
    for row in rows:
        found.update((name, None) for name, value in row.items() if not isinstance(value, (dict, list)))
    return list(found)


def write_csv(rows: Sequence[Row], path: Path) -> None:
    """Every entry that fits a cell; numbers in full."""
    with replacing(path) as beside, beside.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, columns(rows), extrasaction="ignore")
        writer.writeheader()
        writer.writerows(rows)


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
    names = [name for name in columns(rows) if name not in HIDDEN]
    for name in names:
        numbers = all(isinstance(row.get(name), (int, float, type(None))) for row in rows)
        found.add_column(name.replace("_", " "), justify="right" if numbers else "left")
    for row in rows:
        cells = [cell(row.get(name)) for name in names]
        found.add_row(*cells, style="red" if row.get("as_claimed") is False else None)
    return found
