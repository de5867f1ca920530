"""Spheres and ellipsoids seen from inside, twice in a scene, or touching: what of them is in a point's way."""

from __future__ import annotations

import numpy as np
import pytest
from builders import GREY, floor, geometry, lamp, scene
from places import TEST_SCENES

from nusselt.renderer.camera.rays import pixel_centres
from nusselt.renderer.camera.view import look
from nusselt.renderer.estimators import ESTIMATORS, Area, ControlVariate, Exact
from nusselt.renderer.image import render
from nusselt.renderer.lights import DirectionalLight, PointLight, QuadLight, SunLight
from nusselt.renderer.lights.sampling import random_beams
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Camera
from nusselt.renderer.scene_text import read_scene
from nusselt.renderer.surfaces import Ellipsoid
from nusselt.renderer.vectors import column, dot, transform, unit
from nusselt.renderer.visibility.segments import Blockers, body_side

CASES = TEST_SCENES
SAMPLED = [kind for kind in ESTIMATORS if kind is not Exact and kind.name != "analytic"]
"""`analytic` traces no shadow ray; `exact` traces none to a quad."""
AXES = ((1.9, 0.2, 0.0), (0.1, 0.9, 0.3), (-0.2, 0.1, 1.4))
WITHIN = Camera((0.0, 1.0, 0.5), (0.0, 1.2, -1.0), (0.0, 1.0, 0.0), 70.0)
OUTSIDE = (
    lamp(6.0, 1.0),
    PointLight((3, 4, 1), (9, 9, 9)),
    DirectionalLight((1, 2, 1), (1, 1, 1)),
    SunLight((0, 1, 0.2), (1, 1, 1), 8.0),
)


def shining(made, kind):
    image = render(made, kind(samples=16, stratified=True))
    return image.mean[:, image.shaded]


def as_seen(made):
    """Shading points of an image's pixels, and the sources."""
    made, g, needs = prepare(made)
    return look(made, g, *pixel_centres(range(made.width), range(made.height))).points, needs.sources


def inside_of(body, light, two_sided=True):
    return scene(ellipsoids=(body,), lights=(light,), camera=WITHIN, size=(24, 24), two_sided=two_sided)


@pytest.mark.parametrize("light", OUTSIDE, ids=lambda light: type(light).__name__)
@pytest.mark.parametrize("body", [Ellipsoid.sphere((0, 1, 0), 2.0, GREY), Ellipsoid((0, 1, 0), AXES, GREY)])
def test_no_light_gets_into_a_two_sided_body(body, light):
    made = inside_of(body, light)
    points, (source,) = as_seen(made)
    assert points.count > 400
    assert (points.ellipsoid == -1).all()  # none lies on its outside
    d, weight = random_beams(light, points.position, np.random.default_rng(1), 25, True)
    above = (dot(points.normal[:, :, None], d) > 0) & (weight > 0)
    assert above.sum() > 100
    for normal in (points.normal, None):
        assert not source.blockers.visible(points.position, points.ellipsoid, d, light.at_infinity, normal)[above].any()
    for kind in (Area, *SAMPLED[1:4]):
        assert not shining(made, kind).any()


@pytest.mark.parametrize("kind", SAMPLED)
def test_the_case_of_a_light_outside_a_two_sided_sphere(kind):
    made = read_scene(CASES / "inside_two_sided_sphere.test").with_(two_sided=True)
    estimator, needs = kind(samples=256, stratified=True), prepare(made).needs
    image = render(made, estimator, seed=2, passes=16 if estimator.is_random(needs) else 1)
    found, free = image.mean[0][image.shaded], render(made, ESTIMATORS[0]()).mean[0][image.shaded]
    assert (free > 0).sum() > 400
    whole = render(made, estimator, seed=2, everything=True)
    np.testing.assert_allclose(whole.mean, render(made, estimator, seed=2).mean, rtol=1e-12, atol=1e-15)
    if kind.name.startswith(("common", "control")):  # the closed form less a sum that has noise, or an error of 1/N
        assert np.abs(found).max() < 0.05 * free.max()
    else:
        assert (found == 0).all()


@pytest.mark.parametrize("kind", [*SAMPLED, Exact])
@pytest.mark.parametrize("body", [Ellipsoid.sphere((0, 1, 0), 2.0, GREY), Ellipsoid((0, 1, 0), AXES, GREY)])
def test_a_light_inside_a_body_lights_all_of_it(kind, body):
    light = QuadLight((-0.2, 1.6, -0.2), (0, 0, 0.4), (0.4, 0, 0), (5, 5, 5))
    made = inside_of(body, light)
    free = render(made.with_(name="free"), ESTIMATORS[0]()).mean
    image = render(made, kind(samples=64, stratified=True), seed=4, passes=4)
    assert (free[:, image.shaded] > 0).sum() > 300
    if kind.name.startswith(("common", "control", "exact", "visibility-analytic")):
        np.testing.assert_allclose(image.mean, free, rtol=1e-9, atol=1e-12)
    else:
        np.testing.assert_allclose(image.mean[:, image.shaded].mean(), free[:, image.shaded].mean(), rtol=0.02)


