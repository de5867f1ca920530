"""The triangle light: its sampling, its closed form, and its exact shadows: two of them are a parallelogram."""

from dataclasses import replace

import numpy as np
import pytest
from builders import box, floor, scene
from mpmath import mp, mpf
from scipy.stats import chi2
from test_lights import shading_points_of

from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Analytic, Area, Exact
from nusselt.renderer.image import render
from nusselt.renderer.lights import QuadLight, TriangleLight
from nusselt.renderer.lights.sampling import unit_square
from nusselt.renderer.scene import Camera
from nusselt.renderer.scene_text import parse_scene
from nusselt.renderer.surfaces import Ellipsoid, Material
from nusselt.renderer.vectors import column, cross, dot, unit

WHITE = (1.0, 1.0, 1.0)
TILTED = TriangleLight((-0.5, 1.0, -0.25), (0.75, 1.25, 0.0), (0.0, 1.5, 1.0), WHITE)
FALSE_ALARM = 1e-6


def halves(quad):
    """A parallelogram's two, of the same front."""
    p, ab, ac = (np.array(v) for v in (quad.corner, quad.ab, quad.ac))
    corners = [(p, p + ac, p + ab), (p + ac, p + ac + ab, p + ab)]
    return tuple(TriangleLight(*(tuple(v.tolist()) for v in three), quad.radiance) for three in corners)


def uniformity(first, second):
    """p-value of chi^2 that places a + x ab + y ac are uniform: 8 strips of equal area by 12 parts of each."""
    strip = np.minimum((1 - (1 - first) ** 2) * 8, 7).astype(int)
    along = np.minimum(second / (1 - first) * 12, 11).astype(int)
    counts = np.bincount(strip * 12 + along, minlength=96)
    expected = first.size / 96
    return chi2.sf(((counts - expected) ** 2 / expected).sum(), 95)


@pytest.mark.parametrize("stratified", [False, True])
def test_points_are_uniform_in_area(stratified):
    u, v = unit_square(np.random.default_rng(11), 4000, 49, stratified)
    d, weight = TILTED.beams(np.zeros((3, 4000)), u, v)
    a, ac, ab = TILTED.columns
    normal, to = cross(ab, ac), d.reshape(3, -1) - a
    square = dot(normal, normal)
    first, second = dot(cross(to, ac), normal) / square, dot(cross(ab, to), normal) / square
    assert min(first.min(), second.min(), (1 - first - second).min()) > -1e-14
    assert uniformity(first, second) > FALSE_ALARM
    assert uniformity(first**2, second * (1 - first**2) / (1 - first)) < FALSE_ALARM
    length = np.sqrt(dot(d, d))
    facing = -dot(column(TILTED.normal)[:, :, None], d) / length
    right = TILTED.area * np.maximum(facing, 0) / length**2 / 49
    np.testing.assert_allclose(weight, right, rtol=1e-11, atol=0)


def irradiance(light, at, normal):
    radiance, bound = light.unshadowed(shading_points_of(at, normal), False)
    return np.pi * radiance[0], bound


def polygon(light, at, normal):
    """Lambert's formula for a triangle above the horizon, to 50 digits."""
    rays = [[mpf(c) - mpf(p) for c, p in zip(corner, at, strict=True)] for corner in (light.a, light.c, light.b)]
    n = [mpf(x) for x in normal]
    total = mpf(0)
    for k in range(3):
        a, b = rays[k], rays[(k + 1) % 3]
        x = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        sine = mp.sqrt(sum(t * t for t in x))
        turn = mp.atan2(sine, sum(s * t for s, t in zip(a, b, strict=True)))
        total += turn / sine * sum(s * t for s, t in zip(n, x, strict=True)) / 2
    return total


def triangle_of(width, height, away):
    """Before the origin, facing it."""
    return TriangleLight((-width, 0.0, away), (0.0, height, away), (width, 0.25 * height, away), WHITE)


CASES = {
    "wide": triangle_of(1.0, 1.0, 0.5),
    "very small": triangle_of(1e-9, 1e-9, 1.0),
    "far away": triangle_of(1.0, 1.0, 1e9),
    "a needle": triangle_of(1.0, 1e-7, 1.0),
    "very near": triangle_of(1.0, 1.0, 1e-7),
}


@pytest.mark.parametrize("case", CASES)
def test_irradiance_to_50_digits_within_its_bound(case):
    light = CASES[case]
    near = case == "very near"
    rng = np.random.default_rng(13)
    at = np.zeros((3, 40)) if near else 0.1 * rng.standard_normal((3, 40)) * np.abs(light.a[2])
    normal = unit(column((0.0, 0.0, 1.0)) + (0.0 if near else 0.2) * rng.standard_normal((3, 40)))
    above = np.flatnonzero(dot(normal[:, None], light.hull()[:, :, None] - at[:, None]).min(axis=0) > 0)
    at, normal = at[:, above], normal[:, above]
    assert above.size > 10
    value, bound = irradiance(light, at, normal)
    assert (value > 0).all()
    with mp.workdps(50):
        right = [polygon(light, p, n) for p, n in zip(at.T, normal.T, strict=True)]
        error = np.array([float(abs(mpf(mine) / true - 1)) for mine, true in zip(value, right, strict=True)])
    assert (error <= bound + 4e-16).all()
    assert bound.max() < (0.1 if near else 1e-6)  # what is seen edge-on is a difference, and says so


