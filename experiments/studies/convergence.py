"""Orders of convergence: -1/2 for random samples, -3/4 in penumbrae and -1 without them for strata."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from nusselt.experiments.results.figures import curves
from nusselt.experiments.results.work_precision import slope
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.experiments.runs.measure import measured, small, truth_of
from nusselt.renderer.estimators import Area
from nusselt.renderer.scene import Scene

SIDES = (2, 3, 4, 6, 8, 11, 16, 23)
KINDS = {"random": False, "stratified": True}


def fit(scene: Scene, sides: Sequence[int], repeats: int, seed: int) -> Outcome:
    """Slope of log RMS over log N with its interval; every point has its own seed."""
    truth = truth_of(scene, seed, samples=4 * max(sides) ** 2)
    rows, arrays = [], {}
    for name, stratified in KINDS.items():
        counts, errors = [], []
        for repeat in range(repeats):
            for side in sides:
                estimator = Area(samples=side * side, stratified=stratified)
                found, _ = measured(scene, estimator, truth, seed + 1 + side + 1000 * repeat, passes=2)
                counts.append(side * side)
                errors.append(found["rms_relative"])
        value, low, high = slope(np.array(counts, dtype=float), np.array(errors))
        row = {"scene": scene.name, "estimator": "area", "stratified": stratified, "truth": truth.name}
        row |= {"slope": value, "slope_low": low, "slope_high": high}
        # Random: the central limit. Strata: better than that, no better than smooth integrands allow.
        right = abs(value + 0.5) < 0.05 if not stratified else -1.1 < value < -0.55
        rows.append(row | {"as_claimed": bool(right)})
        arrays[name] = np.array([counts, errors])
    return Outcome(rows, arrays)


def jobs(settings: Settings) -> list[Job]:
    width, sides, repeats = settings.pick((96, SIDES, 3), (40, SIDES[:5], 2), (8, SIDES[:3], 1))
    return [
        Job(fit, {"scene": small(s, width), "sides": sides, "repeats": repeats, "seed": settings.seed_of(s.name)})
        for s in settings.chosen(CONVERGENCE.scenes)
    ]


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    found = {}
    for outcome in outcomes:
        lines = {}
        for row, name in zip(outcome.rows, KINDS, strict=True):
            counts, errors = outcome.arrays[name]
            label = f"{name}: {row['slope']:.3f} [{row['slope_low']:.3f}, {row['slope_high']:.3f}]"
            lines[label] = (counts.tolist(), errors.tolist())
        scene, truth = outcome.rows[0]["scene"], outcome.rows[0]["truth"]
        title = f"{scene}: area sampling against {truth}; slopes with their 99 % intervals"
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
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(CONVERGENCE)
