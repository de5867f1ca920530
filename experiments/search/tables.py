"""What a search found: by kind of scene, by check, and failure by failure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.console import Group

from nusselt.experiments.results.exports.markdown import table_lines
from nusselt.experiments.results.figures import BLUE, RED, canvas
from nusselt.experiments.results.schema import Row
from nusselt.experiments.results.study_tables import table
from nusselt.experiments.runs.experiment import Outcome

from .examine import SECONDS
from .referees import LEVEL

SHOWN = 40
"""Failures told on a terminal."""


def by_kind(rows: Sequence[Row]) -> list[Row]:
    """One row a kind of scene."""
    found: dict[str, Row] = {}
    for row in rows:
        nothing = {"kind": row["kind"], "scenes": 0, "failing_scenes": 0, "compared_points": 0, "disagree": 0}
        nothing |= {"sampled_scenes": 0, "slowest_seconds": 0.0}
        entry = found.setdefault(row["kind"], nothing)
        for name in ("scenes", "failing_scenes", "compared_points", "disagree", "sampled_scenes"):
            entry[name] += row[name]
        entry["slowest_seconds"] = max(entry["slowest_seconds"], row["slowest_seconds"])
    return [entry | {"as_claimed": not entry["failing_scenes"]} for entry in found.values()]


def by_check(rows: Sequence[Row]) -> list[Row]:
    """One row a twin or referee."""
    found: dict[str, Row] = {}
    for row in rows:
        for name, told in row["checks"].items():
            entry = found.setdefault(name, {"check": name} | dict.fromkeys(told, 0))
            for key, value in told.items():
                entry[key] = max(entry[key], value) if key == "largest_ratio" else entry[key] + value
    return [entry | {"as_claimed": not entry["failing_scenes"]} for entry in found.values()]


def failures(rows: Sequence[Row]) -> list[Row]:
    """Every failure, the largest first."""
    found = [failure for row in rows for failure in row["failures"]]
    return sorted(found, key=lambda f: (f["pixel"] >= 0, -f["difference"]))


def summary(rows: Sequence[Row]) -> str:
    """In a sentence or two."""
    kinds, means = by_kind(rows), sum(row["means"] for row in rows)
    total = {name: sum(entry[name] for entry in kinds) for name in ("scenes", "failing_scenes", "compared_points")}
    slowest = max(row["slowest_seconds"] for row in rows)
    return (
        f"{total['scenes']} scenes, {total['compared_points']} points compared; {total['failing_scenes']} scenes fail. "
        f"The referees told {means} means, each with a chance of {LEVEL:g} to be off by more than its bound: at most "
        f"{means * LEVEL:.1g} in all. Slowest scene {slowest:.1f} s of {SECONDS:g} s."
    )


def search_table(rows: Sequence[Row], width: int) -> Group:
    """For the terminal."""
    parts: list[Any] = [
        table(by_kind(rows), "Kinds of scenes", width),
        table(by_check(rows), "Twins and referees", width),
    ]
    if some := failures(rows):
        brief = [{k: f[k] for k in ("scene", "check", "what", "pixel", "difference", "ratio", "points")} for f in some]
        title = f"Failures, {min(SHOWN, len(some))} of {len(some)}, the largest first"
        parts.append(table(brief[:SHOWN], title, width))
    return Group(*parts, summary(rows))


def _markdown(rows: Sequence[Row]) -> list[str]:
    cells = ([f"{v:.3g}" if isinstance(v, float) else str(v).replace("|", "/") for v in row.values()] for row in rows)
    return [*table_lines([name.replace("_", " ") for name in rows[0]], cells), ""]


def search_page(rows: Sequence[Row]) -> str:
    """As Markdown."""
    lines = ["# Random scenes", "", summary(rows), "", *_markdown(by_kind(rows)), *_markdown(by_check(rows))]
    if some := failures(rows):
        lines += ["## Failures", "", *_markdown(some)]
    return "\n".join(lines)


def search_files(rows: Sequence[Row]) -> dict[str, str]:
    """The shrunk scenes, by file name."""
    return {small["name"]: small["text"] for row in rows for small in row["small"]}


def search_figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """How many points each check compared, and on how many it disagrees."""
    rows = [row for row in by_check([row for outcome in outcomes for row in outcome.rows]) if row["points"]]
    figure = canvas(8, 0.26 * len(rows) + 1.2)
    axis = figure.subplots()
    axis.barh(range(len(rows)), [row["points"] for row in rows], color=BLUE)
    axis.barh(range(len(rows)), [row["disagree"] for row in rows], color=RED)
    axis.set_yticks(range(len(rows)), [row["check"] for row in rows], fontsize=7)
    axis.set_xscale("symlog")
    axis.set_xlabel("points compared; red: on which the check disagrees")
    axis.set_title("Random scenes against their twins and two referees", fontsize=10)
    return {"points": figure}
