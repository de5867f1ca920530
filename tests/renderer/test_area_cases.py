"""Scenes that pixels by area or interpolated centres once had wrong: black images, the camera on a ball, far places."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import GREY, box, floor, lamp, quad, scene
from places import TEST_SCENES

from nusselt.renderer.camera.view import look
from nusselt.renderer.estimators import Analytic, Area, Exact
from nusselt.renderer.estimators.common_points import lattice
from nusselt.renderer.image import render
from nusselt.renderer.lights import DirectionalLight, PointLight, QuadLight, SunLight
from nusselt.renderer.pixels import render_area, render_centre
from nusselt.renderer.pixels.doubt import doubtful
from nusselt.renderer.pixels.shade import regions_of
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Camera
from nusselt.renderer.scene_text import read_scene
from nusselt.renderer.surfaces import Ellipsoid, Material, Mesh

FOLDER = TEST_SCENES
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


# Shadows that fit in a pixel.


def brute(made, count: int):
    """Means over a lattice of rays a pixel (3, h, w): no line drawn, nothing interpolated, every point shaded."""
    near, geometry, needs = prepare(made)
    rays = lattice(count)
    row, column = np.divmod(np.arange(made.height * made.width), made.width)
    view = look(near, geometry, (column[:, None] + rays[0]).ravel(), (row[:, None] + rays[1]).ravel())
    radiance = view.emission.copy()
    for source in needs.sources:
        radiance[:, view.lit] += Exact()(view.points, source.seen_from(view.points.position), None)
    return radiance.reshape(3, made.height, made.width, -1).mean(axis=3)


@pytest.mark.parametrize(
    ("name", "two_sided", "column", "row", "right"),
    [
        ("area_tolerance_contact", False, 13, 16, (0.003122, 0.006356, 0.012563)),
        ("area_tolerance_two_sided", True, 18, 8, (0.0065594, 0.0176891, 0.0010777)),
    ],
)
def test_pixels_that_were_never_refined(name, two_sided, column, row, right):
    """``right`` is the mean of 128 x 128 rays in that pixel; a quarter of them give the same to 3e-3.

    In the first, light comes in under a triangle within the pixel, and its centre and all around is black; in the
    second, what the neighbours foretold of it had been taken from itself.
    """
    found = render_area(case(name, two_sided=two_sided), Exact())
    np.testing.assert_allclose(found.image.mean[:, row, column], right, rtol=5e-3)


def test_a_sliver_of_light_thinner_than_a_lattice_of_rays():
    """Pixel (23, 11) sees a glowing wall's corner, 1.03e-4 of its area: 0 by 32 x 32 rays, this by 2,000 x 2,000."""
    found = render_area(case("area_tolerance_dark"), Exact())
    np.testing.assert_allclose(found.image.mean[:, 11, 23], (1.6614e-4, 2.0538e-4, 1.7811e-4), rtol=2e-3)


def random_view(seed: int):
    """A box, a ball and a leaf over a floor, some touching it; wide and small lights."""
    rng = np.random.default_rng(seed)
    low = np.array([*rng.uniform(-1.2, 0.4, 2), 0.0])[[0, 2, 1]]
    low[1] = rng.choice([0.0, 0.03])
    leaf = rng.uniform((-1.2, 0.03, -1.2), (1.2, 0.8, 1.2), (3, 3)).T
    radius = rng.uniform(0.2, 0.5)
    ball = Ellipsoid.sphere((rng.uniform(-1, 1), radius * 1.02, rng.uniform(-1, 1)), radius, GREY)
    solids = box(low, low + rng.uniform(0.3, 0.9, 3)), Mesh(leaf, np.array([[0], [1], [2]]), GREY)
    camera = Camera((*rng.uniform(-2, 2, 1), rng.uniform(0.6, 2.0), 4.0), (0, 0.3, 0), (0, 1, 0), 35.0)
    light = lamp(2.5, float(rng.choice([0.1, 0.6])))
    return scene(floor(), *solids, ellipsoids=(ball,), lights=(light,), camera=camera, size=(16, 12), two_sided=True)


