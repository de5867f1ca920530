"""The closed forms, diffuse and glossy, judged against Mitsuba at a margin of 5e-5."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.experiments.runs.measure import small
from nusselt.experiments.runs.verdict_job import verdict
from nusselt.experiments.studies.cornell import figures as pictures
from nusselt.experiments.studies.glossy import shiny
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Analytic
from nusselt.renderer.prepared import prepare

EXPONENT = 30.0
MARGIN = 5e-5


def jobs(settings: Settings) -> list[Job]:
    margin = 1e-3 if settings.quick else MARGIN
    scenes = [small(scene, 64 if settings.quick else 320) for scene in settings.chosen(UNSHADOWED.scenes)]
    for scene in scenes:
        if prepare(scene).needs.visibility:
            raise InputError("scenes", scene.name, "scenes in which nothing blocks: the closed form knows no shadow")
    variants = [v for scene in scenes for v in (scene, shiny(scene, EXPONENT).with_(name=f"{scene.name}-glossy"))]
    return [
        Job(
            verdict,
            {
                "scene": scene,
                "estimator": Analytic(),
                "margin": margin,
                "seed": settings.seed_of(scene.name),
                "rows": len(variants),
                "timeout": 3600.0,
            },
            alone=True,
        )
        for scene in variants
    ]


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    return pictures(outcomes)


UNSHADOWED = Experiment(
    "unshadowed", "closed forms, diffuse and glossy, against Mitsuba to 5e-5 (minutes)", jobs, figures, ("unshadowed",)
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(UNSHADOWED)