QUAD = QuadLight((-0.5, 2.0, -0.25), (0.125, 0.5, 1.0), (1.5, 0.0, 0.25), WHITE)


def anywhere(count, seed):
    """Points, normals and mirrors of all kinds, many of them across horizons; some in the light's own plane."""
    rng = np.random.default_rng(seed)
    at = rng.uniform(-2, 3, (3, count))
    at[:, :5] = QUAD.at(2.0, 3.0) + rng.uniform(0, 1, 5) * column(QUAD.ab)
    normal, mirror = unit(rng.standard_normal((2, 3, count)).transpose(1, 0, 2)).transpose(1, 0, 2)
    normal = normal * np.where(rng.random(count) < 0.5, 1, np.sign(dot(normal, QUAD.at(0.5, 0.5) - at)))
    return at, normal, mirror * np.sign(dot(mirror, normal))


def test_two_halves_are_a_parallelogram_for_every_lobe():
    at, normal, mirror = anywhere(1500, 14)
    s = np.random.default_rng(15).choice([0.0, 1.0, 2.5, 20.0, 300.0], at.shape[1])
    points = replace(shading_points_of(at, normal), mirror=mirror).with_columns(shininess=s)
    shiny = points.with_columns(diffuse=np.zeros(at.shape), specular=np.ones(at.shape))
    for of in (points, shiny):
        right, room = QUAD.unshadowed(of, True)
        parts = [half.unshadowed(of, True) for half in halves(QUAD)]
        doubt = room * right[0] + sum(bound * radiance[0] for radiance, bound in parts)
        found = parts[0][0] + parts[1][0]
        assert (np.abs(found - right)[0] <= doubt + 1e-15 * right.max()).all()
        assert np.median(doubt[right[0] > 1e-3 * right.max()] / right[0][right[0] > 1e-3 * right.max()]) < 1e-11
        assert (right[0] > 0).sum() > 300
        # One of them counted double would be seen.
        assert (np.abs(found + parts[0][0] - right)[0] > doubt + 1e-15 * right.max()).any()


def blocked_room(lights, **options):
    view = Camera((0.3, 2.2, 5.0), (0.0, 0.7, 0.0), (0.0, 1.0, 0.0), 42.0)
    shiny = Material((0.6, 0.5, 0.4), (0.3, 0.3, 0.3), 12.0)
    things = floor(2.0, 0.0, shiny), box((0.0, 0.0, -0.3), (0.5, 0.8, 0.3)), box((-0.9, 1.0, -0.2), (-0.3, 1.1, 0.5))
    ball = (Ellipsoid.sphere((-0.6, 0.3, 0.9), 0.3, shiny),)
    return scene(*things, lights=lights, ellipsoids=ball, size=(40, 30), camera=view, **options)


def test_exact_shadows_of_two_halves_are_those_of_the_parallelogram():
    right = render(blocked_room((QUAD,)), Exact())
    found = render(blocked_room(halves(QUAD)), Exact())
    assert set(found.routes) <= {"unlit", "lit", "hidden", "exact", "coarse"}
    assert found.routes["exact"] > 100
    difference = np.abs(found.mean - right.mean)[:, right.shaded]
    assert difference.max() < 1e-10 * right.mean.max()
    whole = render(blocked_room((QUAD,)), Analytic()).mean
    assert np.abs(right.mean - whole)[:, right.shaded].max() > 0.1 * whole[:, right.shaded].max()
    # And they are shadows of the half that shines: sampled, the same.
    alone = halves(QUAD)[:1]
    exact, sampled = (render(blocked_room(alone), way, seed=3, passes=4) for way in (Exact(), Area(samples=256)))
    error = np.sqrt(sampled.pixel_variance / 4)[right.shaded]
    off = (exact.mean - sampled.mean).mean(axis=0)[right.shaded]
    assert abs(off.sum()) < 5 * np.sqrt((error**2).sum())
    assert np.abs(off).max() < 8 * error.max()


def test_shortcuts_change_nothing():
    one, other = (render(blocked_room(halves(QUAD)[1:]), Exact(shortcuts=way)).mean for way in (True, False))
    np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    ("line", "named"),
    [
        ("0 0 0 1 0 0 2 0 0 1 1 1", "triLight c"),
        ("0 0 0 0 0 0 2 0 0 1 1 1", "triLight c"),
        ("0 0 0 1e200 0 0 0 1e200 0 1 1 1", "triLight area"),
        ("0 0 0 1 0 0 0 1 0 1 1 -1", "triLight radiance"),
    ],
)
def test_bad_triangles_are_refused(line, named):
    with pytest.raises(InputError, match=named):
        parse_scene(f"size 4 4\ncamera 0 0 1 0 0 0 0 1 0 45\ntriLight {line}\n")


def test_the_camera_sees_its_front_and_its_black_back():
    for order, seen in ((1, 2.0), (-1, 0.0)):
        corners = ((-0.7, 0.0, 0.0), (0.7, 0.0, 0.0), (0.0, 1.0, 0.0))[::order]
        light = TriangleLight(*corners, (2.0, 2.0, 2.0))
        made = scene(floor(2.0, -1.0), lights=(light,), camera=Camera((0, 0.5, 4), (0, 0.5, 0), (0, 1, 0), 40))
        image = render(made, Analytic())
        on = image.emitter > 0
        assert 20 < on.sum() < 300
        assert (image.mean[:, on] == seen).all()