@pytest.mark.parametrize("seed", range(6))
def test_small_random_views_are_within_the_tolerance_and_what_is_said(seed):
    """Against 610 rays a pixel, whose own error is told by that of 144."""
    view = random_view(seed)
    found = render_area(view, Exact(), tolerance=1e-2)
    truth, fewer = brute(view, 610), brute(view, 144)
    judged = found.image.emitter == 0
    size = np.sqrt((truth[:, judged] ** 2).sum())
    error, unsure = (np.sqrt(((one - truth)[:, judged] ** 2).sum()) / size for one in (found.image.mean, fewer))
    assert unsure < 1e-2
    assert error < max(1e-2, 2 * found.error) + unsure / 2  # a lattice's falls by 2.9 along edges (n^-3/4)


def test_doubt_is_where_a_shadow_fits_in_a_pixel():
    """Under the edge of a board: close to the floor its penumbra is thinner than a pixel, higher up it is wide."""

    def found(height, light):
        board = quad((-3, height, 3), (0, height, 3), (0, height, -3), (-3, height, -3))
        made = scene(floor(4), board, lights=(light,), camera=Camera((2, 3, 0), (0, 0, 0), (0, 1, 0), 40.0))
        _, needs, regions = regions_of(made, made.digest())
        x, y = (v.ravel() for v in np.meshgrid(np.arange(32) + 0.5, np.arange(24) + 0.5))
        region = regions.seen(x, y)
        seen = np.flatnonzero(region >= 0)
        where = regions.points(x[seen], y[seen], region[seen]).position
        ground = where[1] < 1e-9
        doubt = doubtful(regions, needs.sources, x[seen], y[seen], region[seen])
        return where[:, ground & doubt], where[:, ground]

    for light in (lamp(2.5, 0.6), PointLight((0.0, 2.5, 0.0), (1, 1, 1))):
        near, every = found(0.02, light)
        assert 10 < near.shape[1] < 0.2 * every.shape[1]
        assert np.abs(near[0]).max() < 0.3
    assert found(0.5, lamp(2.5, 0.6))[0].shape[1] == 0
    assert found(0.5, PointLight((0.0, 2.5, 0.0), (1, 1, 1)))[0].shape[1] > 10  # a hard shadow always fits
    assert found(0.5, DirectionalLight((0.2, 1, 0), (1, 1, 1)))[0].shape[1] > 10
    assert found(0.5, SunLight((0.2, 1, 0), (1, 1, 1), 0.5))[0].shape[1] > 10


def touching_boxes():
    """Two boxes that touch, on a floor, under a lamp so small that no penumbra at their feet is wider than a pixel."""
    solids = box((0.098, 0, -0.491), (0.528, 0.892, 0.229)), box((0.528, 0, -0.558), (0.845, 0.373, -0.094))
    light = QuadLight((1.03, 2.634, -0.575), (0, 0, 0.218), (0.3, 0, 0), (8.5, 8.4, 3.2))
    camera = Camera((1.457, 1.254, 4.5), (-0.082, 0.2, 0), (0, 1, 0), 51.3)
    return scene(floor(3), *solids, lights=(light,), camera=camera, size=(20, 15))


def test_shadows_at_two_sides_of_a_contact_are_refined_until_they_are_told_apart():
    """A change between two coarse grids that happens to be small proves nothing while shadows fit between the points.

    Pixel (12, 8) by 2 x 96 x 96 jittered rays, whose halves agree to 4e-4.
    """
    view = touching_boxes()
    truth = brute(view, 610)
    for tolerance in (1e-2, 5e-3):  # at the first the pixel may be 3 % off: half of what the image may be
        found = render_area(view, Exact(), tolerance=tolerance)
        assert ((found.image.mean - truth) ** 2).sum() < found.error**2 * (truth**2).sum()
    np.testing.assert_allclose(found.image.mean[:, 8, 12], (7.0911e-3, 7.0077e-3, 2.6696e-3), rtol=1e-2)
