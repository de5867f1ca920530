"""The Cornell box as the course asks for it: 5 x 5 strata, judged against Mitsuba."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from nusselt.experiments.results.figures import strip
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.experiments.runs.measure import small
from nusselt.experiments.runs.verdict_job import verdict
from nusselt.renderer.estimators import Area

SAMPLES = 25


def jobs(settings: Settings) -> list[Job]:
    width, samples, margin = (200, 9, 0.01) if settings.quick else (480, SAMPLES, 1e-3)
    scenes = settings.chosen(CORNELL.scenes[:1] if settings.quick else CORNELL.scenes)
    return [
        Job(
            verdict,
            {
                "scene": small(scene, width),
                "estimator": Area(samples=samples, stratified=True),
                "margin": margin,
                "seed": settings.seed_of(scene.name),
                "rows": len(scenes),
                "timeout": 600.0,
            },
            alone=True,
        )
        for scene in scenes
    ]


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    found = {}
    for outcome in outcomes:
        row = outcome.rows[0]
        told = row["reference"]
        images = [(f"ours, mean of {row['passes']} passes of {row['samples']} per light", outcome.arrays["ours"])]
        if "reference" in outcome.arrays:
            images.append((f"Mitsuba {told['version']}, {told['samples']} per light", outcome.arrays["reference"]))
        found[row["scene"]] = strip([("", images)], f"{row['scene']}: {row['verdict']} (seed {row['seed']})")
    return found


CORNELL = Experiment(
    "cornell", "the Cornell box with 5 x 5 strata, against Mitsuba", jobs, figures, ("cornell", "cornell-boxes")
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(CORNELL)
