"""One view of a scene: the truth, then rounds of our images and Mitsuba's, turn by turn."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from nusselt.experiments.check.estimators import noise_free
from nusselt.experiments.results.seconds_to import OurLap
from nusselt.experiments.runs.experiment import NONE_OWN
from nusselt.experiments.runs.own import Own
from nusselt.experiments.studies.race.own import own_laps
from nusselt.experiments.workers import cores, worker_pool
from nusselt.mitsuba_bridge.race import WAYS, Race, Way, run_race
from nusselt.renderer.estimators import CommonPointsFixed, Estimator, Exact
from nusselt.renderer.estimators.protocol import Bounded
from nusselt.renderer.image import Image, render
from nusselt.renderer.pixels import render_area, render_centre
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats

Rule = Literal["centre", "area"]
"""The pixel's centre, or its area."""
COMMON = (8, 13, 21, 34)
"""Light points common to all pixels, for pixels' centres behind big meshes."""
TOLERANCES = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4)
"""Asked of our pixels by area."""
INTERPOLATED = (0.9, 1e-1, 3e-2, 5e-3, 1e-3)
"""Tolerances of interpolation: what is reached is far below what is asked."""

Step = tuple[float, Estimator]
"""Tolerance, 0 for none, and estimator of one of our images."""


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
    enough : float
        Error from which a way needs no more samples.
    timeout : float
        Seconds for all of Mitsuba's images of a round.
    """

    rounds: int = 1
    sizes: tuple[int, ...] = (4, 16, 64, 256)
    truth: float = 3e-5
    longest: float = 5.0
    ways: tuple[Way, ...] = WAYS
    enough: float = 0.0
    timeout: float = 900.0


@dataclass
class Measured:
    """Raw laps of one view.

    Parameters
    ----------
    ours : list of list of OurLap
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
    own : list of list of OurLap
        The user's, round by round.
    """

    ours: list[list[OurLap]] = field(default_factory=list)
    mitsuba: list[Race] = field(default_factory=list)
    truth_error: float = 0.0
    first: float = 0.0
    workers: str = "one process"
    evaluations: dict[str, int] = field(default_factory=dict)
    own: list[list[OurLap]] = field(default_factory=list)


def racer(scene: Scene) -> Estimator | None:
    """The estimator without noise; `Exact` where it goes by silhouettes too; else None."""
    return noise_free(scene) or (None if Exact().is_random(prepare(scene).needs) else Exact())


def by_silhouettes(scene: Scene, estimator: Estimator) -> bool:
    """Whether a scene's shadows are those of big closed meshes: each pixel dear."""
    return estimator.claim(prepare(scene).needs) == "consistent"


def steps(scene: Scene, estimator: Estimator, rule: Rule) -> list[Step]:
    """Our images, fastest first."""
    if rule == "area":
        return [(tolerance, estimator) for tolerance in TOLERANCES]
    if not isinstance(estimator, Bounded) or not by_silhouettes(scene, estimator):
        return [(0.0, estimator)]
    common: list[Step] = [(0.0, CommonPointsFixed(samples=samples)) for samples in COMMON]
    return [*common, (0.0, estimator), *((tolerance, estimator) for tolerance in INTERPOLATED)]


Draw = Callable[[Step, Executor | None], Image]
"""(step, executor) to an image."""


def measure(
    scene: Scene,
    estimator: Estimator,
    rule: Rule,
    plan: Plan,
    seed: int,
    progress: Callable[[int, int], None] | None = None,
    workers: str | None = None,
    own: Own = NONE_OWN,
) -> Measured:
    """Race one view; ``workers`` as another view of the scene found them to be fastest."""
    found = Measured()
    view = scene.with_(spp=16 if rule == "area" else 1)

    def draw(step: Step, executor: Executor | None) -> Image:
        tolerance, chosen = step
        if not tolerance:
            return render(view, chosen, executor=executor)
        make = render_area if rule == "area" else render_centre
        made = make(view, chosen, tolerance=tolerance, executor=executor)
        found.evaluations[f"{tolerance:g}"] = made.evaluations
        return made.image

    ladder = steps(scene, estimator, rule)
    with _pools() as pools:
        started = time.perf_counter()
        draw(ladder[0], None)
        found.first = time.perf_counter() - started
        truth, judged = _truth(view, estimator, rule, plan, pools["processes"], found)
        dear = rule != "area" and by_silhouettes(scene, estimator)
        workers = workers or ("processes" if dear else None)
        found.workers = workers or _fastest_pool(lambda pool: draw(ladder[len(ladder) // 2], pool), pools)
        draw(ladder[0], pools[found.workers])  # each worker's first image is apart
        for number in range(plan.rounds):
            found.ours.append(list(_laps(draw, ladder, pools[found.workers], truth, judged)))
            found.mitsuba.append(
                run_race(
                    view,
                    truth,
                    judged,
                    sizes=plan.sizes,
                    seed=seed + number,
                    ways=plan.ways,
                    longest=plan.longest,
                    enough=plan.enough,
                    timeout=plan.timeout,
                )
            )
            laps = own_laps(
                own,
                view,
                truth,
                judged,
                sizes=plan.sizes,
                longest=plan.longest,
                seed=seed + number,
                executor=pools[found.workers],
            )
            found.own.append(laps)
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
    if rule != "area":
        image = render(view, estimator, executor=executor)
        return image.mean, image.shaded
    area = render_area(view, estimator, tolerance=plan.truth, executor=executor)
    found.truth_error = area.error
    return area.image.mean, (area.image.emitter == 0) & (area.image.background < 1)


def _fastest_pool(draw: Callable[[Executor | None], Image], pools: dict[str, Executor | None]) -> str:
    """Which executor is fastest, the first image of each apart."""
    seconds = {}
    for name, executor in pools.items():
        times = []
        for _ in range(3):
            started = time.perf_counter()
            draw(executor)
            times.append(time.perf_counter() - started)
        seconds[name] = min(times[1:])
    return min(seconds, key=lambda name: seconds[name])


def _laps(
    draw: Draw, ladder: Sequence[Step], executor: Executor | None, truth: Floats, judged: Any
) -> Iterator[OurLap]:
    norm = float((truth[:, judged] ** 2).sum())
    for step in ladder:
        started = time.perf_counter()
        image = draw(step, executor)
        seconds = time.perf_counter() - started
        error = float(np.sqrt(((image.mean - truth)[:, judged] ** 2).sum() / max(norm, 1e-300)))
        yield OurLap(step[1].name, step[0], seconds, error)
