"""A scene's sensors read: by ours, in as many passes as its noise needs, and by Mitsuba."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from nusselt.experiments.check.check import seeds
from nusselt.experiments.check.question import chosen_estimator
from nusselt.mitsuba_bridge.process import ReferenceUnavailable
from nusselt.mitsuba_bridge.sensors import SensorReference, sensors_by_mitsuba
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Estimator
from nusselt.renderer.image import Image, read_sensors
from nusselt.renderer.lights import Light
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene

from .question import SensorQuestion

PILOT = 16
MOST = 4096
"""Passes of ours: of the pilot, and at most."""
SHARE = 10.0
"""Of the margin: what each side's noise is brought to, if time allows."""

Progress = Callable[[str, int, int], None]
"""Of what, how much is done, and of how much."""


@dataclass(frozen=True)
class Readings:
    """Of both sides.

    Parameters
    ----------
    estimator : Estimator
        Ours.
    ours : Image
        Of one row, from `read_sensors`.
    passes : int
        Of ours.
    reference : SensorReference, optional
    missing : str
        Why there is no reference, where one was asked for.
    seconds : dict
        By side.
    """

    estimator: Estimator
    ours: Image
    passes: int
    reference: SensorReference | None
    missing: str
    seconds: dict[str, float]


def take(scene: Scene, question: SensorQuestion, executor: Executor | None, progress: Progress | None) -> Readings:
    """Read a scene's sensors on both sides.

    Raises
    ------
    InputError
        If it has none, or one where a light without extent is.
    """
    estimator = chosen_estimator(scene, question.estimator, question.samples, question.stratified)
    _refuse_at_lights(scene)
    _, first, second = seeds(question.seed, scene.name, estimator.name)

    def telling(what: str) -> Callable[[int, int], None]:
        return lambda done, total: progress(what, done, total) if progress else None

    started = time.perf_counter()
    ours, passes = _ours(scene, estimator, question, first, executor, telling("ours"))
    seconds = {"ours": time.perf_counter() - started}
    reference, missing = None, ""
    if question.mitsuba:
        started = time.perf_counter()
        try:
            reference = sensors_by_mitsuba(scene, seed=second, timeout=question.timeout, progress=telling("Mitsuba"))
        except ReferenceUnavailable as problem:
            missing = str(problem)
        seconds["reference"] = time.perf_counter() - started
    return Readings(estimator, ours, passes, reference, missing, seconds)


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
