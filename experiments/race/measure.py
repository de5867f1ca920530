"""One view of a scene: the truth, then rounds of our images and Mitsuba's, turn by turn."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from mitsuba_bridge.race import WAYS, Race, Way, run_race
from renderer.coverage import render_area
from renderer.estimators import ESTIMATORS, Estimator
from renderer.image import Image, prepare, render
from renderer.scene import Scene
from renderer.vectors import Floats

from ..workers import cores, worker_pool

Rule = Literal["centre", "area"]
TOLERANCES = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4)
"""Asked of our pixels by area."""


@dataclass(frozen=True)
class Plan:
    """How much is measured.

    Parameters
    ----------
    rounds : int
        Turns of both sides.
    sizes : tuple of int
        Mitsuba's samples a pixel.
    truth : float
        Tolerance of the truth, for pixels by area.
    longest : float
        Seconds one of Mitsuba's images may take.
    ways : tuple of Way
        How Mitsuba is run.
    """

    rounds: int = 3
    sizes: tuple[int, ...] = (4, 16, 64, 256, 1024)
    truth: float = 1e-5
    longest: float = 20.0
    ways: tuple[Way, ...] = WAYS


@dataclass
class Measured:
    """Raw laps of one view.

    Parameters
    ----------
    ours : list of list of (tolerance, seconds, error)
        Round by round.
    mitsuba : list of Race
        Round by round.
    truth_error : float
        Estimated relative RMS error of the truth.
    first : float
        Seconds of our first image, apart.
    workers : str
        What was fastest: one process, threads or processes.
    evaluations : dict
        Points shaded by tolerance.
    """

    ours: list[list[tuple[float, float, float]]] = field(default_factory=list)
    mitsuba: list[Race] = field(default_factory=list)
    truth_error: float = 0.0
    first: float = 0.0
    workers: str = "one process"
    evaluations: dict[str, int] = field(default_factory=dict)


def noise_free(scene: Scene) -> Estimator | None:
    """The first estimator that is exact for a scene and not random; None if there is none."""
    _, needs = prepare(scene)
    for kind in ESTIMATORS:
        estimator = kind()
        if estimator.claim(needs) == "exact" and not estimator.is_random(needs):
            return estimator
    return None


Draw = Callable[[float, Executor | None], Image]
"""(tolerance, executor) to an image."""


def measure(
    scene: Scene, estimator: Estimator, rule: Rule, plan: Plan, seed: int, progress: Callable[[int, int], None] | None
) -> Measured:
    """Race one view."""
    found = Measured()
    view = scene.with_(spp=16 if rule == "area" else 1)

    def draw(tolerance: float, executor: Executor | None) -> Image:
        if rule == "centre":
            return render(view, estimator, executor=executor)
        area = render_area(view, estimator, tolerance=tolerance, executor=executor)
        found.evaluations[f"{tolerance:g}"] = area.evaluations
        return area.image

    with _pools() as pools:
        started = time.perf_counter()
        draw(TOLERANCES[0], None)
        found.first = time.perf_counter() - started
        truth, judged = _truth(view, estimator, rule, plan, pools["processes"], found)
        found.workers = _fastest_pool(draw, pools)
        for number in range(plan.rounds):
            found.ours.append(list(_laps(draw, rule, pools[found.workers], truth, judged)))
            found.mitsuba.append(
                run_race(
                    view, truth, judged, sizes=plan.sizes, seed=seed + number, longest=plan.longest, ways=plan.ways
                )
            )
            if progress:
                progress(number + 1, plan.rounds)
    return found


@contextmanager
def _pools() -> Iterator[dict[str, Executor | None]]:
    with worker_pool() as processes, ThreadPoolExecutor(cores()) as threads:
        yield {"one process": None, "threads": threads, "processes": processes}


def _truth(
    view: Scene, estimator: Estimator, rule: Rule, plan: Plan, executor: Executor | None, found: Measured
) -> tuple[Floats, Any]:
    """The truth, and the pixels that are judged: not touched by a light, and by area at least partly shaded."""
    if rule == "centre":
        image = render(view, estimator, executor=executor)
        return image.mean, image.shaded
    area = render_area(view, estimator, tolerance=plan.truth, executor=executor)
    found.truth_error = area.error
    return area.image.mean, (area.image.emitter == 0) & (area.image.background < 1)


def _fastest_pool(draw: Draw, pools: dict[str, Executor | None]) -> str:
    """Which executor is fastest, the first image of each apart."""
    seconds = {}
    for name, executor in pools.items():
        times = []
        for _ in range(3):
            started = time.perf_counter()
            draw(1e-3, executor)
            times.append(time.perf_counter() - started)
        seconds[name] = min(times[1:])
    return min(seconds, key=lambda name: seconds[name])


def _laps(
    draw: Draw, rule: Rule, executor: Executor | None, truth: Floats, judged: Any
) -> Iterator[tuple[float, float, float]]:
    tolerances: Sequence[float] = TOLERANCES if rule == "area" else (0.0,)
    norm = float((truth[:, judged] ** 2).sum())
    for tolerance in tolerances:
        started = time.perf_counter()
        image = draw(tolerance, executor)
        seconds = time.perf_counter() - started
        yield tolerance, seconds, float(np.sqrt(((image.mean - truth)[:, judged] ** 2).sum() / max(norm, 1e-300)))
