"""The most that one light sample can bring, where a lobe or the place of a near light is far smaller than the light."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from builders import GREY, floor, lamp, scene

from nusselt.experiments.check.ceiling import sample_ceilings
from nusselt.experiments.check.question import Question
from nusselt.experiments.check.references import KeptReferences
from nusselt.experiments.external.against import in_common
from nusselt.experiments.external.judge import External, Judging, judge_images
from nusselt.experiments.verdict.level import Level
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render
from nusselt.renderer.lights import QuadLight, TriangleLight
from nusselt.renderer.scene import Camera
from nusselt.renderer.surfaces import Material, Mesh

POLISHED = Material((0.1, 0.1, 0.1), (0.5, 0.5, 0.5), 1e5)
MIRROR = Mesh(floor().vertices, floor().triangles, POLISHED)
SCENE = scene(MIRROR, lights=(lamp(2.5, 3.0),), size=(24, 18), light_samples=4, stratify=True)
RIGHT = Area(samples=4, stratified=True)
TRIANGLE = TriangleLight((-3.0, 2.5, -3.0), (3.0, 2.5, -3.0), (0.0, 2.5, 3.0), (5.0, 5.0, 5.0))


def vast(half, height, radiance=(3.0, 8.0, 8.0)):
    """A square whose middle is above no place in view: a grid over it has no node there."""
    side = 2 * half
    return QuadLight((-1.3 * half, height, -0.6 * half), (0.0, 0.0, side), (side, 0.0, 0.0), radiance)


@pytest.mark.parametrize("light", [lamp(2.5, 3.0), TRIANGLE], ids=["square", "triangle"])
def test_no_sample_of_a_sharp_lobe_brings_more(light):
    shiny = SCENE.with_(lights=(light,))
    ceiling = sample_ceilings(shiny)[0]
    largest = np.max([render(shiny, Area(samples=1), seed=seed).mean.mean(axis=0) for seed in range(400)], axis=0)
    assert (largest <= ceiling + 1e-12).all()
    assert ceiling.max() > 100  # where the lamp is mirrored: met by one sample in thousands


def test_the_brightest_point_is_found_where_the_lobe_points_away_from_the_light():
    """Upright, 200 wide, seen in a lobe from its side: between its foot, where n.d is 0, and where m.d is 0."""
    wide = QuadLight((-98.5, -17.8, -3.0), (195.7, 40.8, -4.6), (17.2, -87.5, -45.2), (1.0, 1.0, 1.0))
    corners = np.array([(-8.7, 1.9, -6.9), (7.0, 5.1, -7.3), (8.8, -1.9, 7.0)]).T
    slope = Mesh(corners, np.array([[0], [1], [2]]), Material((0.0, 0.0, 0.0), (0.125, 0.5, 0.25), 7.3))
    camera = Camera((-2.4, -4.3, -8.0), (0.8, -0.6, 0.2), (0.2, -0.9, -0.5), 63.0)
    shown = scene(slope, lights=(wide,), camera=camera, size=(12, 12))
    largest = np.max([render(shown, Area(samples=1), seed=seed).mean.mean(axis=0) for seed in range(2000)], axis=0)
    ceiling = sample_ceilings(shown)[0]
    assert (largest <= ceiling).all()
    assert np.divide(largest, ceiling, out=0 * ceiling, where=ceiling > 0).max() > 0.25  # and no vast one


def test_the_brightest_point_of_a_vast_light_is_found_above_each_place():
    """Of a level plane it stands right above: its area over the height's square, times the albedo over pi, twice."""
    wide = scene(floor(), lights=(vast(1e3, 4.0, (1.0, 1.0, 1.0)),), size=(24, 18))
    seen = render(wide, Area(samples=1)).shaded
    np.testing.assert_allclose(sample_ceilings(wide)[0][seen], 2 * 4e6 / 16 * GREY.diffuse[0] / math.pi, rtol=1e-12)


@pytest.mark.parametrize(
    ("lights", "floored"),
    [
        ((lamp(2.5, 3.0),), MIRROR),
        ((vast(1e3, 4.0),), floor()),
        ((vast(1e4, 4.0),), floor()),
        ((vast(1e4, 4.0, (8.0, 0.0, 0.0)), lamp(2.5)), floor()),
    ],
    ids=["sharp lobe", "vast light", "vaster light", "vast red light"],
)
def test_right_images_that_miss_nearly_all_of_the_light_do_not_differ(lights, floored):
    missed = SCENE.with_(meshes=(floored,), lights=lights)
    images = [render(missed, RIGHT, seed=seed).mean.transpose(1, 2, 0) for seed in range(1, 5)]
    question = Question(estimator="area", margin=0.01, level=Level(1e-6))
    judging = Judging(question, External(), "", KeptReferences(None, None), diagnose=False)
    row = judge_images(missed, images, judging).row
    assert row["verdict"] != "differs", row["reason"]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("y", [0.0, 1e-12, 2.0])
def test_places_in_the_plane_of_a_light_and_beside_it_raise_no_warning(y):
    """A light in the floor's plane, one all but in it, and one upright, beside which the middle column's rays go."""
    upright = QuadLight((-1.0, 0.0, -1.0), (0.0, 0.0, 2.0), (0.0, 2.0, 0.0), (1.0, 1.0, 1.0))
    for light in (lamp(y), upright, TriangleLight((0.0, y, 0.0), (1.0, y, 0.0), (0.0, y, 1.0), (1.0, 1.0, 1.0))):
        assert np.isfinite(sample_ceilings(SCENE.with_(lights=(light,), width=25))).all()


@pytest.mark.parametrize("rare", [True, False])
def test_images_that_all_miss_what_is_rare_are_not_alike(rare):
    """Of one pixel that one in fifty samples of its largest makes; where it is not rare they are."""
    expected, supposed, grain = np.ones((3, 12, 16)), np.full((12, 16), 0.05**2), np.full((12, 16), 0.05)
    seen = expected + 0.025 * np.random.default_rng(1).normal(size=(3, 12, 16))
    expected[:, 5, 6], seen[:, 5, 6], supposed[5, 6], grain[5, 6] = 5.0, 0.0, 20.0, 250.0 if rare else 0.05
    everywhere = np.ones((12, 16), dtype=bool)
    image = SimpleNamespace(
        mean=seen, shaded=everywhere, unjudged=~everywhere, pixel_variance=np.full((12, 16), 0.05**2)
    )
    reference = SimpleNamespace(mean=expected, pixel_standard_error=0 * supposed)
    sides = SimpleNamespace(images=4, factor=0.03, image=image, reference=reference, supposed=supposed)
    assert in_common(sides, SimpleNamespace(sampled=everywhere, grain=grain)) is not rare
