"""Planted mistakes are told by their names or their places; right images are told nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nusselt.experiments.defects.mistakes import PLANTS, planted_scene
from nusselt.experiments.external.diagnosis import Inputs, diagnose
from nusselt.experiments.external.diagnosis.case import Case
from nusselt.experiments.external.diagnosis.hints import HINTS
from nusselt.experiments.external.diagnosis.hypotheses import STAGES
from nusselt.experiments.external.diagnosis.probe import Probe
from nusselt.experiments.images.formats import Raw
from nusselt.experiments.images.formats.png import to_levels
from nusselt.experiments.images.transfer import Quantiser, Transfer
from nusselt.experiments.independent.mistakes import KINDS, MISTAKES
from nusselt.experiments.independent.mistakes.told import names_of, places_of
from nusselt.experiments.independent.steps import RIGHT
from nusselt.experiments.studies.brought_images import scene_named, text_of, truth_of
from nusselt.experiments.studies.planted_images import SAMPLES, images_of, rule_of
from nusselt.experiments.studies.planted_mistakes import COURSE, inputs, tell
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render
from nusselt.renderer.scene_text import parse_scene

WIDTH = 64
RADIANCE = Quantiser(0, Transfer(), "truncate")
LEVELS = ("fov", "correlated-seeds")
"""Of 8-bit images; `nusselt run planted-mistakes` tries all, at the course's sizes."""
NAMED = (
    "gain 0.98",
    "surface cosine squared",
    "1/r^3",
    "measure changed twice",
    "point over pi",
    "half a cell off",
    "no shadows",
    "visibility averaged apart",
    "missing ball",
    "acne",
    "materials exchanged",
    "exponent a quarter",
    "rolled by a degree",
    "a row down",
    "vignette",
    "blur 3 x 3",
    "eight bits, truncated",
    "luminance",
    "Reinhard",
    "indirect light",
    "AgX, decoded",
    "filmic curve",
)
PLACED = ("normals by the matrix", "one pixel ten times as bright", "a black row", "rotation the other way")
"""Of the independent renderer; `nusselt run planted-images` tries all."""


def brought(name: str, steps=None, seeds=(1, 2)):
    """Inputs of a mistake's scene, by its steps or by others."""
    mistake = next(one for one in MISTAKES if one.name == name)
    scene = scene_named(mistake.scene, WIDTH, rule_of(mistake))
    images = images_of(mistake, mistake.steps if steps is None else steps, WIDTH, seeds)
    raws = [Raw(image.transpose(2, 0, 1)) for image in images]
    return scene, Inputs.against(raws, RADIANCE, truth_of(scene)), mistake.strata


@pytest.mark.parametrize("name", NAMED)
def test_a_mistake_is_told_by_its_name(name):
    scene, given, strata = brought(name)
    kind = next(kind for kind, every in KINDS.items() if name in [one.name for one in every])
    found = diagnose(scene, given, SAMPLES, strata)
    assert found.mistakes, found.tried
    assert found.mistakes[0].name in names_of(name, kind), found.mistakes
    assert found.mistakes[0].explained > 0.85
    assert found.mistakes[0].hint


@pytest.mark.parametrize("name", ["Blackman-Harris 2, areas", "Blackman-Harris 1.5, jittered"])
def test_a_reconstruction_filter_wider_than_a_pixel_is_told(name):
    scene, given, strata = brought(name, seeds=range(1, 9))
    (told,) = {mistake.name for mistake in diagnose(scene, given, SAMPLES, strata).mistakes}
    assert told == "filter"


def test_right_areas_are_told_nothing():
    scene, given, strata = brought("Blackman-Harris 2, areas", RIGHT, range(1, 9))
    assert scene.spp > 1
    assert diagnose(scene, given, SAMPLES, strata).mistakes == ()


@pytest.mark.parametrize("name", PLACED)
def test_a_mistake_without_a_name_is_told_by_its_place(name):
    scene, given, strata = brought(name)
    found = diagnose(scene, given, SAMPLES, strata)
    assert found.mistakes == ()
    assert any(
        word in place.said
        for place in found.where
        for word in places_of(name, "pictures" if "row" in name or "pixel" in name else "geometry")
    ), found.where


@pytest.mark.parametrize(
    ("name", "seeds"), [("gain 0.98", (5,)), ("half vector", (5, 6)), ("point over pi", (5, 6, 7)), ("1/r", (5, 6))]
)
def test_right_images_are_told_nothing(name, seeds):
    scene, given, strata = brought(name, RIGHT, seeds)
    found = diagnose(scene, given, SAMPLES, strata)
    assert found.mistakes == ()
    assert found.where == ()


