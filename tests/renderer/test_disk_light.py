"""The disk light: its sampling, its closed form against textbooks and quadrature, and Mitsuba's word on it."""

from dataclasses import replace

import numpy as np
import pytest
from builders import box, floor, scene
from scipy.stats import chi2
from test_lights import shading_points_of

from nusselt.experiments.check.check import Question, References, check
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Analytic
from nusselt.renderer.image import render
from nusselt.renderer.lights import DiskLight
from nusselt.renderer.lights.sampling import unit_square
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Camera
from nusselt.renderer.scene_text import parse_scene
from nusselt.renderer.surfaces import Material
from nusselt.renderer.vectors import column, dot, frame, unit

WHITE = (1.0, 1.0, 1.0)
TILTED = DiskLight((0.3, 1.2, -0.4), (0.4, -1.0, 0.3), 0.8, WHITE)
FALSE_ALARM = 1e-6
REFERENCES = References()


def uniformity(steps):
    """p-value of chi^2 that steps (2, n) from the centre, in radii, are uniform: 8 rings by 12 sectors."""
    ring = np.minimum((steps**2).sum(axis=0) * 8, 7).astype(int)
    sector = np.minimum((np.arctan2(*steps) / (2 * np.pi) % 1.0) * 12, 11).astype(int)
    counts = np.bincount(ring * 12 + sector, minlength=96)
    expected = steps.shape[1] / 96
    return chi2.sf(((counts - expected) ** 2 / expected).sum(), 95)


@pytest.mark.parametrize("stratified", [False, True])
def test_points_are_uniform_in_area(stratified):
    u, v = unit_square(np.random.default_rng(11), 4000, 49, stratified)
    d, weight = TILTED.beams(np.zeros((3, 4000)), u, v)
    steps = (d - column(TILTED.center)[:, :, None]).reshape(3, -1)
    axes = frame(column(TILTED.normal))
    flat = np.stack([dot(axis, steps) for axis in axes]) / TILTED.radius
    assert np.abs(dot(column(TILTED.normal), steps)).max() < 1e-15
    assert uniformity(flat) > FALSE_ALARM
    assert uniformity(flat * np.sqrt((flat**2).sum(axis=0))) < FALSE_ALARM  # the root forgotten
    # The density: one over the area, so that a sample stands for A cos / R^2.
    length = np.sqrt(dot(d, d))
    cosine = -dot(column(TILTED.normal)[:, :, None], d) / length
    np.testing.assert_allclose(weight, np.pi * 0.8**2 * np.maximum(cosine, 0) / length**2 / 49, rtol=1e-12, atol=0)


def irradiance(light, at, normal):
    radiance, bound = light.unshadowed(shading_points_of(at, normal), False)
    return np.pi * radiance[0], bound


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e9])
def test_textbook_configurations(size):
    # Howell, A Catalog of Radiation Heat Transfer Configuration Factors, B-12 (parallel) and B-13 (at right angles).
    rng = np.random.default_rng(12)
    l, h = rng.uniform(1.05, 4, (2, 300))
    light = DiskLight((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), size, WHITE)
    at = size * np.stack((l, 0 * l, -h))
    z = h * h + l * l + 1
    root = np.sqrt(z * z - 4 * l * l)
    value, bound = irradiance(light, at, np.broadcast_to(column((0.0, 0.0, 1.0)), at.shape))
    np.testing.assert_allclose(value, np.pi / 2 * (1 - (z - 2) / root), rtol=1e-12)
    assert bound.max() < 1e-10
    value, bound = irradiance(light, at, np.broadcast_to(column((-1.0, 0.0, 0.0)), at.shape))
    np.testing.assert_allclose(value, np.pi * h / (2 * l) * (z / root - 1), rtol=1e-12)
    assert bound.max() < 1e-10
    on_axis = size * np.stack((0 * h, 0 * h, -h))
    value, _ = irradiance(light, on_axis, np.broadcast_to(column((0.0, 0.0, 1.0)), at.shape))
    np.testing.assert_allclose(value, np.pi / (1 + h * h), rtol=1e-13)


