"""Soft shadows: visibility sampled together with everything else."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from nusselt.experiments.results.figures import curves, strip
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.experiments.runs.measure import SURE, measured, truth_of
from nusselt.experiments.scenes.sizes import small
from nusselt.renderer.estimators import Area
from nusselt.renderer.scene import Scene

SAMPLES = (1, 9, 25, 100)


def compare(scene: Scene, samples: Sequence[int], seed: int) -> Outcome:
    """Stratified area sampling at each number of samples."""
    truth = truth_of(scene, seed)
    rows, arrays = [], {"truth": truth.mean}
    for count in samples:
        found, arrays[str(count)] = measured(scene, Area(samples=count, stratified=True), truth, seed + 1)
        row = {"scene": scene.name, "estimator": "area", "stratified": True, "samples": count, "truth": truth.name}
        rows.append(row | found | {"as_claimed": abs(found["bias_standard_errors"]) < SURE})
    return Outcome(rows, arrays)


def jobs(settings: Settings) -> list[Job]:
    """One a scene."""
    width, samples = settings.pick((256, SAMPLES), (48, SAMPLES[:3]), (12, SAMPLES[:2]))
    return [
        Job(compare, {"scene": small(scene, width), "samples": samples, "seed": settings.seed_of(scene.name)})
        for scene in settings.chosen(SOFT_SHADOWS.scenes)
    ]


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """The strip of images, and error against samples."""
    found, lines = {}, {}
    for outcome in outcomes:
        name, truth = outcome.rows[0]["scene"], outcome.rows[0]["truth"]
        counts = [row["samples"] for row in outcome.rows]
        images = [(f"{n} stratified", outcome.arrays[str(n)]) for n in counts] + [(truth, outcome.arrays["truth"])]
        found[f"strip-{name}"] = strip([("", images)], f"{name}: area sampling, samples per light, one pass each")
        lines[name] = counts, [row["rms_relative"] for row in outcome.rows]
    title = "Area sampling, stratified: error of one pass"
    found["error"] = curves(lines, "samples per light", "relative RMS of a pixel", title)
    return found


SOFT_SHADOWS = Experiment(
    "soft-shadows", "penumbrae from one sample to many", jobs, figures, ("three-lights", "cornell-boxes")
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(SOFT_SHADOWS)
