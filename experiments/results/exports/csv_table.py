"""Every row as a line of a spreadsheet: nested entries get dotted names."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from typing import Any

from nusselt.experiments.results.document import plain
from nusselt.experiments.results.schema import PICTURES, Row


def flat(entry: Any, name: str = "") -> Row:
    """``{"a": {"b": 1}, "c": [2, 3]}`` as ``{"a.b": 1, "c.0": 2, "c.1": 3}``."""
    if isinstance(entry, dict):
        pairs = entry.items()
    elif isinstance(entry, list):
        pairs = {str(index): value for index, value in enumerate(entry)}.items()
    else:
        return {name: entry}
    found: Row = {}
    for key, value in pairs:
        found |= flat(value, f"{name}.{key}" if name else str(key))
    return found


def _cell(value: Any) -> Any:
    """Text that a spreadsheet would take for a formula is marked as text."""
    return f"'{value}" if isinstance(value, str) and value[:1] in ("=", "+", "-", "@", "\t", "\r") else value


def csv_table(document: dict[str, Any]) -> str:
    """A results document as CSV (RFC 4180), one header line; columns in the order in which rows first have them."""
    return csv_rows([flat({k: v for k, v in row.items() if k not in PICTURES}) for row in plain(document["rows"])])


def csv_rows(rows: Sequence[Row]) -> str:
    """Rows of single values as CSV; numbers in full."""
    stream = io.StringIO()
    writer = csv.DictWriter(stream, list(dict.fromkeys(name for row in rows for name in row)), restval="")
    writer.writeheader()
    writer.writerows({name: _cell(value) for name, value in row.items()} for row in rows)
    return stream.getvalue()