def test_a_sphere_around_everything_hides_nothing_within_and_everything_without():
    things = {"lights": (lamp(2.0),), "camera": Camera((0, 3, 6), (0, 0, 0), (0, 1, 0), 40.0)}
    alone = scene(floor(), **things, two_sided=True)
    around = alone.with_(ellipsoids=(Ellipsoid.sphere((0, 0, 0), 50.0, GREY),))
    free = ControlVariate(samples=16, stratified=True)  # no noise where nothing is hidden
    one, other = render(alone, free), render(around, free)
    on_floor = one.shaded & (one.mean[0] > 0)
    assert on_floor.sum() > 100
    np.testing.assert_allclose(other.mean[:, on_floor], one.mean[:, on_floor], rtol=1e-12)
    outdoors = around.with_(lights=(PointLight((0, 60, 0), (5e3, 5e3, 5e3)),))
    assert not render(outdoors, Area()).mean.any()
    assert render(outdoors.with_(ellipsoids=()), Area()).mean.any()


@pytest.mark.parametrize("kind", SAMPLED)
def test_a_sphere_given_twice_is_that_sphere(kind):
    made = read_scene(CASES / "coincident_spheres.test")
    once = made.with_(ellipsoids=made.ellipsoids[:1])
    estimator = kind(samples=16, stratified=True)
    np.testing.assert_array_equal(render(made, estimator, seed=1).mean, render(once, estimator, seed=1).mean)


def bodies(rng, spread: float, place: float):
    """An ellipsoid of random axes about a random place, and points of it with their outward normals."""
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    r, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    axes = q * 10.0 ** rng.uniform(-spread, 0, 3) @ r
    g = geometry(ellipsoids=(Ellipsoid(tuple(rng.normal(size=3) * place), tuple(map(tuple, axes))),))
    u = unit(rng.normal(size=(3, 200)))
    return g, g.center + transform(g.axes[0], u), unit(transform(g.inverse[0].T, u)), u


@pytest.mark.parametrize("spread", [0, 1, 3, 6])
@pytest.mark.parametrize("place", [0.0, 1.0, 1e4])
def test_points_of_a_body_are_on_it_and_their_normals_tell_the_side(spread, place):
    rng = np.random.default_rng(5)
    for _ in range(30):
        g, p, n, u = bodies(rng, spread, place)
        assert (body_side(g, 0, p) == 0).all()
        assert (body_side(g, 0, p, n) == 0).all()
        assert (body_side(g, 0, p, -n) == -1).all()
        far = max(1e-9, 1e-13 * place) * 10.0 ** (2 * spread)
        if far < 0.1:
            assert (body_side(g, 0, g.center + transform(g.axes[0], (1 + far) * u)) == 1).all()
            assert (body_side(g, np.zeros(200, dtype=int), g.center + transform(g.axes[0], (1 - far) * u)) == -1).all()


@pytest.mark.parametrize("gap", [0.0, 1e-10, 1e-6])
@pytest.mark.parametrize("far", [0.0, 1e3])
def test_touching_spheres_shadow_each_other_up_to_where_they_touch(gap, far):
    """From a sphere's top, at an angle from the contact: blocked below the neighbour's horizon, and not above it."""
    first, second = Ellipsoid.sphere((far, 0, 0), 1.0), Ellipsoid.sphere((far + 2 + gap, 0, 0), 1.0)
    g = geometry(ellipsoids=(first, second))
    angle = 10.0 ** np.linspace(-4, -0.5, 60)
    u = np.stack([np.cos(angle), np.sin(angle), 0 * angle])
    p = g.center[:, [0]] + u
    towards = g.center[:, [1]] - p
    distance = np.sqrt(dot(towards, towards))
    # The tangent plane of the point and the cone about the neighbour: directions by their angle from its centre.
    half = np.arcsin(1 / distance)
    up = np.stack([-np.sin(angle), np.cos(angle), 0 * angle])
    across = unit(up - unit(towards) * dot(up, unit(towards)))
    for factor, blocked in ((1 - 1e-3, True), (1 + 1e-3, False)):
        d = unit(towards) * np.cos(factor * half) + across * np.sin(factor * half)
        own = np.zeros(60, dtype=int)
        above = dot(u, d) > 0
        assert above.sum() > 30
        for normal in (u, None):
            seen = Blockers.everything(g).visible(p, own, d[:, :, None], True, normal)[:, 0]
            assert (seen[above] != blocked).all()


@pytest.mark.parametrize("end", ["near", "far"])
def test_a_lamp_on_a_sphere_is_seen_from_its_own_side_alone(end):
    """The far end within rounding of the surface: it is not in its own way, and the body is not in front of it."""
    rng = np.random.default_rng(8)
    ball = Ellipsoid.sphere((0.3, 0.7, 0.1), 0.7)
    g = geometry(ellipsoids=(ball,))
    u = unit(rng.normal(size=(3, 500)))
    q = g.center + 0.7 * u
    aside = unit(rng.normal(size=(3, 500)))
    aside *= np.sign(dot(aside, u)) * (1 if end == "near" else -1)
    p = q + 3 * aside
    outside = body_side(g, 0, p) > 0
    seen = Blockers.everything(g).visible(p, np.full(500, -1), (q - p)[:, :, None], False)[:, 0]
    steep = outside & (np.abs(dot(aside, u)) > 1e-3)
    assert steep.sum() > 400
    assert (seen[steep] == (end == "near")).all()


def test_far_from_the_origin_the_side_is_known_as_well_as_the_place():
    g = geometry(ellipsoids=(Ellipsoid.sphere((1e6, 0, 0), 1.0),))
    for offset, side in ((1 + 1e-6, 1), (1 - 1e-6, -1), (1 + 1e-9, 0)):
        assert body_side(g, 0, column((1e6 - offset, 0, 0)))[0] == side
