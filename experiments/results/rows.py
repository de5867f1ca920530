"""What every table, page and file says of a row in the same words."""

from __future__ import annotations

import math
from typing import Any, Literal

from .schema import Row

Status = Literal["failing", "undecided", "as claimed", "shown"]


def experiment_of(row: Row) -> str:
    """Which experiment a row belongs to; the main job's rows are ``check``."""
    return str(row.get("experiment") or "check")


def status(row: Row) -> Status:
    """What a row counts as; ``shown`` where it claims nothing."""
    if "as_claimed" not in row:
        return "shown"
    claimed = row["as_claimed"]
    return "undecided" if claimed is None else "as claimed" if claimed else "failing"


def in_table(row: Row) -> bool:
    """Whether a row stands among the verdicts: it has one, or is not as claimed. The rest is its experiment's."""
    return status(row) in ("failing", "undecided") or (status(row) == "as claimed" and bool(row.get("verdict")))


def method(row: Row) -> str:
    """The method, else the estimator, with its samples, if it takes any: "area 25 stratified"."""
    name = str(row.get("method") or row.get("estimator") or "")
    if row.get("samples") is None or row.get("claim") == "exact":
        return name
    return f"{name} {row['samples']}{' stratified' if row.get('stratified') else ''}"


def subject(row: Row) -> str:
    """What a row is about: its scene with the case or the target, or what stands in a scene's place."""
    told = [row.get(name) for name in ("defect", "scene", "case", "name", "light", "what", "form", "series", "test")]
    target = number(row.get("target"))
    if target is not None:
        told += [row.get("pixel_rule"), f"{target:g}"]
    return ", ".join(dict.fromkeys(str(part) for part in told if part))


def title(row: Row) -> str:
    """A row's name: experiment (but for the main job's), subject and method."""
    experiment = experiment_of(row)
    parts = ("" if experiment == "check" else f"{experiment}:", subject(row), method(row))
    return " ".join(part for part in parts if part) or experiment


def whose(row: Row) -> str:
    """Whose image it is: ours, or yours where it was brought."""
    return "yours" if "brought" in row else "ours"


TOLD = (
    *("experiment", "seed", "command", "claim", "as_claimed", "verdict", "reason", "margin", "scene", "estimator"),
    *("samples", "stratified", "passes", "tile_p", "tiles"),
)
"""What a page says of every row in its own words."""


def figures(row: Row) -> list[tuple[str, str]]:
    """Everything else that is one value, by name."""

    def said(value: Any) -> str:
        if isinstance(value, bool):
            return "yes" if value else "no"
        found = number(value)
        return str(value) if found is None else f"{found:.6g}"

    plain = {name: value for name, value in row.items() if isinstance(value, (str, int, float)) and name not in TOLD}
    return [(name.replace("_", " "), said(value)) for name, value in plain.items()]


FINDS = {"contrast": "contrast", "rms": "residual (RMS)", "pixel": "single pixel"}
"""What stands in ``finds`` beside the bias, in words."""


def finds(row: Row) -> str:
    """The smallest contrast, residual and single pixel that the row would have called differs."""
    told = row.get("finds") or {}
    known = [f"{words} {percent(told[name], 2)}" for name, words in FINDS.items() if number(told.get(name)) is not None]
    return ", ".join(known)


def number(value: Any) -> float | None:
    """A finite number, or None."""
    fits = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    return float(value) if fits else None


def percent(value: Any, digits: int = 3, sign: bool = False, unit: str = " %") -> str:
    """A share in percent; empty where there is none."""
    found = number(value)
    if found is None:
        return ""
    rounded = round(100 * found, digits) + 0.0  # no sign before zeros
    return f"{rounded:{'+' if sign else ''}.{digits}f}{unit}".replace("-", "−")


def detectable(row: Row, digits: int = 3, unit: str = " %") -> str:
    """A row's minimum detectable bias; of 100 % and more it is only said that it is."""
    found = number(row.get("minimum_detectable_bias"))
    return f"> 100{unit}" if found is not None and found >= 1 else percent(found, digits, unit=unit)


def urgent_first(rows: list[Row]) -> list[Row]:
    """Failing rows, then undecided ones, then the rest, each in their order."""
    order: dict[Status, int] = {"failing": 0, "undecided": 1, "as claimed": 2, "shown": 3}
    return sorted(rows, key=lambda row: order[status(row)])
