"""Planted mistakes are told by their names, at a reduced size; right images are told nothing."""

from __future__ import annotations

import pytest

from nusselt.experiments.defects.mistakes import PLANTS, planted_scene
from nusselt.experiments.external.diagnosis import HYPOTHESES, diagnose
from nusselt.experiments.images.formats import Raw
from nusselt.experiments.images.formats.png import to_levels
from nusselt.experiments.studies.planted_mistakes import COURSE, tell
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render

QUICK = ("fov", "missing-cosine", "correlated-seeds", "half-pixel")
"""Those of quick scenes; `nusselt run planted-mistakes` tries all, at the course's sizes."""


@pytest.mark.parametrize("plant", [p for p in PLANTS if p.name in QUICK], ids=lambda plant: plant.name)
def test_a_planted_mistake_is_told_first(plant):
    (row,) = tell(PLANTS.index(plant), 160, seed=1).rows
    told = row["likely_mistakes"]
    assert told, row
    assert told[0]["name"] == plant.name, told
    assert told[0]["explained"] > 0.5
    if plant.name == "fov":
        assert "44 instead of 45" in told[0]["detail"]


def test_every_plant_has_its_hypothesis():
    assert len(PLANTS) == 14
    for plant in PLANTS:
        assert plant.name in HYPOTHESES or plant.name == "correlated-seeds"


def test_a_right_image_is_told_nothing():
    plant = next(p for p in PLANTS if p.name == "gamma")  # for its scene
    scene = planted_scene(plant, 120)
    image = render(scene, Area(samples=scene.light_samples, stratified=scene.stratify), seed=11)
    found = diagnose(scene, [Raw(to_levels(image.mean))], COURSE, scene.light_samples, scene.stratify)
    assert found.mistakes == ()
    assert found.difference == pytest.approx(found.noise, rel=0.15)
