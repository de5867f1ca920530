"""The most that one light sample can bring, where a lobe is far narrower than the light."""

from __future__ import annotations

import numpy as np
from builders import floor, lamp, scene

from nusselt.experiments.check.ceiling import sample_ceilings
from nusselt.experiments.check.question import Question
from nusselt.experiments.check.references import KeptReferences
from nusselt.experiments.external.judge import External, Judging, judge_images
from nusselt.experiments.verdict.level import Level
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render
from nusselt.renderer.surfaces import Material, Mesh

POLISHED = Material((0.1, 0.1, 0.1), (0.5, 0.5, 0.5), 1e5)
MIRROR = Mesh(floor().vertices, floor().triangles, POLISHED)
SCENE = scene(MIRROR, lights=(lamp(2.5, 3.0),), size=(24, 18), light_samples=4, stratify=True)
RIGHT = Area(samples=4, stratified=True)


def test_no_sample_of_a_sharp_lobe_brings_more():
    ceiling = sample_ceilings(SCENE)[0]
    largest = np.max([render(SCENE, Area(samples=1), seed=seed).mean.mean(axis=0) for seed in range(400)], axis=0)
    assert (largest <= ceiling + 1e-12).all()
    assert ceiling.max() > 100  # where the lamp is mirrored: met by one sample in thousands


def test_right_images_that_miss_nearly_all_of_a_sharp_lobe_do_not_differ():
    images = [render(SCENE, RIGHT, seed=seed).mean.transpose(1, 2, 0) for seed in range(1, 5)]
    question = Question(estimator="area", margin=0.01, level=Level(1e-6))
    judging = Judging(question, External(), "", KeptReferences(None, None), diagnose=False)
    assert judge_images(SCENE, images, judging).row["verdict"] != "differs"
