"""The summary a forge shows beside a run: Markdown, failing rows first, under its limit of 1 MiB."""

from __future__ import annotations

import re
from typing import Any

from nusselt.experiments.results.rows import experiment_of, method, percent, status, urgent_first
from nusselt.experiments.results.schema import Row
from nusselt.experiments.results.summary import facts, headline

LIMIT = 1 << 20
"""Bytes; a forge refuses more."""
MARKS = {"good": "✅", "bad": "❌", "open": "❔", "plain": ""}
COLUMNS = ("experiment", "scene", "estimator", "", "verdict", "bias", "its interval", "finds", "RMS")


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


def _cells(row: Row) -> list[str]:
    low, high = row.get("bias_interval") or (None, None)
    interval = f"{percent(low, sign=True)} to {percent(high, sign=True)}" if low is not None else ""
    return [
        text(experiment_of(row)),
        text(row.get("scene") or ""),
        text(method(row)),
        {"failing": "❌", "undecided": "❔", "as claimed": "✅", "shown": ""}[status(row)],
        text(row.get("verdict") or ""),
        percent(row.get("bias_relative"), sign=True),
        interval,
        percent(row.get("minimum_detectable_bias")),
        percent(row.get("rms_relative"), 2),
    ]


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
    parts.append(f"\n| {' | '.join(COLUMNS)} |\n|{'---|' * len(COLUMNS)}\n")
    tail = ["\n", *map(_reason, rows)]
    lines = [f"| {' | '.join(_cells(row))} |\n" for row in rows]
    return "".join(_within([*parts, *lines, *tail]))


def _within(parts: list[str]) -> list[str]:
    """As many leading parts as fit, and how many did not."""
    size, room = 0, LIMIT - 200
    for index, part in enumerate(parts):
        size += len(part.encode())
        if size > room:
            return [*parts[:index], f"\n{len(parts) - index} further lines are in results.json.\n"]
    return parts
