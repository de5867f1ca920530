"""A scene's sensors read and judged: a row each."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from nusselt.experiments.check.check import seeds
from nusselt.experiments.check.question import MOST_SEED, chosen_estimator, number_within, whole_within
from nusselt.experiments.results.schema import Row
from nusselt.experiments.verdict.expected import Difference
from nusselt.mitsuba_bridge.process import ReferenceUnavailable
from nusselt.mitsuba_bridge.sensors import SensorReference, sensors_by_mitsuba
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Estimator
from nusselt.renderer.image import Image, read_sensors
from nusselt.renderer.lights import Light
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene

from .judge import against_expected, against_mitsuba

PILOT = 16
MOST = 4096
"""Passes of ours: of the pilot, and at most."""
SHARE = 10.0
"""Of the margin: what each side's noise is brought to, if time allows."""

AS_CLAIMED = {"agrees": True, "differs": False, "undecided": None}
"""Of readings that claim no bias."""

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class SensorQuestion:
    """What is asked of a scene's sensors.

    Parameters
    ----------
    estimator : str or class, optional
        Ours; the exact one unless said.
    samples, stratified
        As in `nusselt.experiments.check.question.Question`.
    margin : float
        Relative difference from Mitsuba that does not matter.
    alpha : float
        Chance that any right sensor of the scene is called different.
    seed : int
    timeout : float
        Seconds for each side.
    mitsuba : bool
        Whether Mitsuba is asked.

    Raises
    ------
    InputError
    """

    estimator: str | type[Estimator] | None = "exact"
    samples: int | None = None
    stratified: bool | None = None
    margin: float = 1e-3
    alpha: float = 1e-3
    seed: int = 0
    timeout: float = 600.0
    mitsuba: bool = True

    def __post_init__(self) -> None:
        number_within("margin", self.margin, 0, 1)
        number_within("alpha", self.alpha, 0, 1)
        number_within("timeout", self.timeout, 0, math.inf)
        whole_within("seed", self.seed, 0, MOST_SEED)


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
    estimator = chosen_estimator(scene, question.estimator, question.samples, question.stratified)
    _refuse_at_lights(scene)
    _, first, second = seeds(question.seed, scene.name, estimator.name)

    def telling(what: str) -> Callable[[int, int], None]:
        return lambda done, total: progress(what, done, total) if progress else None

    started = time.perf_counter()
    ours, passes = _ours(scene, estimator, question, first, executor, telling("ours"))
    seconds = {"ours": time.perf_counter() - started}
    tests = 2 if any(sensor.expected is not None for sensor in scene.sensors) else 1
    reference, why = None, ""
    if question.mitsuba:
        started = time.perf_counter()
        try:
            reference = sensors_by_mitsuba(scene, seed=second, timeout=question.timeout, progress=telling("Mitsuba"))
        except ReferenceUnavailable as problem:
            why = str(problem)
        seconds["reference"] = time.perf_counter() - started
    level = question.alpha / tests
    compared = None
    if reference is not None:
        compared = against_mitsuba(ours, passes, estimator.samples, reference, question.margin, level)
    head: Row = {
        "experiment": "sensors",
        "scene": scene.name,
        "estimator": estimator.name,
        "claim": estimator.claim(prepare(scene, everything=True).needs),
        "samples": estimator.samples,
        "stratified": estimator.stratified,
        "passes": passes,
        "margin": question.margin,
        "seed": question.seed,
        "command": command,
        "warnings": list(scene.warnings),
        "seconds": seconds,
    }
    return _rows(
        head, scene, ours, passes, reference, why, compared, against_expected(ours, passes, scene.sensors, level)
    )


def _refuse_at_lights(scene: Scene) -> None:
    """Where a light without extent stands, irradiance has no bound."""
    places = {tuple(light.anchored()[:, 0].tolist()) for light in scene.lights if _is_a_point(light)}
    for number, sensor in enumerate(scene.sensors, start=1):
        if sensor.position in places:
            raise InputError(
                f"sensor {number}", f"{sensor.position}, where a light is", "a place without a point light"
            )


def _is_a_point(light: Light) -> bool:
    return not light.has_extent and not light.at_infinity


def _ours(
    scene: Scene,
    estimator: Estimator,
    question: SensorQuestion,
    seed: int,
    executor: Executor | None,
    progress: Callable[[int, int], None],
) -> tuple[Image, int]:
    """Readings in as many passes as bring their noise below a share of the margin."""
    if not estimator.is_random(prepare(scene, everything=True).needs):
        return read_sensors(scene, estimator, seed=seed, executor=executor, progress=progress), 1
    started = time.perf_counter()
    pilot = read_sensors(scene, estimator, seed=seed + 1, passes=PILOT, executor=executor)
    each = (time.perf_counter() - started) / PILOT
    mean = pilot.mean[:, 0].mean(axis=0)
    lit = mean > 0
    one = float((np.sqrt(pilot.pixel_variance[0][lit]) / mean[lit]).max()) if lit.any() else 0.0
    passes = min(MOST, math.ceil((one * SHARE / question.margin) ** 2), int(question.timeout / max(each, 1e-9)))
    passes = max(PILOT, passes)
    return read_sensors(scene, estimator, seed=seed, passes=passes, executor=executor, progress=progress), passes


def _rows(
    head: Row,
    scene: Scene,
    ours: Image,
    passes: int,
    reference: SensorReference | None,
    why: str,
    compared: Difference | None,
    expected: Difference | None,
) -> list[Row]:
    error = np.sqrt(ours.variance[:, 0] / passes)
    expecting = itertools.count()  # their differences stand in the sensors' order
    found = []
    for k, sensor in enumerate(scene.sensors):
        row = head | {
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
        elif why:
            row["reference"] = {"renderer": None, "notes": [why]}
        if sensor.expected is not None and expected is not None:
            number = next(expecting)
            row |= {"expected_reading": list(sensor.expected), "expected_percent": sensor.percent}
            row["expected_interval"] = expected.ends(number)
            said.append(expected.said("expected", number))
        words = [word for word, _ in said]
        verdict = next((word for word in ("differs", "undecided", "agrees") if word in words), None)
        if verdict:
            row["verdict"] = verdict
        if verdict or why:
            row["as_claimed"] = head["claim"] == "biased" or AS_CLAIMED[verdict or "undecided"]
        found.append(row | {"reason": "; ".join(reason for _, reason in said) or why})
    return found


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
