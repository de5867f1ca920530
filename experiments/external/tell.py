"""A comparison in a terminal: scores, bias, verdict, likely mistakes."""

from __future__ import annotations

import math
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

from nusselt.experiments.results.tables import COLOURS


def _score(value: float) -> str:
    """To one decimal, as the course prints it; never -0.0."""
    return f"{round(value, 1) + 0.0:.1f}"


def tell(row: dict[str, Any], table: Console) -> None:
    """Print one row."""
    from rich.markup import escape

    reference = row["reference"]
    images = f"{row['passes']} different image{'s' if row['passes'] > 1 else ''}"
    table.print(f"[bold]{escape(row['scene'])}[/]: {images} against {escape(reference['notes'][0])}")
    colour = COLOURS[row["verdict"]]
    table.print(f"[{colour}]{row['verdict']}[/]: {escape(row['reason'])}", soft_wrap=True)
    table.print(_power(row), soft_wrap=True)
    for name, low_high in row["course_expected"].items():
        scores = ", ".join(_score(score[name]) for score in row["course_scores"])
        kind = "course bias" if name == "bias" else 'course "variance"'
        table.print(f"{kind:18} {scores}   (a right one here: {low_high[0]:.2f} to {low_high[1]:.2f})")
    _tell_mistakes(row, table)
    _tell_convergence(row, table)
    for warning in row["warnings"]:
        table.print(f"note: {warning}", markup=False, soft_wrap=True)
    table.print(f"again: {row['command']}", markup=False, soft_wrap=True)


def _tell_mistakes(row: dict[str, Any], table: Console) -> None:
    if row["verdict"] != "differs":
        return
    mistakes = row["likely_mistakes"]
    if row["non_finite"]:
        table.print("look: 0 / 0, a root of less than 0, a vector of no length, an overflow", soft_wrap=True)
    elif not mistakes:
        table.print("it looks like none of the mistakes that are known here")
    for number, mistake in enumerate(mistakes):
        start = "it looks like" if number == 0 else "or, no worse,"
        share = f"{mistake['explained']:.1%} of the difference beyond noise"
        table.print(f"{start} {mistake['name']}: {mistake['detail']} ({share})", markup=False, soft_wrap=True)
    if mistakes:
        table.print(f"look: {mistakes[0]['hint']}", markup=False, soft_wrap=True)
        table.print(f"a right image would be named so wrongly in at most {mistakes[0]['named_wrongly']:.0%} of cases")
    for place in row["where"]:
        table.print(f"where: {place}", markup=False, soft_wrap=True)


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
    for name in ("samples", "seconds") if len(told["rows"]) > 1 else ():
        value = told[f"slope_{name}"]
        table.print(f"RMS falls as {name} to the power {'unknown' if value is None else f'{value:+.2f}'}")


def _power(row: dict[str, Any]) -> str:
    """What would have been found: the bias, and what else there is a rule for."""
    if not row["pixels"]["shaded"]:
        return "it finds nothing: no pixel of a surface can be judged"
    names = {"bias": "a bias", "contrast": "a contrast", "rms": "an RMS", "pixel": "a pixel, as half of them are,"}
    sizes = {"bias": row["minimum_detectable_bias"], **row["finds"]}
    known = {names[name]: size for name, size in sizes.items() if name in names and size is not None}
    least = ", ".join(f"{what} of {size:.2%}" for what, size in known.items() if size < 1)
    blind = " and ".join(what.split()[1].strip(",") for what, size in known.items() if size >= 1)
    return f"it finds, with 99 % power: {', '.join(filter(None, (least, blind and f'no {blind} below 100 %')))}"
