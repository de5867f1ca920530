"""The noise-free image: Lambert's formula for every pixel, and Monte Carlo on its way there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from nusselt.experiments.results.figures import strip
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.experiments.runs.measure import SURE, measured, truth_of
from nusselt.experiments.scenes.sizes import small
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Area
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene


def compare(scene: Scene, samples: int, passes: int, seed: int) -> Outcome:
    """Many passes of area sampling against the closed form."""
    truth = truth_of(scene, seed)
    found, image = measured(scene, Area(samples=samples), truth, seed + 1, passes)
    row = {"scene": scene.name, "estimator": "area", "samples": samples, "passes": passes, "truth": truth.name} | found
    right = abs(found["bias_standard_errors"]) < SURE
    return Outcome([row | {"as_claimed": right}], {"closed form": truth.mean, "area": image})


def jobs(settings: Settings) -> list[Job]:
    """One a scene."""
    width, passes = settings.pick((320, 32), (64, 8), (12, 4))
    scenes = settings.chosen(ANALYTIC.scenes)
    for scene in scenes:
        if prepare(scene).needs.visibility:
            raise InputError("scenes", scene.name, "scenes in which nothing blocks: the closed form knows no shadow")
    return [
        Job(
            compare,
            {"scene": small(scene, width), "samples": 16, "passes": passes, "seed": settings.seed_of(scene.name)},
        )
        for scene in scenes
    ]


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Images, and error against samples."""
    found = {}
    for outcome in outcomes:
        row, arrays = outcome.rows[0], outcome.arrays
        images = [("closed form, no samples", arrays["closed form"]), (f"{row['samples']} random", arrays["area"])]
        found[row["scene"]] = strip([("", images)], f"{row['scene']}: no noise, and noise")
    return found


ANALYTIC = Experiment(
    "analytic",
    "the closed form for every pixel, and Monte Carlo around it",
    jobs,
    figures,
    ("quad", "unshadowed", "horizon"),
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(ANALYTIC)