def receivers(count, seed, clear):
    """Points before the disk, their normals and mirrors; with ``clear`` the disk above both horizons."""
    rng = np.random.default_rng(seed)
    normal, center = column(TILTED.normal), column(TILTED.center)
    across = [axis * rng.uniform(-1.5, 1.5, count) for axis in frame(normal)]
    at = center + normal * rng.uniform(0.7, 3.0, count) + across[0] + across[1]
    to = center - at
    spread = 0.1 if clear else 1.5
    ways = [unit(unit(to) + spread * rng.standard_normal((3, count))) for _ in range(2)]
    if clear:
        # The disk's half width as seen, and room: both horizons lie beyond it.
        kept = [dot(way, to) > 1.2 * TILTED.radius for way in ways]
        k = np.flatnonzero(kept[0] & kept[1])
        at, ways = at[:, k], [way[:, k] for way in ways]
    return at, *ways


def quadrature(at, normal, mirror, s, radial, around):
    """Irradiance and lobe integral over the disk: Gauss-Legendre in the squared radius, equal steps around."""
    nodes, weights = np.polynomial.legendre.leggauss(radial)
    u, v = np.repeat((nodes + 1) / 2, around)[None], np.tile((np.arange(around) + 0.5) / around, radial)[None]
    d, weight = TILTED.beams(at, u, v)
    weight = weight * (np.repeat(weights / 2, around) * radial)
    length = np.sqrt(dot(d, d))
    cosine = np.maximum(dot(normal[:, :, None], d) / length, 0) * weight
    slant = dot(mirror[:, :, None], d) / length
    lobe = np.where(slant > 0, np.maximum(slant, 0) ** s[:, None], 0.0)
    return cosine.sum(axis=1), (cosine * lobe).sum(axis=1)


def closed_form(at, normal, mirror, s):
    """The same, and the bounds of its relative error, through `DiskLight.unshadowed`."""

    flat = replace(shading_points_of(at, normal), mirror=mirror).with_columns(shininess=s)
    shiny = flat.with_columns(diffuse=np.zeros(at.shape), specular=np.ones(at.shape))
    lambert, first = TILTED.unshadowed(flat, True)
    lobe, second = TILTED.unshadowed(shiny, True)
    return lambert[0] * np.pi, first, lobe[0] * 2 * np.pi / (s + 2), second


def test_quadrature_above_both_horizons_agrees_to_rounding_and_within_the_bounds():
    at, normal, mirror = receivers(300, 13, clear=True)
    assert at.shape[1] > 100
    s = np.random.default_rng(14).choice([0.0, 1.0, 2.5, 20.0], at.shape[1])
    lambert, first, lobe, second = closed_form(at, normal, mirror, s)
    right = quadrature(at, normal, mirror, s, 40, 120)
    np.testing.assert_allclose(lambert, right[0], rtol=1e-12)
    np.testing.assert_allclose(lobe, right[1], rtol=1e-11)
    assert (np.abs(lambert - right[0]) <= (first + 1e-14) * right[0]).all()
    assert (np.abs(lobe - right[1]) <= (second + 1e-14) * right[1]).all()
    assert np.maximum(first, second).max() < 1e-9


def test_quadrature_across_horizons_agrees():
    at, normal, mirror = receivers(150, 15, clear=False)
    mirror = mirror * np.sign(dot(mirror, normal))  # who is seen has its mirror above the horizon
    s = np.random.default_rng(16).choice([0.0, 1.0, 2.5, 20.0, 300.0], at.shape[1])
    lambert, first, lobe, second = closed_form(at, normal, mirror, s)
    right = quadrature(at, normal, mirror, s, 150, 400)
    # An exponent of 0 has a step, which the nodes find to one part in their number.
    for mine, other, bound, room in ((lambert, right[0], first, 1e-6), (lobe, right[1], second, 2e-3)):
        assert np.abs(mine - other).max() < room * other.max()
        assert (bound[mine > 1e-6 * mine.max()] < 1e-6).all()
    cut = (dot(normal, column(TILTED.center) - at) < TILTED.radius) & (lambert > 0)
    assert cut.sum() > 20


