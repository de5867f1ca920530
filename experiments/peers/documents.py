"""Tables of docs/peers.md: `python -m nusselt.experiments.peers.documents RESULTS.json...`."""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Sequence
from pathlib import Path

from nusselt.experiments.results.document import read_json
from nusselt.experiments.results.exports.markdown import table_lines
from nusselt.experiments.results.rows import percent
from nusselt.experiments.results.schema import Row
from nusselt.renderer.errors import InputError

from .times.words import CAPTION, TIME_COLUMNS, time_cells

WIDTH = 120


def matrix(rows: Sequence[Row]) -> list[str]:
    """Bias of each renderer in each scene."""
    cells = {(row["estimator"], row["scene"]): _bias(row) for row in rows}
    scenes = list(dict.fromkeys(scene for _, scene in cells))
    names = dict.fromkeys(name for name, _ in cells)
    lines = [[name, *(cells.get((name, scene), "–") for scene in scenes)] for name in names]
    return table_lines(["", *(f"`{scene}`" for scene in scenes)], lines)


def _bias(row: Row) -> str:
    low, high = row["bias_interval"]
    method = row["passes"] == 1
    reach = percent(row["margin"] if method else (high - low) / 2, unit="")
    word = "" if row["verdict"] != "differs" else " **differs**"
    return f"{percent(row['bias_relative'], sign=True, unit='')} ± {reach}{' (method)' if method else ''}{word}"


def departures(rows: Sequence[Row]) -> list[str]:
    """Bias and RMS that each setting costs in each scene."""
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    keys = dict.fromkeys((row["renderer"], row["what"], row["left"]) for row in rows)
    cells = {(row["renderer"], row["what"], row["left"], row["scene"]): _cost(row) for row in rows}
    lines = [[*key, *(cells.get((*key, scene), "–") for scene in scenes)] for key in keys]
    return table_lines(["renderer", "setting", "if left", *(f"`{scene}`" for scene in scenes)], lines)


def _cost(row: Row) -> str:
    if row.get("bias_relative") is None:
        return "no image"
    return f"{percent(row['bias_relative'], sign=True, unit='')}, {percent(row['rms_denoised_relative'], 2, unit='')}"


def times(rows: Sequence[Row]) -> list[str]:
    """Seconds to each error, scene by scene; what is timed, once."""
    found = textwrap.wrap(CAPTION, WIDTH)
    for scene in dict.fromkeys(row["scene"] for row in rows):
        lines = [time_cells(row)[:-1] for row in rows if row["scene"] == scene]
        found += ["", f"`{scene}`:", "", *table_lines(TIME_COLUMNS[:-1], lines)]
    said = {row["renderer"]: (row["timed"], row["beware"]) for row in rows}
    return [
        *found,
        "",
        *table_lines(["renderer", "what is timed", "beware"], [[name, *words] for name, words in said.items()]),
    ]


TABLES = {"cross": matrix, "departures": departures, "cross-times": times}


def text(rows: Sequence[Row]) -> str:
    """Every table that the rows have."""
    parts = []
    for experiment, make in TABLES.items():
        some = [row for row in rows if row.get("experiment") == experiment]
        parts += ["\n".join(make(some))] if some else []
    return "\n\n".join(parts)


if __name__ == "__main__":
    try:
        print(text([row for name in sys.argv[1:] for row in read_json(Path(name))["rows"]]))
    except InputError as error:
        sys.exit(f"nusselt: {error}")
