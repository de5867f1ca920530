"""A scene's sensors judged: a row each."""

from __future__ import annotations

import itertools
from concurrent.futures import Executor

import numpy as np

from nusselt.experiments.results.schema import Row
from nusselt.experiments.verdict.decision import AS_CLAIMED
from nusselt.mitsuba_bridge.sensors import SensorReference
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene

from .judge import against_expected, against_mitsuba
from .question import SensorQuestion
from .readings import Progress, Readings, take


def read(
    scene: Scene,
    question: SensorQuestion,
    *,
    command: str,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> list[Row]:
    """Read a scene's sensors on both sides, and judge each.

    Raises
    ------
    InputError
        If it has none.
    """
    readings = take(scene, question, executor, progress)
    estimator = readings.estimator
    head: Row = {
        "experiment": "sensors",
        "scene": scene.name,
        "estimator": estimator.name,
        "claim": estimator.claim(prepare(scene, everything=True).needs),
        "samples": estimator.samples,
        "stratified": estimator.stratified,
        "passes": readings.passes,
        "margin": question.margin,
        "seed": question.seed,
        "command": command,
        "warnings": list(scene.warnings),
        "seconds": readings.seconds,
    }
    return [head | entries for entries in _judged(scene, readings, question, head["claim"] == "biased")]


def _judged(scene: Scene, readings: Readings, question: SensorQuestion, biased: bool) -> list[Row]:
    """What each sensor's row says of itself."""
    ours, passes, reference = readings.ours, readings.passes, readings.reference
    tests = 2 if any(sensor.expected is not None for sensor in scene.sensors) else 1
    level = question.alpha / tests
    compared = None
    if reference is not None:
        compared = against_mitsuba(ours, passes, readings.estimator.samples, reference, question.margin, level)
    expected = against_expected(ours, passes, scene.sensors, level)
    error = np.sqrt(ours.variance[:, 0] / passes)
    expecting = itertools.count()  # their differences stand in the sensors' order
    rows = []
    for k, sensor in enumerate(scene.sensors):
        row: Row = {
            "sensor": k + 1,
            "position": list(sensor.position),
            "normal": list(sensor.normal),
            "reading": ours.mean[:, 0, k].tolist(),
            "reading_standard_error": error[:, k].tolist(),
        }
        said: list[tuple[str, str]] = []
        if reference is not None and compared is not None:
            row |= _reference_entries(reference, k) | {"difference_interval": compared.ends(k)}
            said.append(_excused(compared.said("Mitsuba", k), reference, k))
        elif readings.missing:
            row["reference"] = {"renderer": None, "notes": [readings.missing]}
        if sensor.expected is not None and expected is not None:
            number = next(expecting)
            row |= {"expected_reading": list(sensor.expected), "expected_percent": sensor.percent}
            row["expected_interval"] = expected.ends(number)
            said.append(expected.said("expected", number))
        rows.append(row | _verdict(said, readings.missing, biased))
    return rows


def _verdict(said: list[tuple[str, str]], missing: str, biased: bool) -> Row:
    """The worst of what is said of a sensor, and every reason."""
    words = [word for word, _ in said]
    verdict = next((word for word in ("differs", "undecided", "agrees") if word in words), None)
    row: Row = {"verdict": verdict} if verdict else {}
    if verdict or missing:
        row["as_claimed"] = biased or AS_CLAIMED[verdict or "undecided"]
    return row | {"reason": "; ".join(reason for _, reason in said) or missing}


def _reference_entries(reference: SensorReference, k: int) -> Row:
    return {
        "reference": {
            "renderer": "mitsuba",
            "version": reference.version,
            "variant": reference.variant,
            "samples": reference.samples,
            "passes": reference.passes,
            "limits": list(reference.limits),
        },
        "reference_reading": reference.mean[:, k].tolist(),
        "reference_standard_error": reference.standard_error[:, k].tolist(),
    }


def _excused(said: tuple[str, str], reference: SensorReference, k: int) -> tuple[str, str]:
    """Where Mitsuba may be wrong itself, a difference is none of ours."""
    word, reason = said
    limits = list(reference.limits)
    if reference.too_close[k]:
        limits.insert(0, "a surface is before it, closer than Mitsuba's shadow rays start")
    return ("undecided", f"{reason} ({limits[0]})") if word == "differs" and limits else said
