"""The uniform sky: directions, closed forms over the hemisphere, and what is seen of it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from builders import box, floor, scene
from scipy.stats import chi2
from test_lights import shading_points_of

from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Analytic, Area
from nusselt.renderer.image import render
from nusselt.renderer.lights import QuadLight, SkyLight
from nusselt.renderer.lights.sampling import unit_square
from nusselt.renderer.pixels import render_area
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Camera
from nusselt.renderer.scene_text import parse_scene
from nusselt.renderer.surfaces import Ellipsoid, Material
from nusselt.renderer.vectors import column, dot, frame, unit

WHITE = (1.0, 1.0, 1.0)
SKY = SkyLight(WHITE)
FALSE_ALARM = 1e-6
NODES, WEIGHTS = np.polynomial.legendre.leggauss(200)


def uniformity(d):
    """p-value of chi^2 that directions (3, n) are uniform: 8 heights by 12 angles."""
    height, angle = (d[2] + 1) / 2, np.arctan2(d[1], d[0]) / (2 * np.pi) % 1.0
    cells = np.minimum(height * 8, 7).astype(int) * 12 + np.minimum(angle * 12, 11).astype(int)
    counts = np.bincount(cells, minlength=96)
    expected = height.size / 96
    return chi2.sf(((counts - expected) ** 2 / expected).sum(), 95)


@pytest.mark.parametrize("stratified", [False, True])
def test_directions_are_uniform_over_the_sphere(stratified):
    u, v = unit_square(np.random.default_rng(11), 4000, 49, stratified)
    d, weight = SKY.beams(np.zeros((3, 4000)), u, v)
    way = d.reshape(3, -1)
    np.testing.assert_allclose(dot(way, way), 1, rtol=1e-14)
    assert uniformity(way) > FALSE_ALARM
    squeezed = way * column((1.0, 1.0, 1.05))
    assert uniformity(unit(squeezed)) < FALSE_ALARM
    np.testing.assert_allclose(weight, 4 * np.pi / 49, rtol=1e-15)


def points_of(normal, mirror, s):
    made = replace(shading_points_of(np.zeros(normal.shape), normal), mirror=mirror).with_columns(shininess=s)
    return made, made.with_columns(diffuse=np.zeros(normal.shape), specular=np.ones(normal.shape))


def test_lambert_reflects_its_albedo_whatever_the_normal():
    normal = unit(np.random.default_rng(12).standard_normal((3, 500)))
    flat, _ = points_of(normal, normal, np.ones(500))
    value, bound = SKY.unshadowed(flat, True)
    np.testing.assert_allclose(value, 1.0, rtol=1e-15)
    assert bound.max() < 1e-13


def lobe(tilt, s):
    """(s + 2)/(2 pi) times the integral of max(w.u, 0)^s max(n.u, 0) over the sphere, w at ``tilt`` from n.

    In lunes about the axis across both: with a the angle in their plane, the integral of cos^(s+2) along each, times
    that of max(cos(a), 0)^s max(cos(a + tilt), 0).
    """
    along = math.exp(math.lgamma((s + 3) / 2) - math.lgamma((s + 4) / 2)) * math.sqrt(math.pi)
    low, high = -math.pi / 2, math.pi / 2 - tilt
    a = low + (NODES + 1) / 2 * (high - low)
    across = (high - low) / 2 * (WEIGHTS * np.maximum(np.cos(a), 0) ** s * np.maximum(np.cos(a + tilt), 0)).sum()
    return (s + 2) / (2 * math.pi) * along * across


@pytest.mark.parametrize("s", [0.0, 1.0, 2.5, 20.0, 1000.0])
def test_the_lobe_over_the_hemisphere(s):
    tilts = np.array([0.0, 1e-9, 0.1, 0.7, 1.2, 1.5, math.pi / 2 - 1e-6])  # the last is seen at a grazing angle
    rng = np.random.default_rng(13)
    normal = unit(rng.standard_normal((3, tilts.size)))
    mirror = np.cos(tilts) * normal + np.sin(tilts) * frame(normal)[0]
    _, shiny = points_of(normal, mirror, np.full(tilts.size, s))
    value, bound = SKY.unshadowed(shiny, True)
    right = np.array([lobe(tilt, s) for tilt in tilts])
    assert (np.abs(value[0] - right) <= bound * value[0] + 2e-9 * right).all()  # the nodes' own error
    # At an exponent of 0 the lobe has a step: on the horizon itself, where the mirror is the normal.
    assert bound[(tilts > 1e-3) | (s > 0)].max() < 1e-6
    assert lobe(0.0, s) == pytest.approx(1.0, rel=1e-9)  # the lobe's own norm


def box_room(*lights, **options):
    view = Camera((0.3, 2.2, 5.0), (0.0, 0.7, 0.0), (0.0, 1.0, 0.0), 42.0)
    return scene(
        floor(1.0), box((0.0, 0.0, -0.3), (0.5, 0.8, 0.3)), lights=lights, size=(32, 24), camera=view, **options
    )


def test_it_is_seen_where_nothing_is():
    sky, second = SkyLight((1.0, 2.0, 3.0)), SkyLight((0.5, 0.5, 0.5))
    bare = render(box_room(), Area())
    image = render(box_room(sky, second), Area(samples=4))
    nothing = image.background == 1
    assert 100 < nothing.sum() < 700
    assert np.array_equal(image.background, bare.background)
    assert not image.emitter.any()
    np.testing.assert_array_equal(image.mean[:, nothing], np.broadcast_to(column((1.5, 2.5, 3.5)), (3, nothing.sum())))
    boxed = render(box_room(sky, spp=16), Area(samples=4))
    assert (boxed.mean[:, boxed.background == 1] == column(sky.colour)).all()
    assert ((boxed.background > 0) & (boxed.background < 1)).sum() > 10
    open_floor = scene(floor(1.0), lights=(sky,), size=(32, 24))
    area = render_area(open_floor, Analytic(), tolerance=1e-3).image
    # A floor that sees all of it is as bright as its albedo, and pixels are mixtures of both.
    right = column(sky.colour)[:, :, None] * (0.5 * (1 - area.background) + area.background)
    assert ((area.background > 0) & (area.background < 1)).sum() > 10
    np.testing.assert_allclose(area.mean, right, rtol=1e-6)


def test_a_furnace_hides_nothing():
    """Within a sky a white body that hides nothing of itself is as bright as the sky: it cannot be seen."""
    ball = Ellipsoid.sphere((0.0, 0.0, 0.0), 1.0, Material((1.0, 1.0, 1.0)))
    made = scene(lights=(SkyLight((2.0, 2.0, 2.0)),), ellipsoids=(ball,), size=(32, 24))
    image = render(made, Analytic())
    assert 0 < image.shaded.sum() < image.shaded.size
    np.testing.assert_allclose(image.mean, 2.0, rtol=1e-15)
    assert prepare(made).needs.sources[0].blockers.ellipsoids.size == 1  # convex: its own surface never hides from it


def test_the_floor_under_a_high_wall_sees_half_of_it():
    wall = box((-500.0, 0.0, -1.0), (500.0, 500.0, 0.0))
    made = scene(floor(2.0), wall, lights=(SKY,), size=(12, 9), camera=Camera((0, 1, 3), (0, 0, 0.3), (0, 1, 0), 20))
    image = render(made, Area(samples=1024, stratified=True), seed=2)
    on_floor = image.shaded & (np.arange(9)[:, None] > 5)
    assert image.mean[:, on_floor].mean() == pytest.approx(0.5 * 0.5, rel=0.02)


def test_a_black_sky_is_left_out():
    needs = prepare(box_room(SkyLight((0.0, 0.0, 0.0)))).needs
    assert not needs.sources
    assert ("light 1 (sky)", "it is black") in [(out.what, out.why) for out in needs.left_out]
    lamp = QuadLight((-0.2, 3.0, -0.2), (0.0, 0.0, 0.4), (0.4, 0.0, 0.0), (5.0, 5.0, 5.0))
    assert [source.light.kind for source in prepare(box_room(SKY, lamp)).needs.sources] == ["sky", "quad"]


def test_bad_skies_are_refused():
    with pytest.raises(InputError, match="sky radiance"):
        parse_scene("size 4 4\ncamera 0 0 1 0 0 0 0 1 0 45\nsky 1 -1 1\n")
