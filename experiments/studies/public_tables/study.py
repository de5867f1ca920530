"""Public tables of direct light, number by number: printed, exact, ours by every estimator, and Mitsuba's.

Claimed of a table whose digits are right: the exact value rounds to every one of them. Of all: that every unbiased
estimator of ours, and Mitsuba, has the exact value within its own noise. Where a table is wrong its deviation is
stated, and is no failure of ours.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from rich.console import Group
from scipy import stats

from nusselt.experiments.results.exports.markdown import table_lines
from nusselt.experiments.results.figures import canvas, name_lines
from nusselt.experiments.results.schema import Row
from nusselt.experiments.results.study_tables import table
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.mitsuba_bridge.process import ReferenceUnavailable
from nusselt.mitsuba_bridge.sensors import PASSES, sensors_by_mitsuba
from nusselt.renderer.estimators import ESTIMATORS, Exact
from nusselt.renderer.image import read_sensors
from nusselt.renderer.prepared import prepare
from nusselt.renderer.vectors import Floats

from . import cie171, factors, usdlux
from .entry import PublicTable

HEADS = ("entry", "printed", "exact", "exact over printed, less one", "estimators: largest", "Mitsuba")
ROUNDING = 2e-6
"""Relative, of Mitsuba's float32."""
LEVEL = 1e-6
"""Chance that a right number fails, each."""
SIDE = 8
"""Of the strata of a sampled reading."""

SOURCES: tuple[Callable[[], tuple[PublicTable, ...]], ...] = (cie171.tables, usdlux.tables, factors.tables)
"""Every publication, once."""


def every_table() -> dict[str, PublicTable]:
    """All of them by name, in order."""
    return {table.name: table for source in SOURCES for table in source()}


def sampled(table: PublicTable, seed: int, passes: int) -> dict[str, tuple[Floats, Floats]]:
    """Means and standard errors (m,) of the entries by each unbiased estimator with noise.

    Light points that sensors share make their readings one sample: the sums over sensors are what is repeated.
    """
    needs = prepare(table.whole, everything=True).needs
    found = {}
    for kind in ESTIMATORS:
        estimator = kind(samples=SIDE * SIDE, stratified=False)
        if estimator.claim(needs) != "unbiased" or not estimator.is_random(needs):
            continue
        sums = [
            table.sums(read_sensors(table.whole, estimator, seed=seed + k).mean.mean(axis=0)[0]) for k in range(passes)
        ]
        found[kind.name] = np.mean(sums, axis=0), np.std(sums, axis=0, ddof=1) / math.sqrt(passes)
    return found


def compare(table: str, passes: int, samples: int, seed: int) -> Outcome:
    """One table, whole."""
    public = every_table()[table]
    exact = public.sums(read_sensors(public.whole, Exact()).mean.mean(axis=0)[0])
    ours = sampled(public, seed, passes)
    rows: list[Row] = []
    try:
        reference = sensors_by_mitsuba(public.whole, seed=seed, samples=samples)
        theirs = public.sums(reference.mean.mean(axis=0))
        # Sensors do not share samples; the grain of each is the most that one of them can hide.
        square = reference.standard_error.mean(axis=0) ** 2 + math.log(2 / LEVEL) * reference.grain.mean(axis=0) ** 2
        noise = np.sqrt(public.sums(square, power=2))
        half = stats.t.isf(LEVEL / 2, PASSES - 1) * noise + ROUNDING * np.abs(theirs)
        version: str | None = reference.version
    except ReferenceUnavailable:
        version = None
    for k, entry in enumerate(public.entries):
        value = float(exact[k])
        off = {name: _standard_errors(value, float(mean[k]), float(error[k])) for name, (mean, error) in ours.items()}
        row: Row = {
            "table": public.name,
            "source": public.source,
            "unit": public.unit,
            "what": entry.name,
            "printed": entry.printed,
            "half_unit": entry.half_unit,
            "value": value,
            "off_printed": value / entry.printed - 1 if entry.printed else value,
            "as_printed": abs(value - entry.printed) <= entry.half_unit,
            "by_estimator": {name: [float(mean[k]), float(error[k])] for name, (mean, error) in ours.items()},
            "note": public.note,
        }
        right = all(abs(z) < stats.t.isf(LEVEL / 2, passes - 1) for z in off.values())
        right &= row["as_printed"] or not public.is_right
        if version is not None:
            low, high = float(theirs[k] - half[k]), float(theirs[k] + half[k])
            row |= {"mitsuba_interval": [low, high], "mitsuba_version": version}
            right &= low <= value <= high
        rows.append(row | {"as_claimed": right})
    return Outcome(rows)


