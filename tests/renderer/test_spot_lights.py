"""Lamps without extent that do not shine alike to all sides: spots and cosine lights."""

import math

import numpy as np
import pytest
from builders import box, floor, scene
from mpmath import mp, mpf
from test_lights import shading_points_of

from nusselt.experiments.search.referees import ask
from nusselt.experiments.search.sensitivity import scale_of
from nusselt.mitsuba_bridge.limits import coarse_lights
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Analytic, Exact
from nusselt.renderer.geometry.arrays import build_geometry
from nusselt.renderer.image import render
from nusselt.renderer.lights import CosineLight, DiskLight, SpotLight
from nusselt.renderer.pixels import render_area
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Camera
from nusselt.renderer.scene_text import parse_scene
from nusselt.renderer.vectors import column, unit

WHITE = (1.0, 1.0, 1.0)
HEAD = "size 4 4\ncamera 0 0 1 0 0 0 0 1 0 45\n"


def irradiance(light, at, normal):
    """Irradiance (n,) of unit intensity, and its bound."""
    radiance, bound = light.unshadowed(shading_points_of(at, np.broadcast_to(normal, at.shape)), False)
    return np.pi * radiance[0], bound


@pytest.mark.parametrize(("cutoff", "begin"), [(40, 30), (60, 0), (90, 20), (150, 100), (179, 0), (1e-3, 7.5e-4)])
def test_a_spot_falls_off_linearly_in_the_angle(cutoff, begin):
    axis, side = unit(column((0.3, -1.0, 0.2))), unit(column((1.0, 0.3, 0.0)))
    light = SpotLight((1.0, 2.0, 3.0), tuple(axis[:, 0]), cutoff, begin, WHITE)
    angle = math.radians(cutoff) * np.array([0.0, 0.3, 0.5, 0.9, 0.999, 1.001])
    d = 2.5 * (np.cos(angle) * axis + np.sin(angle) * side)
    value, bound = irradiance(light, column(light.position) + d, -unit(d))
    right = np.clip((cutoff - np.degrees(angle)) / (cutoff - begin), 0, 1) / 2.5**2
    # The points lie where they should to rounding: so many radians of the angle.
    np.testing.assert_allclose(value, right, rtol=1e-13, atol=2e-16 / math.radians(cutoff - begin))
    assert (bound < 1e-6).all()


