"""What an image is compared with: the exact image where the scene has one, else Mitsuba's, else ours by area."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass

from nusselt.experiments.check.check import ROOM, Progress, seeds
from nusselt.experiments.check.estimators import noise_free
from nusselt.experiments.check.question import Question
from nusselt.experiments.check.references import KeptReferences
from nusselt.experiments.results.document import package_versions
from nusselt.mitsuba_bridge.reference import Reference, ReferenceUnavailable
from nusselt.renderer.estimators import Area, Estimator
from nusselt.renderer.image import Image, render
from nusselt.renderer.pixels import render_area
from nusselt.renderer.scene import Scene

AREA = Area(samples=64, stratified=True)
AREA_PASSES = 32


@dataclass(frozen=True)
class Truth:
    """A reference and a sentence that says what it is; ``exact`` if it has no noise."""

    reference: Reference
    said: str
    exact: bool


def _reference(image: Image, estimator: Estimator) -> Reference:
    version = str(package_versions()["nusselt"])
    return Reference.of_image(image, f"nusselt {estimator.name}", estimator.samples, version)


def ground_truth(
    scene: Scene,
    question: Question,
    references: KeptReferences,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Truth:
    """Take what the user gave, or make what an image of the scene is compared with."""
    given = references.given(scene)
    if given is not None:
        return Truth(given, f"a kept reference ({given.renderer} {given.version})", given.passes == 1)
    exact = noise_free(scene)
    if exact is not None and scene.spp == 1:
        image = render(scene, exact, executor=executor, progress=_part(progress, "exact image"))
        return Truth(_reference(image, exact), f"the exact image ({exact.name})", True)
    if exact is not None:
        tolerance = question.margin / ROOM
        by_area = render_area(scene, exact, tolerance=tolerance, executor=executor)
        if by_area.error <= tolerance:
            return Truth(_reference(by_area.image, exact), f"the exact image of pixels by area ({exact.name})", True)
    try:
        found = references.get(scene, question, question.margin / ROOM, progress)
        return Truth(found, f"Mitsuba {found.version}, {found.samples} samples per light", False)
    except ReferenceUnavailable as problem:
        told = str(problem)
    seed = seeds(question.seed, scene.name, "area-reference")[2]
    image = render(
        scene, AREA, seed=seed, passes=AREA_PASSES, executor=executor, progress=_part(progress, "area reference")
    )
    made = _reference(image, AREA)
    return Truth(made, f"ours by area, {made.samples} samples per light, because Mitsuba could not run: {told}", False)


def _part(progress: Progress | None, stage: str) -> Callable[[int, int], None] | None:
    return None if progress is None else lambda done, total: progress(stage, done, total)
