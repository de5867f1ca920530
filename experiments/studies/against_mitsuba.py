"""Judged against Mitsuba: the Cornell box as the course asks for it, big meshes, and the closed forms to 5e-5."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from nusselt.experiments.results.figures import strip
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.experiments.runs.verdict_job import verdict
from nusselt.experiments.scenes.procedural import GENERATED, generated
from nusselt.experiments.scenes.sizes import small
from nusselt.experiments.studies.glossy import shiny
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Analytic, Area, Estimator, Exact
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene

Asked = list[tuple[Scene, Estimator]]
SMOOTH = 30.0
"""Phong exponent of the closed forms' glossy twins."""
FEWEST = 1_000
"""Triangles of a generated mesh where it must be tiny."""


def cornell(scenes: Sequence[Scene], samples: int) -> Asked:
    """Sampled as the course asks."""
    return [(scene, Area(samples=samples, stratified=True)) for scene in scenes]


def mesh(scenes: Sequence[Scene], samples: int) -> Asked:
    """Every scene sampled; the first also without noise."""
    first, *rest = [(scene, Area(samples=samples, stratified=True)) for scene in scenes]
    return [first, (first[0], Exact()), *rest]


def unshadowed(scenes: Sequence[Scene], samples: int) -> Asked:
    """The closed form of every scene, as it is and glossy."""
    for scene in scenes:
        if prepare(scene).needs.visibility:
            raise InputError("scenes", scene.name, "scenes in which nothing blocks: the closed form knows no shadow")
    glossy = [shiny(scene, SMOOTH).with_(name=f"{scene.name}-glossy") for scene in scenes]
    return [(scene, Analytic()) for pair in zip(scenes, glossy, strict=True) for scene in pair]


@dataclass(frozen=True)
class Against:
    """What is asked of Mitsuba.

    Parameters
    ----------
    name, summary : str
    scenes : tuple of str
    asked : callable
        Scenes and samples to pairs of a scene and an estimator.
    width, margin : tuple of int, tuple of float
        Most pixels across, and the relative bias that does not matter: whole, quick, tiny.
    samples : tuple of int
        Per light, of what is sampled: the same.
    timeout : float
        Seconds for one reference.
    """

    name: str
    summary: str
    scenes: tuple[str, ...]
    asked: Callable[[Sequence[Scene], int], Asked]
    width: tuple[int, int, int]
    margin: tuple[float, float, float]
    samples: tuple[int, int, int] = (25, 25, 4)
    timeout: float = 600.0


def jobs(against: Against, settings: Settings) -> list[Job]:
    """A verdict each, one at a time; on the first scene alone where it must be quick."""
    width, margin, samples = (settings.pick(*sizes) for sizes in (against.width, against.margin, against.samples))
    scenes = settings.chosen(settings.pick(against.scenes, against.scenes[:1], against.scenes[:1]))
    if settings.tiny:
        scenes = [generated(scene.name, FEWEST) if scene.name in GENERATED else scene for scene in scenes]
    asked = against.asked([small(scene, width) for scene in scenes], samples)
    told = {"margin": margin, "rows": len(asked), "timeout": against.timeout}
    return [
        Job(verdict, {"scene": scene, "estimator": estimator, "seed": settings.seed_of(scene.name), **told}, alone=True)
        for scene, estimator in asked
    ]


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Both renderers' images side by side."""
    found = {}
    for outcome in outcomes:
        row = outcome.rows[0]
        told = row["reference"]
        kind = "" if row["claim"] == "exact" else f", mean of {row['passes']} passes of {row['samples']} per light"
        images = [(f"ours, {row['estimator']}{kind}", outcome.arrays["ours"])]
        if "reference" in outcome.arrays:
            images.append((f"Mitsuba {told['version']}, {told['samples']} per light", outcome.arrays["reference"]))
        name = f"{row['scene']}-{row['estimator']}"
        found[name] = strip([("", images)], f"{name}: {row['verdict']} (seed {row['seed']})")
    return found


AGAINST = (
    Against(
        "cornell",
        "the Cornell box with 5 x 5 strata, against Mitsuba",
        ("cornell", "cornell-boxes"),
        cornell,
        width=(480, 200, 24),
        margin=(1e-3, 0.01, 0.1),
        samples=(25, 9, 4),
    ),
    Against(
        "mesh",
        "100,000 triangles, sampled and without noise, against Mitsuba",
        ("mesh", "mesh-course"),
        mesh,
        width=(320, 96, 12),
        margin=(2e-3, 0.01, 0.1),
    ),
    Against(
        "unshadowed",
        "closed forms, diffuse and glossy, against Mitsuba to 5e-5 (minutes)",
        ("unshadowed",),
        unshadowed,
        width=(320, 64, 12),
        margin=(5e-5, 1e-3, 0.1),
        timeout=3600.0,
    ),
)
CORNELL, MESH, UNSHADOWED = (
    Experiment(row.name, row.summary, partial(jobs, row), figures, row.scenes) for row in AGAINST
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(CORNELL, MESH, UNSHADOWED)
