"""Error against samples and against time, from whatever rows have both.

A row is a point where it has a relative RMS error and the seconds of one image: the rows of a check, and those
of an experiment with ``scene``, ``estimator``, ``renderer`` ("ours" unless it says otherwise), ``samples``,
``rms_relative`` and ``seconds`` (a number, a list of raw times, or an object with "median").
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np

from nusselt.experiments.verdict.quantiles import student_quantile
from nusselt.renderer.vectors import Floats

from .rows import number
from .schema import Row

TARGETS = (1e-2, 1e-3, 1e-4)
"""Relative RMS errors people ask the time of; the middle one first."""


def slope(sizes: Sequence[float] | Floats, values: Sequence[float] | Floats) -> tuple[float, float, float]:
    """Least-squares slope of log value over log size, and its interval at 99 %: NaN where two points leave none."""
    from scipy import stats

    fit = stats.linregress(np.log(sizes), np.log(values))
    freedom = len(sizes) - 2
    reach = float(student_quantile(0.005, freedom)) * float(fit.stderr) if freedom > 0 else math.nan
    return float(fit.slope), float(fit.slope) - reach, float(fit.slope) + reach


def seconds_of(row: Row) -> float | None:
    """Seconds of one image; None where none were taken."""
    told = row.get("seconds")
    if "brought" in row:  # its own rows say how long it took, if they know
        steps = (row.get("convergence") or {}).get("rows")
        return number(steps[0].get("seconds_median")) if steps else None
    if isinstance(told, dict):
        if "median" in told:
            return number(told["median"])
        ours, passes = number(told.get("ours")), number(row.get("passes"))
        return ours / max(passes, 1) if ours is not None and passes is not None else None
    if isinstance(told, list):
        times = [time for time in map(number, told) if time is not None]
        return median(times) if times else None
    return number(told)


def error_of(row: Row) -> float | None:
    """Relative RMS error of one image; the reference's own noise taken out where the row allows it."""
    square = number(row.get("mse_relative"))
    if square is not None:
        # Below three standard errors the reference's noise is all there is.
        floor = 3 * (number(row.get("mse_relative_standard_error")) or 0.0)
        return math.sqrt(square) if square > floor else None
    return number(row.get("rms_relative"))


def is_mitsuba(row: Row) -> bool:
    """Whether a row tells of Mitsuba's own image rather than of ours."""
    return str(row.get("renderer", "ours")).lower().startswith("mitsuba")


@dataclass(frozen=True)
class Point:
    """One image's samples, seconds and relative RMS error."""

    samples: float | None
    seconds: float | None
    error: float


@dataclass(frozen=True)
class Curve:
    """One method on one scene.

    Parameters
    ----------
    label : str
    mitsuba : bool
    points : tuple of Point
        By samples.
    """

    label: str
    mitsuba: bool
    points: tuple[Point, ...]


def curves(rows: list[Row], scene: str) -> list[Curve]:
    """Every method's curve on a scene, those with most points first."""
    found: dict[tuple[str, bool], set[Point]] = {}
    for row in rows:
        error = error_of(row)
        if row.get("scene") == scene and error is not None:
            key = _label(row), is_mitsuba(row)
            found.setdefault(key, set()).add(Point(number(row.get("samples")), seconds_of(row), error))
    made = [
        Curve(label, mitsuba, tuple(sorted(points, key=lambda p: (p.samples or 0, p.seconds or 0))))
        for (label, mitsuba), points in found.items()
    ]
    return sorted(made, key=lambda curve: -len(curve.points))


def _label(row: Row) -> str:
    name = str(row.get("estimator") or row.get("method") or "")
    told = f"{name}{' stratified' if row.get('stratified') else ''}"
    return told if not is_mitsuba(row) else f"Mitsuba {told}".strip()


@dataclass(frozen=True)
class Race:
    """A row of the race against time: label, seconds and whether that is extrapolated, ours and Mitsuba's at its best.

    Parameters
    ----------
    ratio : float
        How many times as long Mitsuba takes; the least it can be if ``bound``.
    """

    scene: str
    ours: tuple[str, float, bool]
    mitsuba: tuple[str, float, bool]
    ratio: float
    bound: bool


def races(rows: list[Row], error: float = TARGETS[1]) -> list[Race]:
    """What error-against-time found for an error, by scene and pixel rule. Nothing else is a race."""
    found = []
    for row in rows:
        ratio = number(row.get("ratio"))
        if row.get("target") != error or ratio is None:
            continue
        ours, theirs = row["ours"], row["mitsuba"]
        found.append(
            Race(
                f"{row['scene']}, {row['pixel_rule']}",
                (str(ours["estimator"]), float(ours["seconds"]), False),
                (f"Mitsuba {theirs['configuration']}", float(theirs["seconds"]), bool(theirs["extrapolated"])),
                ratio,
                bool(row["lower_bound_only"]),
            )
        )
    return found
