"""A comparison in a terminal: scores, bias, verdict, likely mistakes."""

from __future__ import annotations

import math
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

from nusselt.experiments.console import say, say_command
from nusselt.experiments.results.rows import method
from nusselt.experiments.results.tables import COLOURS

FOUND = {
    "bias": "a bias of {}",
    "contrast": "a contrast of {}",
    "rms": "an RMS of {}",
    "pixel": "{} in one pixel alone, at half of the pixels",
}
"""What is said to be found, by its name in a row."""


def _score(value: float) -> str:
    """To one decimal, as the course prints it; never -0.0."""
    return f"{round(value, 1) + 0.0:.1f}"


def tell(row: dict[str, Any], table: Console) -> None:
    """Print one row."""
    reference = row["reference"]
    images = f"{row['passes']} different image{'s' if row['passes'] > 1 else ''}"
    say(table, f"{row['scene']}: {images} against {reference['notes'][0]}", style="bold")
    say(table, f"{row['verdict']}: {row['reason']}", style=COLOURS[row["verdict"]])
    say(table, _power(row))
    for name, (low, high) in row["course_expected"].items():
        scores = ", ".join(_score(score[name]) for score in row["course_scores"])
        kind, sign = ("course bias", "the reference less yours; ") if name == "bias" else ('course "variance"', "")
        table.print(f"{kind:18} {scores}   ({sign}our {_compared(row)}: {low:.2f} to {high:.2f})", markup=False)
    _tell_mistakes(row, table)
    _tell_convergence(row, table)
    for warning in row["warnings"]:
        say(table, f"note: {warning}")
    say_command(table, f"again: {row['command']}")


def _compared(row: dict[str, Any]) -> str:
    """The estimator whose image is set beside."""
    return method({**row, "estimator": row["compared_estimator"]})


def _tell_mistakes(row: dict[str, Any], table: Console) -> None:
    if row["verdict"] != "differs":
        return
    mistakes = row["likely_mistakes"]
    if row["non_finite"]:
        say(table, "look: 0 / 0, a root of less than 0, a vector of no length, an overflow")
    elif not mistakes:
        more = ": a second seed may tell more" if row["passes"] == 1 else ""
        say(table, f"it looks like none of the mistakes that are known here{more}")
    for number, mistake in enumerate(mistakes):
        start = "it looks like" if number == 0 else "or, no worse,"
        share = f"{mistake['explained']:.1%} of the difference beyond noise"
        say(table, f"{start} {mistake['name']}: {mistake['detail']} ({share})")
    if mistakes:
        say(table, f"look: {mistakes[0]['hint']}")
        say(table, f"of right images at most {mistakes[0]['named_wrongly']:.0%} are given a name")
    for place in row["where"]:
        say(table, f"where: {place}")


def _tell_convergence(row: dict[str, Any], table: Console) -> None:
    told = row.get("convergence")
    if not told:
        return
    found = Table(box=box.SIMPLE, title="Error against samples and time")
    for name in ("samples", "RMS %", "first s", "median s"):
        found.add_column(name, justify="right")
    for entry in told["rows"]:
        found.add_row(
            str(entry["samples"]),
            "none" if math.isnan(entry["rms_relative"]) else f"{entry['rms_relative']:.2%}",
            f"{entry['seconds_first']:.2f}",
            f"{entry['seconds_median']:.2f}",
        )
    table.print(found)
    if len(told["rows"]) > 1:
        slopes = {name: told[f"slope_{name}"] for name in ("samples", "seconds")}
        known = [f"as {name} to the power {value:+.2f}" for name, value in slopes.items() if value is not None]
        say(table, f"RMS falls {', '.join(known)}" if known else "how the RMS falls is not known")


def _power(row: dict[str, Any]) -> str:
    """What would have been found: the bias, and what else there is a rule for."""
    if not row["pixels"]["shaded"]:
        return "nothing would have been found: no pixel of a surface can be judged"
    sizes = {"bias": row["minimum_detectable_bias"], **row["finds"]}
    known = {name: size for name, size in sizes.items() if name in FOUND and size is not None}
    least = ", ".join(FOUND[name].format(f"{size:.2%}") for name, size in known.items() if size < 1)
    blind = ", ".join(f"no {name.replace('rms', 'RMS')}" for name, size in known.items() if size >= 1)
    less = blind and f"{blind} below 100 %"
    return f"would have been found, with 99 % power: {', '.join(filter(None, (least, less)))}"
