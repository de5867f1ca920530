"""One sample to many, random beside stratified: the strip of images, and how fast each falls."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from nusselt.experiments.results.figures import curves, strip
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.experiments.runs.measure import measured, truth_of
from nusselt.experiments.scenes.sizes import small
from nusselt.renderer.estimators import Area
from nusselt.renderer.scene import Scene

SAMPLES = (1, 4, 9, 16, 25, 64)
KINDS = {"random": False, "stratified": True}


def compare(scene: Scene, samples: Sequence[int], seed: int) -> Outcome:
    """RMS of both kinds at each number of samples, and the first image of each."""
    truth = truth_of(scene, seed)
    rows, arrays = [], {}
    for count in samples:
        errors = {}
        for kind, stratified in KINDS.items():
            found, arrays[f"{kind} {count}"] = measured(
                scene, Area(samples=count, stratified=stratified), truth, seed + 1
            )
            errors[kind] = found["rms_relative"]
        gain = errors["random"] / errors["stratified"]
        row = {"scene": scene.name, "estimator": "area", "samples": count, "truth": truth.name}
        row |= {"rms_random": errors["random"], "rms_stratified": errors["stratified"], "gain": gain}
        # One stratum is no stratum: the same estimator, equal to noise. More must never lose.
        rows.append(row | {"as_claimed": gain > (0.9 if count == 1 else 1.0)})
    return Outcome(rows, arrays)


def jobs(settings: Settings) -> list[Job]:
    """One a scene."""
    width, samples = settings.pick((320, SAMPLES), (64, SAMPLES[:4]), (12, SAMPLES[:2]))
    return [
        Job(compare, {"scene": small(scene, width), "samples": samples, "seed": settings.seed_of(scene.name)})
        for scene in settings.chosen(RANDOM_VS_STRATIFIED.scenes)
    ]


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """The strip of images, and error against samples."""
    found = {}
    for outcome in outcomes:
        name, counts = outcome.rows[0]["scene"], [row["samples"] for row in outcome.rows]
        images = [(kind, [(f"{n} per light", outcome.arrays[f"{kind} {n}"]) for n in counts]) for kind in KINDS]
        found[f"strip-{name}"] = strip(images, f"{name}: area sampling, one pass each, linear, clamped to 1")
        lines = {kind: (counts, [row[f"rms_{kind}"] for row in outcome.rows]) for kind in KINDS}
        title = f"{name}: area sampling against {outcome.rows[0]['truth']}"
        found[f"error-{name}"] = curves(lines, "samples per light", "relative RMS of a pixel", title)
    return found


RANDOM_VS_STRATIFIED = Experiment(
    "random-vs-stratified", "one sample to many, random beside stratified", jobs, figures, ("quad", "three-lights")
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(RANDOM_VS_STRATIFIED)
