"""What an image is compared with: the exact image where the scene has one, else Mitsuba's, else ours by area."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from nusselt.experiments.check.check import ROOM, Progress, seeds
from nusselt.experiments.check.question import Question
from nusselt.experiments.check.references import KeptReferences
from nusselt.experiments.results.document import package_versions
from nusselt.mitsuba_bridge.reference import Reference, ReferenceUnavailable
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import ESTIMATORS, Area, Estimator
from nusselt.renderer.image import Image, render
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene

AREA = Area(samples=64, stratified=True)
AREA_PASSES = 32


@dataclass(frozen=True)
class Truth:
    """A reference and a sentence that says what it is; ``exact`` if it has no noise."""

    reference: Reference
    said: str
    exact: bool


def exact_estimator(scene: Scene) -> Estimator | None:
    """The first estimator that claims this scene exactly and draws no random number."""
    if scene.spp > 1:
        return None
    needs = prepare(scene).needs
    for kind in ESTIMATORS:
        try:
            made = kind(samples=1)
        except InputError:
            continue
        if made.claim(needs) == "exact" and not made.is_random(needs):
            return made
    return None


def as_reference(image: Image, estimator: Estimator, passes: int) -> Reference:
    """One of our images in the place of a reference."""
    return Reference(
        mean=image.mean,
        standard_error=np.sqrt(image.variance / passes),
        pixel_standard_error=np.sqrt(image.pixel_variance / passes),
        emitter=image.emitter,
        background=image.background,
        holes=np.zeros_like(image.background),
        pass_means=image.pass_means,
        samples=estimator.samples * passes,
        passes=passes,
        renderer=f"nusselt {estimator.name}",
        version=str(package_versions()["nusselt"]),
        variant="float64",
        llvm=None,
        notes=(),
        seconds={},
    )


def truth_of(
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
    exact = exact_estimator(scene)
    if exact is not None:
        image = render(scene, exact, executor=executor, progress=_part(progress, "exact image"))
        return Truth(as_reference(image, exact, 1), f"the exact image ({exact.name})", True)
    try:
        found = references.get(scene, question, question.margin / ROOM, progress)
        return Truth(found, f"Mitsuba {found.version}, {found.samples} samples per light", False)
    except ReferenceUnavailable as problem:
        told = str(problem)
    seed = seeds(question.seed, scene.name, "area-reference")[2]
    image = render(
        scene, AREA, seed=seed, passes=AREA_PASSES, executor=executor, progress=_part(progress, "area reference")
    )
    made = as_reference(image, AREA, AREA_PASSES)
    return Truth(made, f"ours by area, {made.samples} samples per light, because Mitsuba could not run: {told}", False)


def _part(progress: Progress | None, stage: str) -> Callable[[int, int], None] | None:
    return None if progress is None else lambda done, total: progress(stage, done, total)
