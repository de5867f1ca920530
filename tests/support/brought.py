"""Images judged as somebody's, in one call."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from builders import floor, lamp, scene

from nusselt.experiments.check.question import Question, with_pixel_rule
from nusselt.experiments.check.references import KeptReferences
from nusselt.experiments.external.judge import External, Judging, judge_images
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render
from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.surfaces import Ellipsoid, Material

BALL = Ellipsoid((0.2, 0.5, 0.0), ((0.5, 0.0, 0.0), (0.0, 0.5, 0.0), (0.0, 0.0, 0.5)), Material((0.2, 0.4, 0.6)))
CAMERA = Camera((0.0, 1.6, 4.5), (0.0, 0.6, 0.0), (0.0, 1.0, 0.0), 45.0)
ROOM = scene(
    floor(4.0),
    ellipsoids=(BALL,),
    lights=(lamp(2.3, 0.7, (12.0, 11.0, 9.0)),),
    size=(56, 42),
    camera=CAMERA,
    light_samples=16,
    stratify=True,
    name="room",
)
"""A ball on a floor under a light that is seen from below: shadows, background."""


def honest(made: Scene, seed: int, samples: int = 16, stratified: bool = True) -> np.ndarray:
    """A right image (h, w, 3), float64."""
    return render(made, Area(samples=samples, stratified=stratified), seed=seed).mean.transpose(1, 2, 0)


def judged(
    made: Scene, images: Sequence[Any], *, quantisation: str = "auto", noise: str = "any", **asked: Any
) -> dict[str, Any]:
    """The row of images, arrays or paths."""
    question = Question(**asked)
    external = External(quantisation=quantisation, noise=noise)
    judging = Judging(question, external, "", KeptReferences(None, None))
    given = [image if isinstance(image, Path) else np.asarray(image) for image in images]
    return judge_images(with_pixel_rule(made, question.pixel_rule), given, judging).row
