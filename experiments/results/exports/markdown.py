"""The summary a forge shows beside a run: Markdown, failing rows first, under its limit of 1 MiB."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Any

from nusselt.experiments.results.columns import COLUMNS
from nusselt.experiments.results.rows import experiment_of, method, status, urgent_first
from nusselt.experiments.results.schema import Row
from nusselt.experiments.results.summary import facts, headline

LIMIT = 1 << 20
"""Bytes; a forge refuses more."""
MARKS = {"good": "✅", "bad": "❌", "open": "❔", "plain": ""}


def text(value: Any) -> str:
    """Plain text in Markdown: one line, nothing in it is markup."""
    line = " ".join(str(value).split())
    escaped = re.sub(r"([\\`*_{}\[\]()#+!|~@:-])", r"\\\1", line)
    return escaped.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def code(command: str) -> str:
    """A command in a table-proof code block of its own line."""
    line = " ".join(command.split())
    ticks = "`" * (max(map(len, re.findall("`+", line)), default=0) + 1)
    return f"{ticks} {line} {ticks}"


def table_lines(heads: Sequence[str], lines: Iterable[Sequence[str]]) -> list[str]:
    """A table's lines, of cells that are Markdown already."""
    return [f"| {' | '.join(line)} |" for line in (heads, ["---"] * len(heads), *lines)]


def _cells(row: Row) -> list[str]:
    cells = [column.shown(row) if column.number else text(column.shown(row)) for column in COLUMNS]
    mark = {"failing": "❌", "undecided": "❔", "as claimed": "✅", "shown": ""}[status(row)]
    return [text(experiment_of(row)), *cells[:2], mark, *cells[2:]]


def _reason(row: Row) -> str:
    if status(row) not in ("failing", "undecided"):
        return ""
    again = f"<br>{code(str(row['command']))}" if row.get("command") else ""
    name = text(f"{row.get('scene') or experiment_of(row)} {method(row)}")
    return f"- **{name}** {text(row.get('verdict') or '')}: {text(row.get('reason') or 'no reason given')}{again}\n"


def markdown(document: dict[str, Any]) -> str:
    """A results document as Markdown of less than 1 MiB; rows that do not fit are counted."""
    rows = urgent_first(document["rows"])
    tone, said = headline(rows)
    parts = [f"## {MARKS[tone]} {said}\n\n"]
    parts += [f"- **{fact.question}** {text(fact.answer)}. {text(fact.detail)}\n" for fact in facts(document)]
    heads = [column.name for column in COLUMNS]
    heads = ["experiment", *heads[:2], "", *heads[2:]]
    lines = [f"{line}\n" for line in table_lines(heads, map(_cells, rows))]
    return "".join(_within([*parts, "\n", *lines, "\n", *map(_reason, rows)]))


def _within(parts: list[str]) -> list[str]:
    """As many leading parts as fit, and how many did not."""
    size, room = 0, LIMIT - 200
    for index, part in enumerate(parts):
        size += len(part.encode())
        if size > room:
            return [*parts[:index], f"\n{len(parts) - index} further lines are in results.json.\n"]
    return parts