@pytest.mark.parametrize("scene", ["lamp from behind", "lonely"])
@pytest.mark.parametrize("change", [lambda mean: 0 * mean, lambda mean: mean + 0.1, lambda mean: mean * np.nan])
def test_scenes_and_images_that_are_black_or_not_finite(scene, change):
    made = scene_named(scene, 24)
    truth = truth_of(made)
    given = Inputs.against([Raw(change(truth.mean))], RADIANCE, truth)
    names = [mistake.name for mistake in diagnose(made, given, SAMPLES, True).mistakes]
    assert names[:1] in ([], ["no-light"], ["ambient"])


def test_values_that_are_no_numbers_are_told_by_their_pixels_alone():
    """At an edge too, and nothing of the noise beside them."""
    scene, given, strata = brought("gain 0.98", RIGHT, (5, 6))
    edge = given.mean.mean(axis=0)
    row, column = np.unravel_index(np.abs(np.diff(edge, axis=1)).argmax(), (edge.shape[0], edge.shape[1] - 1))
    raws = [Raw(raw.values.copy()) for raw in given.raws]
    raws[0].values[:, row, column] = np.nan
    (place,) = diagnose(scene, Inputs.against(raws, RADIANCE, truth_of(scene)), SAMPLES, strata).where
    assert f"1 pixel not finite, (column, row) ({column}, {row})" in place.said


def test_noise_that_two_images_share_is_no_mistake_of_the_light():
    scene, given, strata = brought("gain 0.98", RIGHT, (5, 6))
    both = [raw.values + 0.9 * (given.raws[0].values - given.mean) for raw in given.raws]
    shared = replace(given, raws=[Raw(values) for values in both])
    assert diagnose(scene, shared, SAMPLES, strata).mistakes == ()


@pytest.mark.parametrize("plant", [p for p in PLANTS if p.name in LEVELS], ids=lambda plant: plant.name)
def test_a_mistake_in_levels_is_told_first(plant):
    (row,) = tell(PLANTS.index(plant), 120, seed=1).rows
    told = row["likely_mistakes"]
    assert told, row
    assert told[0]["name"] == plant.name, told
    assert told[0]["explained"] > 0.5
    if plant.name == "fov":
        assert "44 instead of 45" in told[0]["detail"]


def test_a_right_image_in_levels_is_told_nothing():
    plant = next(p for p in PLANTS if p.name == "gamma")  # for its scene
    scene = planted_scene(plant, 120)
    image = render(scene, Area(samples=scene.light_samples, stratified=scene.stratify), seed=11)
    given = inputs(scene, to_levels(image.mean))
    assert given.quantiser is COURSE
    assert diagnose(scene, given, scene.light_samples, scene.stratify).mistakes == ()


RICH = """size 24 18
camera .3 1.7 5.2  0 .5 0  0 1 0  40
integrator direct
lightsamples 16
lightstratify on
diffuse .5 .4 .3
specular .3 .3 .3
shininess 20
vertex -3 0 3
vertex 3 0 3
vertex 3 0 -3
vertex -3 0 -3
tri 0 1 2
tri 0 2 3
specular 0 0 0
diffuse .2 .5 .3
sphere .5 .6 0 .6
quadLight -.6 2.2 -1.2  0 0 1.2  1.2 0 0  8 8 7
quadLight -2.2 1 -1  0 0 1.4  .6 1.2 0  4 5 8
sun .6 1.5 1  .9 .85 .7  6
"""


def test_every_name_has_a_hint_and_every_hint_a_name():
    scene = parse_scene(RICH)
    truth = truth_of(scene)
    names = {"correlated-seeds", "lost-samples", "half-pixel", "indirect-light"}  # where they may be alone
    moved = np.roll(truth.mean, 1, axis=1)
    for image in (1.3 * truth.mean, moved, to_levels((truth.mean + moved) / 2)):
        quantiser = COURSE if image.dtype == np.uint8 else RADIANCE
        case = Case(Probe(scene, 16, True), Inputs.against([Raw(image)], quantiser, truth))
        with np.errstate(all="ignore"):
            names |= {guess.name for stage in STAGES for hypothesis in stage for guess in hypothesis(case)}
    assert names == set(HINTS)


def test_disks_are_told_as_suns_are():
    text = text_of("sun")
    scene = parse_scene(text.replace("sun .6 1.5 1  .9 .85 .7  4", "diskLight .6 2.5 1  0 -1 0  .4  6 6 5"))
    small = scene.with_(width=48, height=36)
    (light,) = small.lights
    image = render(
        small.with_(lights=(replace(light, radius=0.8),)), Area(samples=16, stratified=True), seed=3, passes=2
    )
    given = Inputs.against([Raw(image.mean), Raw(image.first)], RADIANCE, truth_of(small))
    (told, *_) = diagnose(small, given, 16, True).mistakes
    assert told.name == "light-shape"
    assert "twice the radius" in told.detail
