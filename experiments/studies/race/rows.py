"""From raw laps to rows: time to a target, ours and Mitsuba's, and their ratio over views and rounds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from nusselt.experiments.results.seconds_to import Time, fastest, fastest_of_ours, seconds_to
from nusselt.experiments.studies.race.measure import Measured
from nusselt.experiments.studies.race.own import own_row
from nusselt.mitsuba_bridge.race import DEFAULT, Way

TARGETS = (1e-2, 1e-3, 1e-4)
EVERY = "centre, every pixel"
"""Pixels' centres without interpolation."""
GOALS = {
    ("cornell-boxes", "area", 1e-2): 1.0,
    ("cornell-boxes", "area", 1e-3): 20.0,
    ("cornell-boxes", "area", 1e-4): 200.0,
    ("cornell", "area", 1e-3): 10.0,
    ("quad", "area", 1e-3): 30.0,
    ("near-light", "area", 1e-3): 300.0,
    ("mesh", "centre", 1e-2): 1.0,
    ("mesh", "centre", 1e-3): 5.0,
    ("mesh", "centre", 1e-4): 30.0,
    ("mesh", "area", 1e-3): 3.0,
    ("mesh", EVERY, 1e-3): 2.0,
}
"""Ratios aimed at; shown, never judged: they are times."""
SENTENCE = "Ours is a method for direct light from polygons; Mitsuba is a general renderer."


def _by_way(found: Measured, number: int) -> dict[str, list[tuple[float, float]]]:
    laps: dict[str, list[tuple[float, float]]] = {}
    for lap in found.mitsuba[number].laps:
        laps.setdefault(lap.way.name, []).append((lap.seconds, lap.error))
    return laps


def _round(found: Measured, number: int, target: float) -> dict[str, Any]:
    """Both sides' times in one round."""
    ours = fastest_of_ours(target, found.ours[number])
    ways = _by_way(found, number)
    best = fastest(target, ways)
    default = seconds_to(target, sorted(ways.get(DEFAULT.name, [])))
    return {"ours": ours, "best": best, "default": default}


FINALISTS = 3
"""Ways of Mitsuba that go on after a scene's first view, for each target; and its default."""


def finalists(found: Measured) -> tuple[Way, ...]:
    """The ways that came to the targets first in one view: those raced on the scene's other views."""
    kept = {DEFAULT}
    for number in range(len(found.mitsuba)):
        times = {lap.way: lap.way.name for lap in found.mitsuba[number].laps}
        laps = _by_way(found, number)
        for target in TARGETS:
            reached = {way: seconds_to(target, sorted(laps[name])) for way, name in times.items()}
            timed = [(time.seconds, way.name, way) for way, time in reached.items() if time is not None]
            kept |= {way for _, _, way in sorted(timed)[:FINALISTS]}
    return tuple(sorted(kept, key=lambda way: way.name))


def row(scene: str, rule: str, target: float, estimator: str, views: Sequence[Measured]) -> dict[str, Any]:
    """One row over all views of a scene.

    The ratio is the median over views and rounds, its interval from the smallest to the largest of them, none where
    there is but one. It is a lower bound where one of the times it rests on is.
    """
    rounds = [(_round(found, n, target)) for found in views for n in range(len(found.ours))]
    known = [entry for entry in rounds if entry["ours"] and entry["best"]]
    ratios = [entry["best"][1].seconds / entry["ours"].seconds for entry in known]
    complete = bool(rounds) and len(known) == len(rounds)
    ways = [entry["best"][0] for entry in known]
    mine = [entry["ours"].estimator for entry in known]
    goal = GOALS.get((scene, rule, target))
    asked = [
        (lap.tolerance, lap.tolerance + found.truth_error, lap.error)
        for found in views
        for laps in found.ours
        for lap in laps
    ]
    return {
        "scene": scene,
        "pixel_rule": rule,
        "target": target,
        "ours": {
            "estimator": max(set(mine), key=mine.count) if mine else estimator,
            "seconds": _median([entry["ours"].seconds for entry in known]),
        },
        "mitsuba": {
            "configuration": max(set(ways), key=ways.count) if ways else None,
            "seconds": _median([entry["best"][1].seconds for entry in known]),
            "extrapolated": any(entry["best"][1].extrapolated for entry in known),
        },
        "mitsuba_default": _told([entry["default"] for entry in known]),
        "ratio": _median(ratios) if complete else None,
        "ratio_interval": [min(ratios), max(ratios)] if complete and len(ratios) > 1 else None,
        "lower_bound_only": any(entry["best"][1].bound for entry in known),
        "goal": goal,
        "within_goal": None if goal is None or not complete else bool(min(ratios) >= goal),
        "views": len(views),
        "truth_error": max((found.truth_error for found in views), default=None),
        "worst_error_over_tolerance": max((error / most for tol, most, error in asked if tol), default=None),
        "note": SENTENCE,
        # What is claimed is the error, on every view and at every tolerance, beside the truth's own; a time is shown.
        "as_claimed": complete and all(error <= most for tol, most, error in asked if tol),
    }


def own_rows(scene: str, rule: str, target: float, views: Sequence[Measured]) -> list[dict[str, Any]]:
    """Rows of the user's estimators and renderers at one target, over all views and rounds."""
    rounds = [(laps, _by_way(found, n)) for found in views for n, laps in enumerate(found.own)]
    names = dict.fromkeys(lap.estimator for laps, _ in rounds for lap in laps)
    return [own_row(scene, rule, target, name, rounds) for name in names]


def without_interpolation(found: Measured) -> Measured:
    """What was measured of a view's centres, all of which were evaluated."""
    return replace(found, ours=[[lap for lap in laps if not lap.tolerance] for laps in found.ours])


def _median(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if values else None


def _told(times: Sequence[Time | None]) -> dict[str, Any]:
    known = [time for time in times if time is not None]
    return {
        "configuration": DEFAULT.name,
        "seconds": _median([time.seconds for time in known]),
        "extrapolated": any(time.extrapolated for time in known),
        "lower_bound_only": any(time.bound for time in known),
    }


def raw(found: Measured) -> dict[str, Any]:
    """Everything that was measured in one view, as JSON types."""
    return {
        "ours": [[asdict(lap) for lap in laps] for laps in found.ours],
        "mitsuba": [
            [
                {"configuration": lap.way.name, "samples": lap.samples, "seconds": lap.seconds, "error": lap.error}
                for lap in race.laps
            ]
            for race in found.mitsuba
        ],
        "once": {"ours": found.first, "mitsuba": [race.once for race in found.mitsuba]},
        "workers": found.workers,
        "evaluations": found.evaluations,
        "own": [[asdict(lap) for lap in laps] for laps in found.own],
        "truth_error": found.truth_error,
    }
