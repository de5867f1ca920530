"""Scenes that pixels by area or interpolated centres once had wrong: black images, the camera on a ball, far places."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders import GREY, floor, lamp, quad, scene

from renderer.coverage import render_area, render_centre
from renderer.estimators import Analytic, Area, Exact
from renderer.image import render
from renderer.lights import PointLight
from renderer.scene import Camera
from renderer.scene_text import read_scene
from renderer.surfaces import Ellipsoid, Material, Mesh

FOLDER = Path(__file__).with_name("scenes") / "exact"
GLOW = Material(emission=(1.0, 1.0, 1.0))
RENDERERS = {
    "every pixel": lambda s, e: render(s, e),
    "centre": lambda s, e: render_centre(s, e).image,
    "area": lambda s, e: render_area(s, e).image,
}


def case(name: str, **changes):
    return read_scene(FOLDER / f"{name}.test").with_(**changes)


@pytest.mark.parametrize("rule", RENDERERS)
@pytest.mark.parametrize(
    ("name", "two_sided"),
    [
        ("area_indexerror", True),
        ("dark_room_area_indexerror", False),
        ("area_camera_on_ball", False),
        ("area_camera_on_emitting_ball", False),
    ],
)
def test_rooms_without_light_and_balls_seen_from_their_own_skin_are_black(name, two_sided, rule):
    """A closed room, the light outside; a camera at exactly a ball's radius: its inside neither glows nor reflects."""
    image = RENDERERS[rule](case(name, two_sided=two_sided), Exact())
    assert (image.mean == 0).all()
    assert (image.background == 0).all()


@pytest.mark.parametrize("rule", RENDERERS)
@pytest.mark.parametrize("ulps", [-2, -1, 0, 1, 2])
def test_a_camera_on_a_ball_within_rounding_looks_from_inside(ulps, rule):
    """Both rules, from any last digit: the floor is hidden by the ball's far side, which is black from there."""
    place = 0.3 + 0.1
    for _ in range(abs(ulps)):
        place = float(np.nextafter(place, np.sign(ulps)))
    ball = Ellipsoid.sphere((0.3, 0.1, 0.0), 0.1, Material((0.5, 0.5, 0.5), emission=(1, 1, 1)))
    view = Camera((place, 0.1, 0.0), (0.0, 0.1, 0.0), (0.0, 1.0, 0.0), 60.0)
    made = scene(floor(), ellipsoids=(ball,), lights=(lamp(),), camera=view, size=(12, 8))
    assert (RENDERERS[rule](made, Exact()).mean == 0).all()
    away = replace(view, position=(place + 1e-9, 0.1, 0.0))  # the planted defect of a bound that swallows too much
    assert (RENDERERS[rule](made.with_(camera=away), Exact()).mean[:, 2:6, 3:9] >= 1).all()


def test_a_camera_in_a_triangles_plane_does_not_see_it():
    wall = quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), GLOW)
    view = Camera((-3.0, 0.2, 0.0), (0.0, 0.2, 0.0), (0.0, 1.0, 0.0), 40.0)
    for made in (scene(wall, camera=view), scene(wall, camera=view, two_sided=True)):
        for draw in RENDERERS.values():
            assert (draw(made, Exact()).mean == 0).all()


@pytest.mark.parametrize("rule", RENDERERS)
def test_every_renderer_moves_a_scene_near_the_origin(rule):
    """All its numbers are whole: what is moved by a million is, to rounding, what it was."""
    far = case("moved_by_a_million")

    def back(place):
        return tuple(v - 1e6 for v in place)

    near = far.with_(
        camera=replace(far.camera, position=back(far.camera.position), target=back(far.camera.target)),
        meshes=tuple(Mesh(mesh.vertices - 1e6, mesh.triangles, mesh.material) for mesh in far.meshes),
        ellipsoids=tuple(replace(ball, center=back(ball.center)) for ball in far.ellipsoids),
        lights=tuple(replace(light, corner=back(light.corner)) for light in far.lights),
    )
    draw = RENDERERS[rule]
    np.testing.assert_allclose(draw(far, Exact()).mean, draw(near, Exact()).mean, rtol=1e-12, atol=1e-12)


FRONT = Camera((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 10.0)
WALL = quad((-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0), GREY)
BLACK = quad((-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0), Material())
PLAIN = {
    "nothing at all": scene(camera=FRONT),
    "a light alone": scene(camera=FRONT, lights=(lamp(),)),
    "a point light alone": scene(camera=FRONT, lights=(PointLight((0, 1, 0), (1, 1, 1)),)),
    "surfaces without a light": scene(WALL, camera=FRONT),
    "a light without radiance": scene(WALL, camera=FRONT, lights=(lamp(radiance=(0, 0, 0)),)),
    "black surfaces": scene(BLACK, camera=FRONT, lights=(lamp(),)),
    "a light behind the wall": scene(WALL, camera=FRONT, lights=(PointLight((0, 0, -3), (1, 1, 1)),)),
    "the back of a wall": scene(WALL, camera=replace(FRONT, position=(0, 0, -5)), lights=(lamp(),)),
    "a ball without a light": scene(ellipsoids=(Ellipsoid.sphere((0, 0, 0), 4, GREY),), camera=FRONT),
    "emitters everywhere": scene(camera=Camera((0, 1.9, 0), (0, 2.1, 0), (0, 0, 1), 10.0), lights=(lamp(half=2),)),
}


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (7, 1), (2, 2), (9, 6)])
@pytest.mark.parametrize("name", PLAIN)
def test_images_without_anything_to_refine(name, size):
    made = PLAIN[name].with_(width=size[0], height=size[1])
    for estimator in (Analytic(), Exact()):
        every, some, area = (draw(made, estimator) for draw in RENDERERS.values())
        for image in (some, area):
            np.testing.assert_allclose(image.mean, every.mean, atol=1e-12)
            np.testing.assert_array_equal(image.background, every.background)
            np.testing.assert_array_equal(image.emitter, every.emitter)


def test_one_pixel_is_the_mean_of_many():
    """A single pixel has no neighbours to tell how wrong it is: it is shaded until finer points agree."""
    made = scene(WALL, camera=FRONT, lights=(PointLight((0.4, 0.3, 1.0), (1, 1, 1)),), size=(1, 1))
    fine = render(made.with_(width=256, height=256), Area()).mean.mean(axis=(1, 2))
    found = render_area(made, Area())
    np.testing.assert_allclose(found.image.mean[:, 0, 0], fine, rtol=1e-3)