def test_nothing_behind_in_its_plane_or_below_the_horizon():
    light = DiskLight((0.0, 1.0, 0.0), (0.0, -1.0, 0.0), 0.5, WHITE)
    at = np.array([[0.1, 2.0, 0.0], [1.5, 1.0, 0.0], [0.0, 0.0, 0.0]])
    for normal in ((0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (0.6, 0.8, 0.0)):
        value, _ = irradiance(light, at, np.broadcast_to(unit(column(normal)), at.shape))
        assert not value[:2].any()
        assert (value[2] > 0) == (normal[1] > 0)


def test_right_before_it_half_the_sky_is_light():
    light = DiskLight((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 1.0, WHITE)
    at = np.array([[0.0, 0.5], [0.0, 0.0], [1e-9, 1e-9]])
    value, _ = irradiance(light, at, np.broadcast_to(column((0.0, 0.0, -1.0)), at.shape))
    np.testing.assert_allclose(value, np.pi, rtol=1e-12)


@pytest.mark.parametrize(
    ("change", "named"), [("1 1 0 0 0 0 1", "normal"), ("0 0 0 0 1 0 0", "radius"), ("0 0 0 0 1 0 -1", "radius")]
)
def test_bad_disks_are_refused(change, named):
    with pytest.raises(InputError, match=f"diskLight {named}"):
        parse_scene(f"size 4 4\ncamera 0 0 1 0 0 0 0 1 0 45\ndiskLight {change} 1 1 1\n")


def test_the_camera_sees_its_front_and_its_black_back():
    for side, seen in ((1.0, 2.0), (-1.0, 0.0)):
        light = DiskLight((0.0, 0.5, 0.0), (0.0, 0.0, side), 0.7, (2.0, 2.0, 2.0))
        made = scene(floor(2.0, -1.0), lights=(light,), camera=Camera((0, 0.5, 4), (0, 0.5, 0), (0, 1, 0), 40))
        image = render(made, Analytic())
        on = image.emitter > 0
        assert 20 < on.sum() < 400
        assert (image.mean[:, on] == seen).all()


def small_room():
    lights = (
        DiskLight((0.2, 2.2, -0.3), (0.3, -1.0, 0.2), 0.6, (6.0, 5.0, 4.0)),
        DiskLight((-0.6, 1.2, 0.3), (0.2, 1.0, 0.0), 0.4, (2.0, 3.0, 4.0)),  # shines up
    )
    shiny = Material((0.6, 0.5, 0.4), (0.3, 0.3, 0.3), 12.0)
    view = Camera((0.3, 2.2, 5.0), (0.0, 0.9, 0.0), (0.0, 1.0, 0.0), 42.0)
    block = box((0.1, 0.0, 0.0), (0.6, 0.9, 0.5))
    return scene(floor(2.0, 0.0, shiny), block, lights=lights, size=(48, 36), camera=view)


def test_a_disk_that_lights_nothing_stands_in_the_other_ones_way():
    needs = prepare(small_room()).needs
    assert [source.blockers.disks.tolist() for source in needs.sources] == [[1]]
    assert ("light 2 (disk)", "every surface lies behind it") in [(out.what, out.why) for out in needs.left_out]


@pytest.mark.parametrize("estimator", ["area", "exact"])
def test_mitsuba_agrees(estimator):
    question = Question(estimator=estimator, samples=64)
    row = check(small_room(), question, command="", references=REFERENCES).row
    assert (row["verdict"], row["as_claimed"]) == ("agrees", True), row["reason"]
