"""From laps to rows: seconds to an error, where a renderer stops, and ratios to Mitsuba's of the same round."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from nusselt.experiments.check.question import PixelRule
from nusselt.experiments.results.figures import curves
from nusselt.experiments.results.schema import Row
from nusselt.experiments.results.seconds_to import seconds_to
from nusselt.experiments.results.work_precision import TARGETS

from .measure import THREADS, Times
from .sides import Lap

BESIDE = "mitsuba"
"""Ratios are to its seconds."""
STOPPED = 0.7
"""Of the error: what four times the samples leave, or more, where a renderer stops getting better. Noise leaves a half,
midpoints less."""
UNTIL = {"measured": "", "at most": "≤", "more than": ">"}
"""Signs of what is known of a time, the worst last."""

Reached = tuple[str, float]
"""One of `UNTIL`, and seconds."""


def reached(target: float, laps: Sequence[Lap]) -> Reached:
    """Processor seconds to an error in one round: between two laps log-log, beyond the last one only a bound."""
    pairs = sorted((lap.processor, lap.error) for lap in laps)
    time = seconds_to(target, pairs)
    if time is None or time.extrapolated:
        return "more than", max(seconds for seconds, _ in pairs)
    worse = any(error > target for _, error in pairs)
    return ("measured" if worse or pairs[0][1] == 0 else "at most"), time.seconds


def stops_at(laps: Sequence[Lap]) -> float | None:
    """The error from which a side with samples gets no better; None: it still does, or too little is known."""
    by_size = medians(laps)
    if len(by_size) < 3 or min(by_size) < 1:
        return None
    before, last = (by_size[size][1] for size in sorted(by_size)[-2:])
    return last if last > STOPPED * before else None


def medians(laps: Sequence[Lap]) -> dict[float, tuple[float, float]]:
    """Processor seconds and error of each size, over rounds."""
    sizes = dict.fromkeys(lap.size for lap in laps)
    found = {size: [(lap.processor, lap.error) for lap in laps if lap.size == size] for size in sizes}
    return {
        size: (float(np.median([s for s, _ in of])), float(np.median([e for _, e in of]))) for size, of in found.items()
    }


def _rounds(laps: Sequence[Lap]) -> dict[int, list[Lap]]:
    return {number: [lap for lap in laps if lap.round == number] for number in dict.fromkeys(lap.round for lap in laps)}


def _target(target: float, own: Mapping[int, Sequence[Lap]], other: Mapping[int, Sequence[Lap]]) -> dict[str, Any]:
    """Of one side at one target."""
    times = {number: reached(target, laps) for number, laps in own.items()}
    beside = {number: reached(target, laps) for number, laps in other.items()}
    known = max((word for word, _ in times.values()), key=list(UNTIL).index)
    seconds = [took for word, took in times.values() if word == known or known != "more than"]
    ratios = [
        took / beside[number][1]
        for number, (word, took) in times.items()
        if number in beside and word == beside[number][0] == "measured"
    ]
    return {
        "target": target,
        "known": known,
        "processor": float((np.max if known == "more than" else np.median)(seconds)),
        "over_mitsuba": float(np.median(ratios)) if ratios else None,
        "over_mitsuba_range": [min(ratios), max(ratios)] if len(ratios) > 1 else None,
    }


def time_rows(scene: str, times: Times) -> list[Row]:
    """A row for each side that has a lap, with its raw laps; it claims nothing."""
    rows: list[Row] = []
    for (name, rule), laps in times.laps.items():
        if not laps:
            continue
        peer, other = times.sides[name, rule].peer, _rounds(times.laps.get((BESIDE, rule), []))
        rows.append(
            {
                "experiment": "cross-times",
                "scene": scene,
                "renderer": name,
                "pixel_rule": rule,
                "threads": THREADS,
                "timed": peer.timed,
                "beware": peer.beware,
                "start": float(np.median([lap.start for lap in laps])),
                "stops_at": stops_at(laps),
                "reached": [_target(target, _rounds(laps), other) for target in TARGETS],
                "laps": [asdict(lap) for lap in laps],
                **({"reason": times.failed[name, rule]} if (name, rule) in times.failed else {}),
            }
        )
    return rows


def time_figure(scene: str, times: Times) -> Any:
    """Error against processor seconds, medians over rounds."""
    lines: dict[str, tuple[list[float], list[float]]] = {}
    for (name, rule), laps in times.laps.items():
        points = [point for _, point in sorted(medians(laps).items(), key=lambda entry: entry[1])]
        if any(error > 0 for _, error in points):
            lines[f"{name}, {_of(rule)}"] = [s for s, _ in points], [e for _, e in points]
    title = f"{scene}: error against rendering time, {THREADS} thread each; most are made for more than direct light"
    return curves(lines, "processor seconds, start-up apart", "RMS error over surfaces, relative", title)


def _of(rule: PixelRule) -> str:
    return {"centre": "centres", "area": "areas"}[rule]
