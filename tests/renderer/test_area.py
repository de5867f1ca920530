"""The area estimator: unbiased against closed forms worked out here, and as noisy as it should be."""

from __future__ import annotations

import math

import numpy as np
import pytest
from builders import GREY, box, floor, lamp, scene
from scipy import stats

from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import ESTIMATORS, Area, estimator_named
from nusselt.renderer.image import render
from nusselt.renderer.lights import DirectionalLight, PointLight, SunLight
from nusselt.renderer.scene import Camera
from nusselt.renderer.surfaces import Ellipsoid, Material

FALSE_ALARM = 1e-6
DOWN = Camera((0.0, 3.0, 1e-3), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), 30.0)


def floor_points(s):
    """Where the camera's pixels meet y = 0, computed here."""
    look = np.array(s.camera.target) - np.array(s.camera.position)
    look /= np.linalg.norm(look)
    right = np.cross(look, s.camera.up)
    right /= np.linalg.norm(right)
    up = np.cross(right, look)
    t = math.tan(math.radians(s.camera.fov_y) / 2)
    x, y = np.meshgrid(np.arange(s.width) + 0.5, np.arange(s.height) + 0.5)
    d = (
        look[:, None, None]
        + t * s.width / s.height * (2 * x / s.width - 1) * right[:, None, None]
        + t * (1 - 2 * y / s.height) * up[:, None, None]
    )
    p = np.array(s.camera.position)[:, None, None] + d * (-s.camera.position[1] / d[1])
    return p, -d / np.linalg.norm(d, axis=0)


def test_point_light_is_intensity_cosine_over_squared_distance():
    s = scene(floor(), lights=(PointLight((0.3, 1.5, 0.2), (2.0, 3.0, 4.0)),), camera=DOWN)
    p, _ = floor_points(s)
    to = np.array([0.3, 1.5, 0.2])[:, None, None] - p
    r2 = (to**2).sum(axis=0)
    expected = 0.5 / math.pi * (to[1] / np.sqrt(r2)) / r2 * np.array([2.0, 3.0, 4.0])[:, None, None]
    np.testing.assert_allclose(render(s, Area()).mean, expected, rtol=1e-12)


def test_directional_light_is_irradiance_times_cosine():
    s = scene(floor(), lights=(DirectionalLight((1.0, 2.0, 2.0), (3.0, 3.0, 6.0)),), camera=DOWN)
    expected = 0.5 / math.pi * (2 / 3) * np.array([3.0, 3.0, 6.0])[:, None, None]
    image = render(s, Area())
    np.testing.assert_allclose(image.mean, np.broadcast_to(expected, image.mean.shape), rtol=1e-13)


@pytest.mark.parametrize("exponent", [0.0, 1.0, 7.5, 1000.0])
def test_modified_phong_of_a_directional_light_is_the_formula(exponent):
    shiny = Material((0.2, 0.3, 0.4), (0.5, 0.6, 0.7), exponent)
    s = scene(floor(material=shiny), lights=(DirectionalLight((0.1, 1.0, 0.05), (1.0, 1.0, 1.0)),), camera=DOWN)
    _, outgoing = floor_points(s)
    light = np.array([0.1, 1.0, 0.05]) / np.linalg.norm([0.1, 1.0, 0.05])
    mirror = np.stack([-outgoing[0], outgoing[1], -outgoing[2]])
    cosine = np.einsum("chw,c->hw", mirror, light)
    lobe = (exponent + 2) / (2 * math.pi) * np.maximum(cosine, 0) ** exponent
    kd, ks = (np.array(v)[:, None, None] for v in (shiny.diffuse, shiny.specular))
    expected = (kd / math.pi + ks * lobe) * light[1]
    np.testing.assert_allclose(render(s, Area()).mean, expected, rtol=1e-9 if exponent > 100 else 1e-12)