@pytest.mark.parametrize("kind", ["spot", "cosine"])
def test_bounds_hold_at_the_rim(kind):
    """Beside the cone's rim, or the lamp's plane, what arrives is a difference; against 50 digits."""
    tilts = 10.0 ** -np.arange(1, 15)
    if kind == "spot":
        light, towards = SpotLight((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 30.0, 10.0, WHITE), math.radians(30) - tilts
    else:
        light, towards = CosineLight((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), WHITE), math.pi / 2 - tilts
    at = np.stack((np.sin(towards), 0 * tilts, np.cos(towards)))
    value, bound = irradiance(light, at, column((-1.0, 0.0, 0.0)))
    with mp.workdps(50):
        for x, _, z, mine, room in zip(*at, value, bound, strict=True):
            x, z = mpf(x), mpf(z)
            square = x * x + z * z
            cosine = x / mp.sqrt(square)
            spot = min((mp.radians(30) - mp.atan2(x, z)) / mp.radians(20), 1)
            fall = spot if kind == "spot" else z / mp.sqrt(square)
            right = max(fall, 0) * cosine / square
            assert abs(mine - right) <= room * right
            assert right > 0


def test_a_shrinking_disk_tends_to_a_cosine_light_with_order_two():
    at, normal = np.array([[0.5], [-2.0], [0.25]]), unit(column((0.2, 1.0, 0.1)))
    small = CosineLight((0.0, 0.0, 0.0), (0.1, -1.0, 0.2), WHITE)
    right, _ = irradiance(small, at, normal)
    errors = []
    for radius in (0.2, 0.1, 0.05):
        disk = DiskLight(small.position, small.normal, radius, WHITE)
        errors.append(irradiance(disk, at, normal)[0][0] / disk.area / right[0] - 1)
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx(2, abs=0.05)


def test_the_flux_through_a_sphere_is_what_is_said():
    nodes, weights = np.polynomial.legendre.leggauss(120)
    z = np.concatenate((nodes, [1.0]))
    at = np.stack((np.sqrt(1 - z * z), 0 * z, z))
    cosine, _ = irradiance(CosineLight((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), WHITE), at, -at)
    assert 2 * np.pi * (cosine[:-1] * weights).sum() == pytest.approx(np.pi, rel=1e-3)
    spot, _ = irradiance(SpotLight((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 60.0, 59.999, WHITE), at, -at)
    assert 2 * np.pi * (spot[:-1] * weights).sum() == pytest.approx(2 * np.pi * (1 - 0.5), rel=2e-2)


@pytest.mark.parametrize(
    ("line", "named"),
    [
        ("spotLight 0 0 0 0 0 0 30 20 1 1 1", "spotLight direction"),
        ("spotLight 0 0 0 0 1 0 0 0 1 1 1", "spotLight cutoff"),
        ("spotLight 0 0 0 0 1 0 181 0 1 1 1", "spotLight cutoff"),
        ("spotLight 0 0 0 0 1 0 30 30 1 1 1", "spotLight begin"),
        ("spotLight 0 0 0 0 1 0 30 -1 1 1 1", "spotLight begin"),
        ("spotLight 0 0 0 0 1 0 30 20 1 1", "spotLight intensity.b"),
        ("cosineLight 0 0 0 0 0 0 1 1 1", "cosineLight normal"),
        ("cosineLight 0 0 0 0 1 0 1 -1 1", "cosineLight intensity"),
    ],
)
def test_bad_ones_are_refused(line, named):
    with pytest.raises(InputError, match=named):
        parse_scene(HEAD + line + "\n")


@pytest.mark.parametrize("kind", ["spotLight 0 3 0  0 {} 0  50 40  9 9 9", "cosineLight 0 3 0  0 {} 0  9 9 9"])
def test_one_that_is_turned_away_lights_nothing_and_is_left_out(kind):
    made = scene(
        floor(2.0), box((-0.5, 0.2, -0.5), (0.5, 0.6, 0.5)), camera=Camera((0, 3, 6), (0, 0, 0), (0, 1, 0), 40)
    )
    for way, lit in ((-1, True), (1, False)):
        turned = made.with_(lights=parse_scene(HEAD + kind.format(way)).lights)
        assert (render(turned, Analytic()).mean.max() > 0) == lit
        assert bool(prepare(turned).needs.sources) == lit


def cone(cutoff):
    spot = SpotLight((0.4, 2.2, 0.6), (-0.1, -1.0, -0.3), cutoff, 0.75 * cutoff, (6.0, 5.0, 4.0))
    return scene(floor(2.0), lights=(spot,), size=(48, 36), camera=Camera((0.3, 2.2, 5), (0, 0.7, 0), (0, 1, 0), 42))


def test_pixels_by_area_find_a_cone_of_few_pixels_and_claim_nothing_where_they_do_not():
    found = render_area(cone(2.0), Exact(), tolerance=1e-3)
    right = render(cone(2.0).with_(spp=256), Exact(), passes=2).mean
    assert found.image.mean.sum() == pytest.approx(right.sum(), rel=0.1)
    assert np.corrcoef(found.image.mean.ravel(), right.ravel())[0, 1] > 0.99
    lost = render_area(cone(0.05), Exact(), tolerance=1e-3)
    assert lost.image.mean.sum() > 0 or lost.error == 1


def test_mitsuba_is_said_to_lose_narrow_cones():
    for cutoff, said in ((40.0, 0), (0.1, 1)):
        notes = coarse_lights(cone(cutoff), np.zeros((3, 1)))
        assert len(notes) == said
        assert all("light 1 (spot) is so narrow" in note for note in notes)


@pytest.mark.parametrize(
    "light",
    [
        SpotLight((0.0, 2.0, 0.0), (0.0, -1.0, 0.0), 40.0, 20.0, WHITE),
        CosineLight((0.0, 2.0, 0.0), (0.0, -1.0, 0.0), WHITE),
    ],
    ids=["spot", "cosine"],
)
def test_those_who_know_points_alone_do_not_take_one_for_a_point(light):
    points = shading_points_of(np.zeros((3, 2)), np.repeat(column((0.0, 1.0, 0.0)), 2, axis=1))
    made = scene(floor(2.0), lights=(light,))
    with pytest.raises(TypeError, match=light.kind):
        scale_of(points, light)
    with pytest.raises(TypeError, match=light.kind):
        ask("area", made, build_geometry(made), points, 4, np.random.default_rng(0))
