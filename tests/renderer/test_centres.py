"""Pixel centres to a tolerance: interpolated where that is checked, evaluated elsewhere; and who is seen where."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import box, floor, lamp, quad, scene
from click.testing import CliRunner
from test_many_triangles import made

from nusselt.experiments.cli.main import main
from nusselt.experiments.scenes.catalogue import load
from nusselt.experiments.scenes.meshes import displaced_sphere
from nusselt.experiments.scenes.shapes import plate
from nusselt.renderer.camera.rays import pixel_centres
from nusselt.renderer.camera.view import look
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Analytic, Area, Exact
from nusselt.renderer.geometry.arrays import build_geometry
from nusselt.renderer.image import render
from nusselt.renderer.lights import DiskLight, SkyLight
from nusselt.renderer.pixels import centre_view, regions, render_centre
from nusselt.renderer.pixels.centre_view import CentreView
from nusselt.renderer.pixels.centres import CentreShader
from nusselt.renderer.prepared import prepare
from nusselt.renderer.surfaces import Ellipsoid, Material


def over_floor(side: int):
    return scene(made(displaced_sphere, 900, 0.4, (0, 1.2, 0)), floor(4), lights=(lamp(2.5),), size=(side, side))


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
def test_interpolated_centres_are_within_the_bound_and_cost_less(tolerance):
    s = over_floor(96)
    every = render(s, Exact())
    some = render_centre(s, Exact(), tolerance=tolerance)
    error = np.sqrt(((some.image.mean - every.mean) ** 2).sum() / (every.mean**2).sum())
    assert 0 < error <= some.error <= tolerance
    assert some.evaluations < 0.75 * every.shaded.sum()
    np.testing.assert_array_equal(some.image.emitter, every.emitter)
    np.testing.assert_array_equal(some.image.background, every.background)


def test_a_scene_of_small_faces_is_evaluated_throughout():
    s = over_floor(24).with_(meshes=over_floor(24).meshes[:1])
    every = render(s, Exact())
    some = render_centre(s, Exact(), tolerance=0.1)
    assert some.evaluations == every.shaded.sum()
    np.testing.assert_allclose(some.image.mean, every.mean, rtol=1e-12, atol=1e-14)


def test_planes_are_those_of_triangles_that_lie_in_one_and_every_pixel_of_a_ball_is_alone():
    """A floor of two triangles, one of another colour in its plane, a box on it: two sides are seen, and a ball."""
    beside = plate((2.0, 3.0), (-2.0, 2.0), 0.0, Material((0.2, 0.3, 0.4)))
    ball = Ellipsoid((-1.2, 0.5, 0.5), ((0.3, 0, 0), (0, 0.3, 0), (0, 0, 0.3)), Material((0.5, 0.5, 0.5)))
    s = scene(
        floor(), beside, box((-0.5, 0, -0.5), (0.4, 0.8, 0.4)), ellipsoids=(ball,), lights=(lamp(3.0),), size=(96, 72)
    )
    near, geometry, _ = prepare(s)
    view = CentreView.of(near, geometry)
    plane, lit, triangle = view.planes(), view.reflects, view.seen.triangle
    assert np.array_equal(plane >= 0, lit)
    shown = [np.unique(plane[lit & (triangle // 2 == pair)]) for pair in range(8)]
    assert [len(numbers) for numbers in shown[:2]] == [1, 1]
    assert sorted(len(numbers) for numbers in shown[2:]) == [0, 0, 0, 0, 1, 1]
    on_ball = plane[view.seen.ellipsoid >= 0]
    assert np.unique(on_ball).size == on_ball.size > 20
    assert np.unique(plane[lit]).size == on_ball.size + 4


def test_every_pixel_of_a_classic_scene_agrees():
    s = load("quad").with_(width=64, height=48)
    every, some = render(s, Analytic()), render_centre(s, Analytic(), tolerance=1e-4)
    assert np.sqrt(((some.image.mean - every.mean) ** 2).sum() / (every.mean**2).sum()) <= 1e-4


@pytest.mark.parametrize("two_sided", [False, True])
def test_centres_show_what_their_rays_meet_bit_by_bit(two_sided):
    """Lamps, a sky, a sheet seen from behind and a glowing ball: who is who, and the points that reflect."""
    ball = Ellipsoid(
        (-1.2, 0.5, 0.5), ((0.3, 0, 0), (0, 0.4, 0), (0, 0, 0.3)), Material((0.5,) * 3, emission=(1, 2, 3))
    )
    away = quad((-0.5, 0, 1), (-0.5, 0.8, 1), (0.4, 0.8, 1), (0.4, 0, 1))
    lights = (lamp(1.4), DiskLight((1.2, 0.4, 0.3), (0.2, 0.5, 1.0), 0.4, (1, 1, 2)), SkyLight((0.1, 0.2, 0.3)))
    s = scene(floor(), away, ellipsoids=(ball,), lights=lights, size=(64, 48), two_sided=two_sided)
    near, geometry, _ = prepare(s)
    right, found = look(near, geometry, *pixel_centres(range(64), range(48))), CentreView.of(near, geometry)
    for kind in ("emission", "emitter", "background", "back"):
        assert np.array_equal(getattr(found, kind), getattr(right, kind)), kind
        assert getattr(right, kind).any() != (two_sided and kind == "back"), kind
    assert np.array_equal(found.surface, right.hits.surface)
    assert np.array_equal(np.flatnonzero(found.reflects), right.lit)
    some = np.arange(0, right.lit.size, 3)
    points = found.points(right.lit[some])
    for name in ("position", "normal", "outgoing", "mirror", "diffuse", "ellipsoid", "outside"):
        assert np.array_equal(getattr(points, name), getattr(right.points.take(some), name)), name
    assert {-1, 0} == set(points.ellipsoid.tolist())


def test_what_small_faces_reflect_is_evaluated_in_one_call_and_allows_errors_elsewhere(monkeypatch):
    """A white ball over a dark floor: most of the light is where nothing is interpolated."""
    ball = made(displaced_sphere, 900, 0.8, (0, 1.2, 0))
    ball, ground = (
        replace(mesh, material=Material(colour)) for mesh, colour in ((ball, (1, 1, 1)), (floor(4), (0.005,) * 3))
    )
    dim = scene(ball, ground, lights=(lamp(2.5),), size=(96, 96))
    asked, shade = [], CentreShader.__call__
    monkeypatch.setattr(CentreShader, "__call__", lambda self, index: asked.append(index) or shade(self, index))
    near, geometry, _ = prepare(dim)
    triangle = look(near, geometry, *pixel_centres(range(96), range(96))).hits.triangle
    shown = (triangle >= 0) & (triangle < geometry.triangles - 4)  # not the floor, nor the lamp
    every, some = render(dim, Exact()), render_centre(dim, Exact(), tolerance=1e-2)
    error = np.sqrt(((some.image.mean - every.mean) ** 2).sum() / (every.mean**2).sum())
    assert 0 < error <= 1e-2
    on_ball = [shown[index].sum() for index in asked]
    assert max(on_ball) > 0.95 * sum(on_ball) > 0
    assert some.evaluations - sum(on_ball) < 0.3 * (every.shaded.sum() - sum(on_ball))


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4])
def test_every_ray_is_traced_once(tolerance, monkeypatch):
    traced, met = [], centre_view.nearest_surfaces
    monkeypatch.setattr(centre_view, "nearest_surfaces", lambda *a: traced.append(a[2].shape[1]) or met(*a))
    render_centre(over_floor(48), Exact(), tolerance=tolerance)
    assert traced == [48 * 48]


def test_noise_and_absurd_tolerances_are_refused():
    with pytest.raises(InputError, match="without noise"):
        render_centre(over_floor(16), Area(samples=4))
    with pytest.raises(InputError, match="tolerance"):
        render_centre(over_floor(16), Exact(), tolerance=0.0)


def test_regions_are_the_same_by_boxes_and_by_blocks(monkeypatch):
    s = over_floor(32)
    geometry, needs = build_geometry(s), prepare(s).needs
    x, y = np.random.default_rng(2).uniform(0, 32, (2, 4000))
    lights = tuple(source.light for source in needs.sources)
    blocks = regions.Regions.of(s, geometry, lights).seen(x, y)
    monkeypatch.setattr(regions, "BIG", 0)
    boxes = regions.Regions.of(s, geometry, lights).seen(x, y)
    assert (boxes != blocks).sum() == 0
    assert np.unique(boxes).size > 60


def test_the_command_interpolates_centres_only_when_a_tolerance_is_named(tmp_path):
    found = []
    for name, options in (("every", []), ("some", ["--tolerance", "0.01"])):
        out = tmp_path / f"{name}.npy"
        arguments = ["render", "quad", "--estimator", "analytic", "--pixel-rule", "centre", "-o", str(out), *options]
        done = CliRunner().invoke(main, arguments)
        assert (done.exit_code, done.stderr) == (0, "")
        found.append(np.load(out))
    error = np.sqrt(((found[0] - found[1]) ** 2).sum() / (found[0] ** 2).sum())
    assert 0 < error <= 0.01
