"""README's ratios of time: `python -m nusselt.experiments.studies.race.page RESULTS.json...`, a machine each."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from nusselt.experiments.results.document import read_json
from nusselt.experiments.results.exports.markdown import table_lines
from nusselt.experiments.results.schema import Row
from nusselt.experiments.studies.race.rows import SENTENCE
from nusselt.renderer.errors import InputError


def ratio(row: Row) -> str:
    """Of the times, ours to theirs: "14 [11, 14]"; "≥" where Mitsuba's is a bound."""
    if row.get("ratio") is None:
        return "–"
    interval = row.get("ratio_interval")
    spread = f" [{', '.join(f'{end:.2g}' for end in interval)}]" if interval else ""
    return f"{'≥ ' if row.get('lower_bound_only') else ''}{row['ratio']:.2g}{spread}"


def text(rows: Sequence[Row]) -> str:
    """A line a scene and pixel rule, a column a target."""
    ours = [row for row in rows if isinstance(row.get("ours"), dict) and row.get("target") is not None]
    targets = sorted({row["target"] for row in ours}, reverse=True)
    cells = {(row["scene"], row["pixel_rule"], row["target"]): ratio(row) for row in ours}
    heads = ["scene", "pixels", *(f"to {target:g}" for target in targets)]
    raced = dict.fromkeys((row["scene"], row["pixel_rule"]) for row in ours)
    lines = ([f"`{scene}`", rule, *(cells.get((scene, rule, t), "–") for t in targets)] for scene, rule in raced)
    return "\n".join([*table_lines(heads, lines), "", f"Times of Mitsuba over ours, to the same error. {SENTENCE}", ""])


def machine(document: dict[str, Any]) -> str:
    """What was measured on, and when."""
    told = document.get("machine") or {}
    words = [str(told.get("processor")), f"{told.get('cores')} cores", str(told.get("instructions") or ""), "Mitsuba"]
    words[-1] += f" {(document.get('versions') or {}).get('mitsuba')}"
    written = str((document.get("seconds") or {}).get("written"))[:10]
    return ", ".join(word for word in (*words, written) if word)


def main(paths: Sequence[str]) -> str:
    """A table a file, below the machine it is of.

    Raises
    ------
    InputError
        If one is no results file, or has no row of this experiment.
    """
    parts = []
    for path in paths:
        document = read_json(Path(path))
        rows = [row for row in document["rows"] if row.get("experiment") == "error-against-time"]
        if not rows:
            raise InputError("results", path, "a file with rows of error-against-time")
        parts.append(f"{machine(document)}:\n\n{text(rows)}")
    return "\n".join(parts)


if __name__ == "__main__":
    print(main(sys.argv[1:]))