def test_exponent_zero_is_one_above_the_mirrors_horizon_and_zero_below():
    shiny = Material((0, 0, 0), (1, 1, 1), 0.0)
    view = Camera((0.0, 0.2, 3.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 5.0)
    above = scene(floor(material=shiny), lights=(DirectionalLight((0, 1, -0.2), (1, 1, 1)),), camera=view)
    below = scene(floor(material=shiny), lights=(DirectionalLight((0, 0.03, 1), (1, 1, 1)),), camera=view)
    assert render(above, Area()).mean[:, 12, 16] == pytest.approx(2 / (2 * math.pi) / math.sqrt(1.04))
    assert (render(below, Area()).mean[:, 12, 16] == 0).all()


def z_of_mean(image, expected: np.ndarray, passes: int) -> float:
    """Pooled deviation in standard errors; pixels are independent, so that it is standard normal."""
    s = image.shaded
    error = math.sqrt(float(image.pixel_variance[s].sum()) / passes)
    return float((image.mean - expected).mean(axis=0)[s].sum() / error)


@pytest.mark.parametrize("stratified", [False, True])
def test_area_light_is_unbiased_against_a_closed_form(stratified):
    """Centre of a square lamp straight above: the disk-free form E = 4/pi-type corner factor, by quadrature."""
    s = scene(floor(), lights=(lamp(1.5, 0.4),), camera=DOWN, size=(16, 12))
    p, _ = floor_points(s)
    nodes, weights = np.polynomial.legendre.leggauss(24)
    x, z = (0.4 * v for v in np.meshgrid(nodes, nodes))
    w = np.outer(weights, weights) * 0.16
    dx, dz = x[:, :, None, None] - p[0], z[:, :, None, None] - p[2]
    r2 = dx**2 + dz**2 + 1.5**2
    expected = 0.5 / math.pi * 5.0 * (w[:, :, None, None] * 1.5**2 / r2**2).sum(axis=(0, 1))
    image = render(s, Area(samples=16, stratified=stratified), seed=5, passes=200)
    # the camera itself does not block: it is no surface
    z_score = z_of_mean(image, np.broadcast_to(expected, image.mean.shape), 200)
    assert 2 * stats.norm.sf(abs(z_score)) > FALSE_ALARM
    planted = z_of_mean(image, np.broadcast_to(expected * 1.01, image.mean.shape), 200)
    assert 2 * stats.norm.sf(abs(planted)) < FALSE_ALARM


def test_strata_lower_the_variance_where_nothing_blocks():
    s = scene(floor(), lights=(lamp(),))
    random = render(s, Area(samples=16), seed=1, passes=20).pixel_variance.mean()
    strata = render(s, Area(samples=16, stratified=True), seed=1, passes=20).pixel_variance.mean()
    assert strata < random / 8


def test_variance_falls_as_one_over_n_for_random_points():
    s = scene(floor(), lights=(lamp(),))
    few, many = (render(s, Area(samples=n), seed=2, passes=60).pixel_variance.mean() for n in (4, 64))
    assert few / many == pytest.approx(16, rel=0.1)


def test_lights_are_summed():
    one, other = lamp(), PointLight((1, 1, 1), (1, 2, 3))
    both = render(scene(floor(), lights=(one, other)), Area(), seed=3)
    first = render(scene(floor(), lights=(one,)), Area(), seed=3)
    second = render(scene(floor(), lights=(lamp(radiance=(0, 0, 0)), other)), Area(), seed=3)
    shaded = both.shaded
    np.testing.assert_allclose(both.mean[:, shaded], (first.mean + second.mean)[:, shaded], rtol=1e-13)


def test_sun_is_the_directional_light_it_tends_to():
    directional = scene(floor(), box((-0.3, 0, -0.3), (0.3, 1, 0.3)), lights=(DirectionalLight((1, 2, 1), (1, 1, 1)),))
    sun = scene(*directional.meshes, lights=(SunLight((1, 2, 1), (1, 1, 1), 1e-4),))
    a, b = render(directional, Area()), render(sun, Area(samples=4), seed=1)
    same = np.isclose(a.mean, b.mean, rtol=1e-5, atol=1e-12).all(axis=0)
    assert same.mean() > 0.995  # all but pixels on the shadow's edge


def test_ball_on_a_floor_is_lit_above_and_dark_below():
    ball = Ellipsoid.sphere((0, 0.5, 0), 0.5, GREY)
    s = scene(
        floor(),
        ellipsoids=(ball,),
        lights=(lamp(3.0, 0.2),),
        camera=Camera((0, 0.5, 5), (0, 0.5, 0), (0, 1, 0), 15),
    )
    image = render(s, Area(samples=16, stratified=True), seed=0)
    assert image.mean[0, 4:9, 14:18].min() > 0
    assert (image.mean[0, 16, 14:18] == 0).all()


@pytest.mark.parametrize("name", [kind.name for kind in ESTIMATORS])
def test_every_estimator_is_found_by_its_name_and_told_of_bad_ones(name):
    assert estimator_named(name, 4, True).name == name
    with pytest.raises(InputError, match="one of"):
        estimator_named(name + "x", 1, False)


def test_strata_of_a_number_that_is_no_square_are_refused():
    with pytest.raises(InputError, match="square"):
        Area(samples=8, stratified=True)
