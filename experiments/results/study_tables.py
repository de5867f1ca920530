"""Rows of any experiment as tables in the terminal: what all rows share, and long sentences, once below them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rich import box
from rich.console import Group
from rich.markup import escape
from rich.table import Table

from .rows import urgent_first
from .schema import Row

HIDDEN = ("experiment", "command", "seed", "seconds")
"""The same in every row, or for machines."""
LONG = 40
"""Characters beyond which words stand below the table, once, and their number in it."""
GAP, EDGES = 3, 2
"""Between columns, and at the edges of a table."""
KEYS = 24
"""Characters at most of a column that says what a row is about; what is longer goes on below."""
NUMBER = re.compile(r"([-+−><≥≤ ]*[\d.,]+(e[-+]?\d+)?( ?%)?)?|inf|nan")
"""Cells that are set to the right, and never broken."""
MOST_KEYS = 4
"""Columns, at most, that say it."""
MOST_ROWS = 100
"""Rows in a terminal; the files have all."""


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


def table(rows: Sequence[Row], title: str, width: int, *, hidden: Sequence[str] = HIDDEN, caption: str = "") -> Group:
    """One line a row; columns that do not fit beside the others stand in a further table, with what tells rows apart.

    Parameters
    ----------
    hidden : sequence of str
        Entries that are not shown.
    caption : str
        A sentence below.
    """
    rows, every = urgent_first(list(rows)) if len(rows) > MOST_ROWS else rows, len(rows)
    shown = [name for name in dict.fromkeys(n for row in single(rows) for n in row) if name not in hidden]
    columns = {name: [cell(row.get(name)) for row in rows] for name in shown}
    shared = {name: cells[0] for name, cells in columns.items() if len(rows) > 1 and len(set(cells)) == 1}
    rows = rows[:MOST_ROWS]
    columns = {name: cells[:MOST_ROWS] for name, cells in columns.items() if name not in shared}
    below, numbered, keys = _of_all(shared), 0, _keys(columns)
    if len(rows) < every:
        below.append(f"{len(rows)} of {every} rows, what is not as claimed first; the files of --out have all")
    for name, cells in columns.items():
        long = dict.fromkeys(text for text in cells if len(text) > LONG and name not in keys)
        sentences = {text: f"({number})" for number, text in enumerate(long, start=numbered + 1)}
        numbered += len(sentences)
        columns[name] = [sentences.get(text, text) for text in cells]
        below += [f"{number} {text}" for text, number in sentences.items()]
    numbers = {name for name, cells in columns.items() if all(map(NUMBER.fullmatch, cells))}
    parts: list[Any] = []
    sizes = {name: _width(name, cells, name in numbers) for name, cells in columns.items()}
    for names in blocks(sizes, keys, width):
        found = Table(box=box.SIMPLE, title=None if parts else title)
        for name in names:
            is_number, least = name in numbers, sizes[name] - GAP
            head = name.replace("_", "\n") if is_number else _words(name)  # its cells are not to be cut: nor is it
            justify = "right" if is_number else "left"
            found.add_column(head, justify=justify, no_wrap=is_number, min_width=least, overflow="fold")  # type: ignore[arg-type]
        for number, row in enumerate(rows):
            style = "red" if row.get("as_claimed") is False else None
            found.add_row(*(columns[name][number] for name in names), style=style)
        parts.append(found)
    return Group(*parts, *below, *filter(None, [caption]))


def _of_all(shared: dict[str, str]) -> list[str]:
    """What every row has, in lines: sentences on lines of their own."""
    brief = [f"{_words(name)} {value}" for name, value in shared.items() if 0 < len(value) <= LONG]
    lines = [f"in every row: {'; '.join(brief)}"] if brief else []
    return lines + [f"{_words(name)}: {value}" for name, value in shared.items() if len(value) > LONG]


def _words(name: str) -> str:
    return name.replace("_", " ")


def _width(name: str, cells: list[str], is_number: bool) -> int:
    """Characters that a column needs."""
    head, longest = max(map(len, _words(name).split())), max(map(len, cells))
    return GAP + max(head, longest if is_number else min(longest, KEYS))


def _keys(columns: dict[str, list[str]]) -> list[str]:
    """Names of the first columns that tell rows apart, each some that those before it leave alike."""
    keys, told = list[str](), 1
    for name in columns:
        kinds = len(set(zip(*(columns[key] for key in (*keys, name)), strict=True)))
        if kinds > told and len(keys) < MOST_KEYS:
            keys, told = [*keys, name], kinds
    return keys or list(columns)[:1]


def blocks(sizes: Mapping[str, int], keys: Sequence[str], width: int) -> Iterator[list[str]]:
    """Names of the columns of each table that fits beside others; ``keys``, that say which row it is, stand in each."""
    used = fixed = sum(sizes[name] for name in keys)
    block = list(keys)
    for name in (name for name in sizes if name not in keys):
        if used + sizes[name] > width - EDGES and len(block) > len(keys):
            yield block
            block, used = list(keys), fixed
        block.append(name)
        used += sizes[name]
    yield block