def _standard_errors(value: float, mean: float, error: float) -> float:
    """How far a mean is from a value; one that is it to rounding is not off, whatever the noise of its rounding."""
    if math.isclose(value, mean, rel_tol=1e-9, abs_tol=1e-12):
        return 0.0
    return (mean - value) / error if error else math.inf


def jobs(settings: Settings) -> list[Job]:
    """One a table; Mitsuba takes every core."""
    passes, samples = settings.pick((32, 1 << 14), (16, 1 << 12), (4, 64))
    return [
        Job(compare, {"table": name, "passes": passes, "samples": samples, "seed": settings.seed_of(name)}, alone=True)
        for name in list(every_table())[: settings.pick(None, None, 1)]
    ]


def page(rows: Sequence[Row]) -> str:
    """The tables in Markdown."""
    lines = ["# Public tables of direct light", ""]
    for name, entries in itertools.groupby(rows, lambda row: row["table"]):
        some = list(entries)
        lines += ["", f"## {name} ({some[0]['source']}; {some[0]['unit']})", ""]
        lines += [f"{some[0]['note'].capitalize()}.", ""] if some[0]["note"] else []
        lines += table_lines(HEADS, map(_cells, some))
    return "\n".join(lines) + "\n"


def _cells(row: Row) -> list[str]:
    z = {name: _standard_errors(row["value"], mean, error) for name, (mean, error) in row["by_estimator"].items()}
    furthest = max(z, key=lambda name: abs(z[name]), default=None)
    interval = row.get("mitsuba_interval")
    off = "as printed" if row["as_printed"] else f"{row['off_printed']:+.2%}"
    theirs = "" if interval is None else f"[{interval[0]:.7g}, {interval[1]:.7g}]"
    return [
        row["what"],
        f"{row['printed']:.6g}",
        f"{row['value']:.9g}",
        off,
        "" if furthest is None else f"{furthest} {z[furthest]:+.1f} standard errors",
        theirs,
    ]


def terminal_table(rows: Sequence[Row], width: int) -> Group:
    """One line a number."""
    lines = []
    for row in rows:
        what, printed, exact, off, _, theirs = _cells(row)
        told: Row = {"table": row["table"], "entry": what, "printed": printed, "exact": exact, "off": off}
        lines.append(told | {"Mitsuba": theirs, "wrong": not row["as_claimed"], "as_claimed": row["as_claimed"]})
    title = "Public tables: printed, exact, and Mitsuba's interval at 1e-6"
    return table(lines, title, width, hidden=("as_claimed",))


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """How far the exact values are from what was printed, with half of its last digit."""
    rows = [row for outcome in outcomes for row in outcome.rows if row["printed"]]
    figure = canvas(9, 0.18 * len(rows) + 1)
    axis = figure.subplots()
    places = -np.arange(len(rows))
    digit = [100 * row["half_unit"] / row["printed"] for row in rows]
    axis.barh(places, 2 * np.array(digit), left=[-d for d in digit], color="0.85", label="last digit")
    axis.plot([100 * row["off_printed"] for row in rows], places, "k.", label="exact over printed, less one, %")
    axis.set_yticks(places, [f"{row['table']}, {row['what']}" for row in rows], fontsize=6)
    name_lines(axis)
    return {"off": figure}


PUBLIC_TABLES = Experiment(
    "public-tables",
    "CIE 171:2006, UsdLux and configuration factors: printed, exact, ours and Mitsuba",
    jobs,
    figures,
    table=terminal_table,
    text=page,
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(PUBLIC_TABLES)
