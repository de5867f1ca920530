"""Every row as a line of a spreadsheet: nested entries get dotted names."""

from __future__ import annotations

import csv
import io
from typing import Any

from nusselt.experiments.results.document import plain
from nusselt.experiments.results.rows import Row

SKIPPED = ("tiles", "tile_p")
"""Pictures rather than figures."""


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
    rows = [flat({k: v for k, v in row.items() if k not in SKIPPED}) for row in plain(document["rows"])]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    stream = io.StringIO()
    writer = csv.DictWriter(stream, columns, restval="")
    writer.writeheader()
    writer.writerows({name: _cell(value) for name, value in row.items()} for row in rows)
    return stream.getvalue()
