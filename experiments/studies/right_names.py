"""Right images, diagnosed although they agree: how often is one given the name of a mistake?

Only images that differ are diagnosed, so that a right one is named wrongly less often still.
"""

from __future__ import annotations

import random
from itertools import product

import numpy as np

from nusselt.experiments.external.diagnosis import Inputs, diagnose
from nusselt.experiments.images.formats import Raw
from nusselt.experiments.images.formats.png import to_levels
from nusselt.experiments.images.transfer import Quantiser, Transfer
from nusselt.experiments.independent.plain_scenes import PLAIN
from nusselt.experiments.independent.render import Options, render
from nusselt.renderer.scene import Scene

from .brought_images import scene_named, text_of, truth_of

WIDTH, SAMPLES = 64, 16
WAYS = (("area", True), ("area", False), ("mis", False))
"""Of sampling, and whether in strata: those whose noise is near the one supposed of one image."""
CASES = tuple(product(PLAIN, WAYS, (1, 2), (0, 255)))
"""Scene, way, images, and levels above 0 of each."""


def given(
    name: str, way: tuple[str, bool], count: int, top: int, seed: int, width: int = WIDTH
) -> tuple[Scene, Inputs]:
    """Right images of a scene, and what they are compared with."""
    scene = scene_named(name, width)
    options = [Options(SAMPLES, way[1], way=way[0], seed=seed + k) for k in range(count)]
    images = np.unique([render(text_of(name), width, one).transpose(2, 0, 1) for one in options], axis=0)
    raws = [Raw(to_levels(image) if top else image) for image in images]
    return scene, Inputs.against(raws, Quantiser(top, Transfer("linear"), "truncate"), truth_of(scene))


def names_of_right(numbers: range, width: int, seed: int) -> list[str]:
    """The names that right images are given, of cases by their places in a random order."""
    cases, named = list(CASES), []
    random.Random(seed).shuffle(cases)
    for number in numbers:
        name, way, count, top = cases[number % len(cases)]
        scene, inputs = given(name, way, count, top, seed % 2**31 + 10 * number, width)
        named += [one.name for one in diagnose(scene, inputs, SAMPLES, way[1]).mistakes[:1]]
    return named
