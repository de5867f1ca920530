"""The ball that shines: its sampling, its closed form against 40 digits and quadrature, and what is inside it."""

from dataclasses import replace

import numpy as np
import pytest
from builders import box, floor, scene
from mpmath import mp, mpf
from scipy.stats import chi2
from test_lights import shading_points_of

from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Analytic
from nusselt.renderer.image import render
from nusselt.renderer.lights import QuadLight, SphereLight
from nusselt.renderer.lights.sampling import unit_square
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Camera
from nusselt.renderer.scene_text import parse_scene
from nusselt.renderer.vectors import column, dot, frame, unit

WHITE = (1.0, 1.0, 1.0)
BALL = SphereLight((0.3, 1.2, -0.4), 0.8, WHITE)
FALSE_ALARM = 1e-6


def uniformity(height, angle):
    """p-value of chi^2 that (height, angle / 2 pi) in [0, 1)^2 are uniform: 8 by 12 cells."""
    cells = np.minimum(height * 8, 7).astype(int) * 12 + np.minimum(angle % 1.0 * 12, 11).astype(int)
    counts = np.bincount(cells, minlength=96)
    expected = height.size / 96
    return chi2.sf(((counts - expected) ** 2 / expected).sum(), 95)


@pytest.mark.parametrize("stratified", [False, True])
@pytest.mark.parametrize("distance", [0.81, 3.0, 1e7])
def test_directions_are_uniform_in_solid_angle_and_end_on_the_near_side(stratified, distance):
    at = np.repeat(column(BALL.center) + distance * unit(column((1.0, 2.0, -0.5))), 4000, axis=1)
    u, v = unit_square(np.random.default_rng(11), 4000, 49, stratified)
    d, weight = BALL.beams(at, u, v)
    axis = unit(column(BALL.center) - at)[:, :1]
    way = unit(d.reshape(3, -1))
    x, y = (dot(e, way) for e in frame(axis))
    # 1 - cos = sin^2 / (1 + cos), which keeps its digits
    sine2, cap2 = x * x + y * y, (BALL.radius / distance) ** 2
    height = sine2 / (1 + np.sqrt(1 - sine2)) / (cap2 / (1 + np.sqrt(1 - cap2)))
    assert uniformity(height, np.arctan2(y, x) / (2 * np.pi)) > FALSE_ALARM
    assert uniformity(height**0.95, np.arctan2(y, x) / (2 * np.pi)) < FALSE_ALARM
    np.testing.assert_allclose(weight, 2 * np.pi * cap2 / (1 + np.sqrt(1 - cap2)) / 49, rtol=2e-12)
    end = (at[:, :, None] + d) - column(BALL.center)[:, :, None]
    np.testing.assert_allclose(np.sqrt(dot(end, end)), BALL.radius, rtol=1e-12 * max(distance, 1))
    assert (dot(end, d) < 0).mean() > 0.999  # but for the rim's rounding


def irradiance(light, at, normal):
    radiance, bound = light.unshadowed(shading_points_of(at, normal), False)
    return np.pi * radiance[0], bound


def cap(light, at, normal):
    """Irradiance from the part of a ball above the horizon, to 40 digits: along its outline and the horizon."""
    v = [mpf(c) - mpf(p) for c, p in zip(light.center, at, strict=True)]
    n = [mpf(x) for x in normal]
    distance = mp.sqrt(sum(x * x for x in v))
    rho = mpf(light.radius) / distance
    k = mp.sqrt(1 - rho * rho)
    cos_t = sum(a * b for a, b in zip(n, v, strict=True)) / distance / mp.sqrt(sum(x * x for x in n))
    sin_t = mp.sqrt(1 - cos_t**2)
    if abs(cos_t) >= rho:
        return max(cos_t, mpf(0)) * mp.pi * rho**2
    cos_phi = -cos_t * k / (sin_t * rho)
    sin_phi = mp.sqrt(1 - cos_phi**2)
    psi = mp.atan2(rho * sin_phi, k * sin_t - rho * cos_phi * cos_t)
    return mp.acos(cos_phi) * rho**2 * cos_t - rho * k * sin_t * sin_phi + psi


CASES = {
    "wide": (0.8, 1.0, 1.5),
    "very small": (1e-9, 1.0, 0.3),
    "far away": (1.0, 1e12, 0.3),
    "almost touching": (1.0, 1 + 1e-12, 1.5),
    "huge": (1e9, 1e9 + 1.0, 1.5),
}


@pytest.mark.parametrize("case", CASES)
def test_irradiance_to_40_digits_within_its_bound(case):
    radius, distance, spread = CASES[case]
    rng = np.random.default_rng(13)
    way = unit(rng.standard_normal((3, 60)))
    at, normal = distance * way, unit(-way + spread * rng.standard_normal((3, 60)))
    light = SphereLight((0.0, 0.0, 0.0), radius, WHITE)
    value, bound = irradiance(light, at, normal)
    with mp.workdps(40):
        right = [cap(light, p, n) for p, n in zip(at.T, normal.T, strict=True)]
        errors = [float(abs(mpf(mine) - true)) for mine, true in zip(value, right, strict=True)]
    right = np.array(right, dtype=float)
    # A unit vector of float64 is off by its rounding, which the last bits of a cut light show.
    assert (np.array(errors) <= bound * value + 1e-15 * right.max()).all()
    assert (bound[value > 1e-3 * right.max()] < 1e-8).all()
    assert (right > 0).sum() > 20


