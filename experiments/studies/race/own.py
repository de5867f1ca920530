"""The user's estimators and renderers in the race: their laps against the same truth, and their rows."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from typing import Any

import numpy as np

from nusselt.experiments.results.seconds_to import OurLap, Time, fastest, seconds_to
from nusselt.experiments.runs.own import Own
from nusselt.renderer.estimators import Estimator
from nusselt.renderer.image import render
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats

Shot = Callable[[int], tuple[Floats, float]]
"""Samples a pixel to radiance (3, h, w) and seconds."""


@contextmanager
def shots(own: Own, view: Scene, seed: int, executor: Executor | None) -> Iterator[dict[str, Shot]]:
    """What makes an image of a view, by name; programs are open one after the other."""
    found: dict[str, Shot] = {}
    for one in own.estimators:
        for name, make in one.ways(view).items():
            found[name] = _estimated(view, make, seed, executor)
    with_programs = {one.name: one for one in own.renderers}

    def program(name: str) -> Shot:
        def shot(samples: int) -> tuple[Floats, float]:
            with with_programs[name].opened(view) as image:
                return image(samples, seed + samples)

        return shot

    yield found | {name: program(name) for name in with_programs}


def _estimated(view: Scene, make: Callable[[int], Estimator], seed: int, executor: Executor | None) -> Shot:
    """A pixel's box has as many rays as samples, each with one point on a light; a pixel's centre that many points."""

    def shot(samples: int) -> tuple[Floats, float]:
        scene, estimator = (view.with_(spp=samples), make(1)) if view.spp > 1 else (view, make(samples))
        prepare(scene)
        started = time.perf_counter()
        image = render(scene, estimator, seed=seed + samples, executor=executor)
        return image.mean, time.perf_counter() - started

    return shot


def own_laps(
    own: Own,
    view: Scene,
    truth: Floats,
    judged: Any,
    *,
    sizes: Sequence[int],
    longest: float,
    seed: int,
    executor: Executor | None,
) -> list[OurLap]:
    """Images with more and more samples, as long as none may be expected to take longer than ``longest`` seconds."""
    norm = max(float((truth[:, judged] ** 2).sum()), 1e-300)
    laps = []
    with shots(own, view, seed, executor) as named:
        for name, shot in named.items():
            shot(sizes[0])  # the first is apart
            for size, following in zip(sizes, (*sizes[1:], 0), strict=True):
                image, seconds = shot(size)
                error = float(np.sqrt(np.nansum((image - truth)[:, judged] ** 2) / norm))
                laps.append(OurLap(name, 0.0, seconds, error))
                if seconds * following / size > longest:
                    break
    return laps


def own_row(
    scene: str,
    rule: str,
    target: float,
    name: str,
    rounds: Sequence[tuple[Sequence[OurLap], dict[str, list[tuple[float, float]]]]],
) -> dict[str, Any]:
    """The row of one of them at one target: its time, Mitsuba's at its best, and their ratio.

    Parameters
    ----------
    rounds : sequence
        Of each view and round: its laps, and Mitsuba's (seconds, error) by configuration.
    """
    times: list[tuple[Time, Time]] = []
    for laps, mitsuba in rounds:
        reached = seconds_to(target, sorted((lap.seconds, lap.error) for lap in laps if lap.estimator == name))
        best = fastest(target, mitsuba)
        if reached is not None and best is not None:
            times.append((reached, best[1]))
    ratios = [theirs.seconds / reached.seconds for reached, theirs in times]
    return {
        "scene": scene,
        "pixel_rule": rule,
        "target": target,
        "estimator": name,
        "own": {
            "seconds": _median([reached.seconds for reached, _ in times]),
            "extrapolated": any(reached.extrapolated for reached, _ in times),
            "lower_bound_only": any(reached.bound for reached, _ in times),
        },
        "mitsuba": {
            "seconds": _median([theirs.seconds for _, theirs in times]),
            "extrapolated": any(theirs.extrapolated for _, theirs in times),
            "lower_bound_only": any(theirs.bound for _, theirs in times),
        },
        "mitsuba_over_own": _median(ratios),
        "mitsuba_over_own_interval": [min(ratios), max(ratios)] if len(ratios) > 1 else None,
        "views": len(rounds),
        "note": "the user's own; its time is shown, and nothing is claimed of it but that it was measured",
        "as_claimed": bool(times) and all(np.isfinite(lap.error) for laps, _ in rounds for lap in laps),
    }


def _median(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if values else None
