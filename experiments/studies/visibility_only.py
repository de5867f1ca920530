"""Noise from visibility alone, and why never the whole light's closed form times the mean visibility.

Within a light the integrand and the visibility go together: E mean(V) weighs what is seen by area alone. Its error
stays however many samples are taken; per stratum it vanishes, and as a control variate there never was one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from nusselt.experiments.results.figures import curves
from nusselt.experiments.results.schema import Row
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.experiments.runs.measure import measured, truth_of
from nusselt.experiments.scenes.sizes import small
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Area, Claim, ControlVariate, Estimator, VisibilityAnalytic, VisibilityCentre
from nusselt.renderer.estimators.analytic import without_shadows
from nusselt.renderer.lights.sampling import random_beams
from nusselt.renderer.needs import Needs, Source
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats

SAMPLES = (4, 16, 64, 256, 1024)


@dataclass(frozen=True, kw_only=True)
class MeanVisibility:
    """The tempting mistake, for comparison alone: E mean(V) over the whole light."""

    samples: int = 1
    stratified: bool = True
    name: ClassVar[str] = "E mean(V)"
    summary: ClassVar[str] = "the whole light's closed form times its mean visibility: biased"
    shares_points: ClassVar[bool] = False

    def claim(self, needs: Needs) -> Claim:
        return "biased"

    def is_random(self, needs: Needs) -> bool:
        return needs.random and needs.visibility

    def __call__(self, points: ShadingPoints, source: Source, rng: np.random.Generator) -> Floats:
        out = without_shadows(points, source)
        if source.blockers.none or source.light.parallelogram() is None:
            return out
        step = max(1, (1 << 17) // self.samples)
        for start in range(0, points.count, step):
            some = points.take(np.arange(start, min(start + step, points.count)))
            d, _ = random_beams(source.light, some.position, rng, self.samples, True)
            seen = source.blockers.visible(some.position, some.ellipsoid, d, source.light.at_infinity)
            out[:, start : start + some.count] *= seen.mean(axis=1)
        return out


KINDS: dict[str, Any] = {
    "area": Area,
    "visibility-centre": VisibilityCentre,
    "visibility-analytic": VisibilityAnalytic,
    "control-variate": ControlVariate,
    "E mean(V)": MeanVisibility,
}


def compare(scene: Scene, samples: Sequence[int], seed: int) -> Outcome:
    """Every way at each number of samples, all stratified."""
    truth = truth_of(scene, seed, samples=4 * max(samples), passes=16)
    rows: list[Row] = []
    for name, kind in KINDS.items():
        for count in samples:
            estimator: Estimator = kind(samples=count, stratified=True)
            found, _ = measured(scene, estimator, truth, seed + count)
            row = {"scene": scene.name, "estimator": name, "stratified": True, "samples": count, "truth": truth.name}
            rows.append(row | found)
    last = {row["estimator"]: row["rms_relative"] for row in rows if row["samples"] == samples[-1]}
    # At the most samples the mistake stands at its floor, and everything else is below it.
    right = {name: error < 0.7 * last["E mean(V)"] for name, error in last.items()}
    right["E mean(V)"] = last["E mean(V)"] > max(error for name, error in last.items() if name != "E mean(V)")
    return Outcome([row | {"as_claimed": right[row["estimator"]]} for row in rows])


def jobs(settings: Settings) -> list[Job]:
    """One a scene."""
    width, samples = settings.pick((128, SAMPLES), (32, SAMPLES[:3]), (8, SAMPLES[:2]))
    scenes = settings.chosen(VISIBILITY_ONLY.scenes)
    for scene in scenes:
        if not prepare(scene).needs.visibility:
            raise InputError("scenes", scene.name, "scenes with shadows: this is about visibility")
    return [
        Job(compare, {"scene": small(scene, width), "samples": samples, "seed": settings.seed_of(scene.name)})
        for scene in scenes
    ]


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """The strip of images, and error against samples."""
    found = {}
    for outcome in outcomes:
        scene, truth = outcome.rows[0]["scene"], outcome.rows[0]["truth"]
        lines = {}
        for name in KINDS:
            mine = [row for row in outcome.rows if row["estimator"] == name]
            lines[name] = [row["samples"] for row in mine], [row["rms_relative"] for row in mine]
        title = f"{scene}: stratified samples per light, error of one pass against {truth}"
        found[scene] = curves(lines, "samples per light", "relative RMS of a pixel", title)
    return found


VISIBILITY_ONLY = Experiment(
    "visibility-only",
    "noise from visibility alone; the floor of E mean(V)",
    jobs,
    figures,
    ("three-lights",),
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(VISIBILITY_ONLY)
