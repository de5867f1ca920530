"""Relations as a table in a terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Group

from nusselt.experiments.results.rows import percent, urgent_first
from nusselt.experiments.results.schema import Row
from nusselt.experiments.results.study_tables import table
from nusselt.experiments.results.tables import VERBS
from nusselt.renderer.words import count


def relation_table(rows: Sequence[Row], alpha: float, width: int) -> Group:
    """A line a relation, what is broken first; those that a scene does not have are counted."""
    lines = [
        {
            **{"scene": row["scene"], "relation": row["method"], "verdict": row["verdict"]},
            "seen": " to ".join(percent(end, 2, sign=True, unit="") for end in row.get("bias_interval", ())),
            **{"expected": row["expects"], "likely": row["likely"] if row["verdict"] == "differs" else ""},
            "as_claimed": row["as_claimed"],
        }
        for row in urgent_first([row for row in rows if "verdict" in row])
    ]
    caption = "seen: the difference from what is expected, in % of its mean; false-alarm rate "
    caption += f"{alpha:g} for the whole table."
    title = "What right images keep, without a reference"
    return table(lines, title, width, hidden=("as_claimed",), caption=caption)


def sentences(rows: Sequence[Row]) -> list[str]:
    """Why each relation that is broken or undecided is; what was left out; and how many hold."""
    told = [f"{row['scene']}, {row['method']}: {row['reason']}" for row in rows if row.get("verdict") == "differs"]
    for verdict, word in (("undecided", "undecided"), (None, "left out")):
        alike: dict[str, list[str]] = {}
        for row in rows:
            if row.get("verdict") == verdict:
                alike.setdefault(row["reason"], []).append(f"{row['scene']}, {row['method']}")
        told += [f"{word} ({why}): {'; '.join(names)}" for why, names in alike.items()]
    words = [row["verdict"] for row in rows if "verdict" in row]
    if not words:
        return [*told, "no relation could be judged"]
    counts = ", ".join(f"{words.count(word)} {verbs[words.count(word) != 1]}" for word, verbs in VERBS.items())
    return [*told, f"{count(len(words), 'relation')}: {counts}"]