@pytest.mark.parametrize("below", [1e-3, 1e-8])
def test_grazing_light_over_the_horizon(below):
    light = SphereLight((0.0, below - 0.5, 2.0), 0.5, WHITE)
    at, normal = np.zeros((3, 1)), column((0.0, 1.0, 0.0))
    value, bound = irradiance(light, at, normal)
    with mp.workdps(40):
        right = cap(light, (0, 0, 0), (0, 1, 0))
        assert 0 < right < below**2
        assert abs(mpf(value[0]) - right) <= max(bound[0], 1.0 if value[0] == 0 else 0.0) * max(value[0], float(right))


def receivers(count, seed, spread):
    """Points around the ball, their normals, and mirrors above those."""
    rng = np.random.default_rng(seed)
    way = unit(rng.standard_normal((3, count)))
    at = column(BALL.center) + way * rng.uniform(1.0, 4.0, count)
    normal, mirror = (unit(-way + spread * rng.standard_normal((3, count))) for _ in range(2))
    return at, normal, mirror * np.where(dot(mirror, normal) < 0, -1.0, 1.0)


def quadrature(light, at, normal, mirror, s, radial, around):
    """Lobe integral: Gauss-Legendre in the height of the cap, equal steps around."""
    nodes, weights = np.polynomial.legendre.leggauss(radial)
    u, v = np.repeat((nodes + 1) / 2, around)[None], np.tile((np.arange(around) + 0.5) / around, radial)[None]
    d, weight = light.beams(at, u, v)
    weight = weight * (np.repeat(weights / 2, around) * radial)
    length = np.sqrt(dot(d, d))
    cosine = np.maximum(dot(normal[:, :, None], d) / length, 0) * weight
    slant = dot(mirror[:, :, None], d) / length
    return (cosine * np.where(slant > 0, np.maximum(slant, 0) ** s[:, None], 0.0)).sum(axis=1)


@pytest.mark.parametrize(("radius", "spread", "room"), [(0.8, 1.5, 2e-3), (0.8, 0.1, 1e-10), (0.03, 0.1, 1e-11)])
def test_the_lobe_against_quadrature(radius, spread, room):
    light = replace(BALL, radius=radius)
    at, normal, mirror = receivers(120, 15, spread)
    s = np.random.default_rng(16).choice([0.0, 1.0, 2.5, 20.0, 300.0], 120)
    points = replace(shading_points_of(at, normal), mirror=mirror).with_columns(
        shininess=s, diffuse=np.zeros(at.shape), specular=np.ones(at.shape)
    )
    radiance, bound = light.unshadowed(points, True)
    value = radiance[0] * 2 * np.pi / (s + 2)
    right = quadrature(light, at, normal, mirror, s, 60, 160)
    whole = (dot(normal, column(light.center) - at) > radius) & (dot(mirror, column(light.center) - at) > radius)
    k = np.flatnonzero(whole) if spread < 1 else np.arange(120)
    assert k.size > 30
    # Across horizons the nodes find an exponent's step to one part in their number.
    assert np.abs(value - right)[k].max() < room * right.max()
    assert (bound[value > 1e-6 * value.max()] < 1e-6).all()


def test_inside_it_is_dark_and_its_skin_is_lit_by_half_the_sky():
    light = SphereLight((0.0, 0.0, 0.0), 1.0, WHITE)
    at = np.array([[0.0, 0.0, 0.0, 0.0], [0.0, 0.999, 1.0, 1.0 + 1e-9], [0.0, 0.0, 0.0, 0.0]])
    value, _ = irradiance(light, at, np.broadcast_to(column((0.0, -1.0, 0.0)), at.shape))
    assert not value[:3].any()
    assert value[3] == pytest.approx(np.pi, rel=1e-8)
    d, weight = light.beams(at, *unit_square(np.random.default_rng(1), 4, 9, True))
    assert np.isfinite(d).all()
    assert dot(d, d).min() > 0
    assert not weight[:3].any()


@pytest.mark.parametrize("line", ["0 0 0 0 1 1 1", "0 0 0 -1 1 1 1", "0 0 0 1e200 1 1 1"])
def test_bad_balls_are_refused(line):
    with pytest.raises(InputError, match="sphereLight radius"):
        parse_scene(f"size 4 4\ncamera 0 0 1 0 0 0 0 1 0 45\nsphereLight {line}\n")


def test_the_camera_sees_it_from_outside_and_it_blocks_other_lights_but_not_itself():
    light = SphereLight((0.0, 1.0, 0.0), 0.5, (2.0, 2.0, 2.0))
    lamp = QuadLight((-0.2, 3.0, -0.2), (0.0, 0.0, 0.4), (0.4, 0.0, 0.0), (5.0, 5.0, 5.0))
    made = scene(floor(2.0), lights=(light, lamp), camera=Camera((0, 1.5, 4), (0, 0.8, 0), (0, 1, 0), 50))
    needs = prepare(made).needs
    assert [source.blockers.ellipsoids.tolist() for source in needs.sources] == [[], [0]]
    image = render(made, Analytic())
    on = image.emitter > 0
    assert 20 < on.sum() < 400
    assert (image.mean[:, on] == 2.0).all()
    within = made.with_(camera=Camera((0, 1, 0), (0, 0.8, 0.3), (0, 1, 0), 50))
    image = render(within, Analytic())
    assert (image.emitter == 1).all()
    assert not image.mean.any()


def test_nothing_of_it_over_any_surface_is_left_out_of_shadow_rays():
    made = scene(floor(2.0), box((-0.4, 0.2, -0.4), (0.4, 0.4, 0.4)), lights=(BALL,))
    assert prepare(made).needs.sources[0].blockers.triangles.size > 0
