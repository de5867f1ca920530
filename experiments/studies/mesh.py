"""100,000 triangles over a floor, and the mesh scene of the course in shape: sampled and without noise."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from nusselt.experiments.results.figures import strip
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.experiments.runs.measure import small
from nusselt.experiments.runs.verdict_job import verdict
from nusselt.renderer.estimators import Area, Estimator, Exact

MARGIN = 2e-3
SAMPLES = 25
WIDE = 320
"""Pixels: no scene is made wider."""


def jobs(settings: Settings) -> list[Job]:
    """Every scene sampled with 5 x 5 strata; the first also without noise. The first alone where it must be quick."""
    width, margin = (96, 0.01) if settings.quick else (WIDE, MARGIN)
    scenes = settings.chosen(MESH.scenes)[: 1 if settings.quick and not settings.scenes else None]
    area = Area(samples=SAMPLES, stratified=True)
    asked: list[tuple[Any, Estimator]] = [(scene, area) for scene in scenes]
    asked.insert(1, (scenes[0], Exact()))
    return [
        Job(
            verdict,
            {
                "scene": small(scene, min(width, scene.width)),
                "estimator": estimator,
                "margin": margin,
                "seed": settings.seed_of(scene.name),
                "rows": len(asked),
                "timeout": 600.0,
            },
            alone=True,
        )
        for scene, estimator in asked
    ]


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Both renderers' images side by side."""
    found = {}
    for outcome in outcomes:
        row = outcome.rows[0]
        images = [(f"ours, {row['estimator']}", outcome.arrays["ours"])]
        if "reference" in outcome.arrays:
            told = row["reference"]
            images.append((f"Mitsuba {told['version']}, {told['samples']} per light", outcome.arrays["reference"]))
        name = f"{row['scene']}-{row['estimator']}"
        found[name] = strip([("", images)], f"{name}: {row['verdict']} (seed {row['seed']})")
    return found


MESH = Experiment(
    "mesh", "100,000 triangles, sampled and without noise, against Mitsuba", jobs, figures, ("mesh", "mesh-course")
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(MESH)
