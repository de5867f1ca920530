"""Results for other programs to read: a forge's summary page, its test pages, a spreadsheet."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from nusselt.experiments.files import replacing

from .csv_table import csv_table
from .junit import junit
from .markdown import markdown

EXPORTS: dict[str, Callable[[dict[str, Any]], str]] = {"summary": markdown, "junit": junit, "csv": csv_table}
"""By the option that asks for it; each makes a text from a results document."""


def write_exports(document: dict[str, Any], options: dict[str, Any]) -> None:
    """Write those that ``options`` names a file for."""
    for name, export in EXPORTS.items():
        if options.get(name):
            with replacing(Path(options[name])) as beside:
                beside.write_text(export(document), encoding="utf-8", newline="")
