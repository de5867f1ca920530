"""Orders of convergence: -1/2 for random samples, -3/4 in penumbrae and -1 without them for strata."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from nusselt.experiments.results.figures import curves
from nusselt.experiments.results.work_precision import slope
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.experiments.runs.measure import Truth, measured, truth_of
from nusselt.experiments.runs.own import Own
from nusselt.experiments.scenes.sizes import small
from nusselt.renderer.estimators import Area, Estimator
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats

SIDES = (2, 3, 4, 6, 8, 11, 16, 23)
KINDS = {"random": False, "stratified": True}


def fit(scene: Scene, sides: Sequence[int], repeats: int, seed: int, own: Own) -> Outcome:
    """Slope of log RMS over log N with its interval; every point has its own seed."""
    truth = truth_of(scene, seed, samples=4 * max(sides) ** 2)
    points = [(repeat, side) for repeat in range(repeats) for side in sides]
    counts = [side * side for _, side in points]
    rows, arrays = [], {}

    def errors_of(make: Callable[[int], Estimator]) -> list[float]:
        return [
            measured(scene, make(side * side), truth, seed + 1 + side + 1000 * repeat, passes=2)[0]["rms_relative"]
            for repeat, side in points
        ]

    def add(name: str, series: str, stratified: bool | None, errors: list[float], right: Right) -> None:
        value, low, high = slope(np.array(counts, dtype=float), np.array(errors)) if min(errors) > 0 else NO_SLOPE
        row: dict[str, Any] = {
            "scene": scene.name,
            "estimator": name,
            "stratified": stratified,
            "truth": truth.name,
            "series": series,
        }
        row |= {"slope": value, "slope_low": low, "slope_high": high, "rms_relative": errors[-1]}
        rows.append(row | {"as_claimed": right(value)})
        arrays[series] = np.array([counts, errors])

    for series, stratified in KINDS.items():
        errors = errors_of(area(stratified))
        add("area", series, stratified, errors, partial(as_area_should, stratified))
    for one in own.estimators:
        for series, make in one.ways(scene).items():
            claim = make(1).claim(prepare(scene).needs)
            add(one.name, series, None, errors_of(make), partial(as_claimed_by, claim))
    for program in own.renderers:
        with program.opened(scene) as image:
            images = [image(side * side, seed + 1 + side + 1000 * repeat)[0] for repeat, side in points]
        add(
            program.name, program.name, None, [rms_of(one, truth) for one in images], partial(as_claimed_by, "unbiased")
        )
    return Outcome(rows, arrays)


def area(stratified: bool) -> Callable[[int], Estimator]:
    """Area sampling, by the number of samples."""
    return lambda samples: Area(samples=samples, stratified=stratified)


Right = Callable[[float | None], bool]
NO_SLOPE = (None, None, None)


def as_area_should(stratified: bool, value: float | None) -> bool:
    """Random: the central limit. Strata: better than that, no better than smooth integrands allow."""
    return value is not None and (-1.1 < value < -0.55 if stratified else abs(value + 0.5) < 0.05)


def as_claimed_by(claim: str, value: float | None) -> bool:
    """Noise alone falls as N^-1/2 at least; what claims no error, or a bias that stays, is held to no order."""
    return claim in ("exact", "biased") or value is None or value < -0.4


def rms_of(image: Floats, truth: Truth) -> float:
    """Relative RMS error of one image (3, h, w), the truth's noise taken out."""
    difference = (image - truth.mean).mean(axis=0)[truth.shaded]
    return math.sqrt(max(float((difference**2 - truth.noise[truth.shaded]).mean()), 0.0)) / truth.level


def jobs(settings: Settings) -> list[Job]:
    """One a scene."""
    width, sides, repeats = settings.pick((96, SIDES, 3), (40, SIDES[:5], 2), (8, SIDES[:3], 1))
    shared = {"sides": sides, "repeats": repeats, "own": settings.own}
    return [
        Job(fit, {"scene": small(s, width), "seed": settings.seed_of(s.name), **shared})
        for s in settings.chosen(CONVERGENCE.scenes)
    ]


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Error against samples, one a scene."""
    found = {}
    for outcome in outcomes:
        lines = {}
        for row in outcome.rows:
            counts, errors = outcome.arrays[row["series"]]
            label = row["series"]
            if row["slope"] is not None:
                label += f": {row['slope']:.3f} [{row['slope_low']:.3f}, {row['slope_high']:.3f}]"
            lines[label] = (counts.tolist(), errors.tolist())
        scene, truth = outcome.rows[0]["scene"], outcome.rows[0]["truth"]
        title = f"{scene}: error against {truth}; slopes with their 99 % intervals"
        figure = curves(lines, "samples per light", "relative RMS of a pixel", title)
        for line in figure.axes[0].lines:
            line.set_linestyle("none")
        found[scene] = figure
    return found


CONVERGENCE = Experiment(
    "convergence",
    "orders of convergence, random and stratified, with intervals",
    jobs,
    figures,
    ("quad", "three-lights"),
    takes_own=True,
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(CONVERGENCE)
