"""Sensors: irradiance at points, exact and sampled, in the text and far from the origin."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from builders import box, floor, lamp, scene
from scipy import stats

from nusselt.renderer.camera.rays import pixel_centres
from nusselt.renderer.camera.view import look
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import ESTIMATORS, Analytic, Area, Exact
from nusselt.renderer.image import read_sensors, render
from nusselt.renderer.lights import PointLight
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene_text import parse_scene, write_scene
from nusselt.renderer.sensor import Sensor
from nusselt.renderer.surfaces import Ellipsoid, Material

UP = (0.0, 1.0, 0.0)
BLOCK = box((-0.3, 0.8, -0.3), (0.3, 1.0, 0.3))
LAMP = lamp()
LEVEL = 1e-6


def room(*sensors: Sensor, light=LAMP):
    return scene(floor(), BLOCK, lights=(light,), sensors=sensors)


def test_most_estimators_are_tried():
    assert {"area", "area-lattice", "common-points", "control-variate"} <= {kind.name for kind in UNBIASED}


def test_a_sensor_reads_what_a_white_floor_reflects_times_pi():
    """At the very points of a rendered floor, shadow and penumbra among them."""
    white = Material((1.0, 1.0, 1.0))
    seen = scene(floor(material=white), BLOCK, lights=(lamp(),), size=(24, 18))
    image = render(seen, Exact())
    prepared = prepare(seen)
    x, y = pixel_centres(range(24), range(18))
    view = look(prepared.scene, prepared.geometry, x, y)
    on = np.flatnonzero(np.abs(view.hits.position[1]) < 1e-12)
    sensors = tuple(Sensor(tuple(p), UP) for p in view.hits.position[:, on].T.tolist())
    found = read_sensors(seen.with_(sensors=sensors), Exact()).mean[:, 0]
    expected = math.pi * image.mean.reshape(3, -1)[:, on]
    np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-13)
    assert (found[0] == 0).any()
    assert (found[0] > 0).any()


MIXED = room(Sensor((0.9, 0.0, 0.2), UP), Sensor((0.0, 0.0, 1.2), UP), Sensor((1.5, 0.4, 0.0), (-1.0, 0.3, 0.0)))
"""Lit, half in shadow, and tilted."""
UNBIASED = [k for k in ESTIMATORS if k(samples=16).claim(prepare(MIXED, everything=True).needs) == "unbiased"]


@pytest.mark.parametrize("kind", UNBIASED)
def test_every_unbiased_estimator_reads_the_exact_value(kind):
    """Student's t at a level of 1e-6 each, of sums over sensors, which may share their light points."""
    made, estimator = MIXED, kind(samples=16)
    exact = read_sensors(made, Exact()).mean[0, 0].sum()
    sums = [read_sensors(made, estimator, seed=seed).mean[0, 0].sum() for seed in range(64)]
    z = (np.mean(sums) - exact) / (np.std(sums, ddof=1) / 8)
    assert abs(z) < stats.t.isf(LEVEL / 2, 63)
    wrong = (np.mean(sums) - 1.25 * exact) / (np.std(sums, ddof=1) / 8)
    assert abs(wrong) > stats.t.isf(LEVEL / 2, 63)


def test_a_point_light_is_its_cosine_law():
    made = room(Sensor((1.0, 0.0, 0.0), UP), light=PointLight((1.0, 3.0, 4.0), (50.0, 25.0, 0.0)))
    np.testing.assert_allclose(read_sensors(made, Area()).mean[:, 0, 0], np.array([50, 25, 0]) / 25 * 0.6, rtol=1e-14)


def test_a_sensor_on_a_sphere_is_not_in_its_shadow():
    ball = Ellipsoid.sphere((0.1, 0.7, -0.2), 0.37)
    normal = np.array((0.3, 0.9, 0.2)) / math.sqrt(0.94)
    on = Sensor(tuple((np.array(ball.center) + 0.37 * normal).tolist()), tuple(normal.tolist()))
    lights = (PointLight((2.0, 5.0, 1.0), (1.0, 1.0, 1.0)),)
    bare, with_ball = scene(lights=lights, sensors=(on,)), scene(ellipsoids=(ball,), lights=lights, sensors=(on,))
    assert read_sensors(with_ball, Area()).mean.max() > 0
    np.testing.assert_allclose(read_sensors(with_ball, Area()).mean, read_sensors(bare, Area()).mean, rtol=1e-12)


def test_sensors_change_no_pixel_and_are_not_moved_by_where_the_scene_is():
    made = room(Sensor((0.9, 0.0, 0.2), UP))
    assert made.digest() == made.with_(sensors=()).digest()
    step = np.array((1e6, 2e6, 1e6))

    def at(place):
        return tuple((np.array(place) + step).tolist())

    camera = made.camera
    far = made.with_(
        camera=replace(camera, position=at(camera.position), target=at(camera.target)),
        meshes=tuple(replace(mesh, vertices=mesh.vertices + step[:, None]) for mesh in made.meshes),
        lights=tuple(light.moved(-step) for light in made.lights),
        sensors=tuple(replace(sensor, position=at(sensor.position)) for sensor in made.sensors),
    )
    np.testing.assert_allclose(read_sensors(far, Exact()).mean, read_sensors(made, Exact()).mean, rtol=1e-9)


TEXT = """quadLight -1 2 -1  0 0 2  2 0 0  5 5 5
sensor 0 0 0  0 2 0
expect 1 2 3 0.7
sensorGrid 0 0 0  1 0 0  0 0 3  0 1 0  2 3
"""


def test_sensors_are_read_and_written_and_need_no_camera():
    made = parse_scene(TEXT)
    assert len(made.sensors) == 7
    assert made.sensors[0] == Sensor((0, 0, 0), UP, (1, 2, 3), 0.7)
    assert [sensor.position for sensor in made.sensors[1:4]] == [(0.25, 0, 0.5), (0.75, 0, 0.5), (0.25, 0, 1.5)]
    assert parse_scene(write_scene(made)) == made
    assert render(made, Analytic()).mean.shape == (3, 1, 1)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("expect 1 1 1 0", "expect"),
        ("sensor 0 0 0 0 0 0", "sensor normal"),
        ("sensor 0 0 0 0 1 0\nexpect 1 1 1 -2", "expect percent"),
        ("sensor 0 0 0 0 1 0\nexpect 1 -1 1 2", "expect irradiance"),
        ("sensor 0 0 0 0 1 0\nexpect 1 1 1 2\nexpect 1 1 1 2", "expect"),
        ("sensorGrid 0 0 0  1 0 0  0 0 1  0 1 0  2.5 1", "sensorGrid nab"),
        ("sensorGrid 0 0 0  1 0 0  0 0 1  0 1 0  300 300", "sensorGrid nab"),
        ("sensor 0 0 0", "sensor normal.x"),
    ],
)
def test_bad_sensors_are_refused_at_their_line(text, named):
    with pytest.raises(InputError, match=named) as told:
        parse_scene(text, where="a.test")
    assert f"a.test:{text.count(chr(10)) + 1}" in str(told.value)


def test_a_scene_without_sensors_has_nothing_to_read():
    with pytest.raises(InputError, match="sensors"):
        read_sensors(scene(floor()), Area())
