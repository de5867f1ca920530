"""Meshes that shine: their text, their places, and the shadows that one throws on what it lights itself."""

from dataclasses import replace

import numpy as np
import pytest
from builders import box, floor, quad, scene, sphere_mesh
from scipy.stats import chi2
from test_lights import shading_points_of

from nusselt.mitsuba_bridge.limits import clearance
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Analytic, Area, Exact
from nusselt.renderer.geometry.arrays import build_geometry
from nusselt.renderer.image import render
from nusselt.renderer.lights import MeshLight, QuadLight, TriangleLight
from nusselt.renderer.lights.sampling import unit_square
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene_text import parse_scene, read_scene, write_scene
from nusselt.renderer.surfaces import Mesh

RADIANCE = (5.0, 4.0, 3.0)
FALSE_ALARM = 1e-6
HEAD = "size 12 8\ncamera 0 3 6 0 0 0 0 1 0 40\n"
TENT = Mesh(
    np.array([(-1, 1, 0), (0, 2, 0), (1, 1, 0), (-1, 1, 1), (0, 2, 1), (1, 1, 1)], dtype=float).T,
    np.array([(0, 1, 4), (0, 4, 3), (1, 2, 5), (1, 5, 4)]).T,
)
"""Two slopes that face down, and each other."""


def triangles_of(light):
    """As many lights."""
    corners = np.stack(light.surface.corners).transpose(2, 0, 1)
    return tuple(TriangleLight(*(tuple(v) for v in three), light.radiance) for three in corners.tolist())


def test_a_flat_mesh_is_the_parallelogram():
    square = QuadLight((-0.5, 2.0, -0.5), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), RADIANCE)
    light = MeshLight(quad(*(tuple(square.at(u, v)[:, 0]) for u, v in ((0, 0), (0, 1), (1, 1), (1, 0)))), RADIANCE)
    assert (light.area, light.hides_itself) == (pytest.approx(1.0), False)
    np.testing.assert_allclose(light.plane()[0], np.array(square.normal)[:, None], atol=1e-15)
    first, second = (render(scene(floor(), lights=(way,)), Exact()) for way in (square, light))
    np.testing.assert_allclose(second.mean, first.mean, rtol=1e-12, atol=1e-14)
    assert (first.emitter == second.emitter).all()


@pytest.mark.parametrize("stratified", [False, True])
def test_places_are_uniform_in_area(stratified):
    light = MeshLight(replace(box((-2, 1, -1), (1, 1.5, 1)), material=TENT.material), RADIANCE)
    u, v = unit_square(np.random.default_rng(4), 2000, 49, stratified)
    at = np.zeros((3, 2000))
    d, weight = light.beams(at, u, v)
    k = light._on(d.reshape(3, -1), np.zeros((3, d[0].size)))
    areas = np.sqrt((np.cross(*(light.surface.corners[j].T - light.surface.corners[0].T for j in (1, 2))) ** 2).sum(1))
    expected = k.size * areas / areas.sum()
    counts = np.bincount(k, minlength=12)
    off = chi2.sf(((counts - expected) ** 2 / expected).sum(), 11)
    assert off > FALSE_ALARM
    even = k.size / 12
    assert chi2.sf(((counts - even) ** 2 / even).sum(), 11) < FALSE_ALARM  # as if all triangles were as likely
    np.testing.assert_allclose(weight * 49, np.where(weight > 0, light.worth(at, d), 0), rtol=1e-9)


@pytest.mark.parametrize("mesh", [sphere_mesh(3, 0.4), TENT], ids=["convex", "hollow"])
def test_it_gives_what_as_many_triangle_lights_give(mesh):
    light = MeshLight(replace(mesh, vertices=mesh.vertices + np.array([[0.0], [1.0], [0.0]])), RADIANCE)
    assert light.hides_itself == (mesh is TENT)
    things = floor(2.0), box((-0.9, 0.0, -0.6), (-0.5, 0.7, 0.4))
    one = render(scene(*things, lights=(light,), size=(16, 12)), Area(samples=64), seed=1, passes=8)
    many = render(scene(*things, lights=triangles_of(light), size=(16, 12)), Area(samples=64), seed=2, passes=8)
    on = one.shaded & many.shaded
    assert on.sum() > 40
    error = np.sqrt((one.pixel_variance + many.pixel_variance)[on].sum() / 8)
    off = (one.mean - many.mean).mean(axis=0)[on].sum()
    assert abs(off) < 5 * error
    assert error < 0.03 * one.mean.mean(axis=0)[on].sum()
    np.testing.assert_array_equal(one.mean[:, one.emitter > 0], many.mean[:, one.emitter > 0])


def test_what_hides_itself_is_in_its_own_way():
    """A slope of the tent is dark from where the other one is before it: its back to the point, and black."""
    light = MeshLight(TENT, RADIANCE)
    at, up = np.array([[3.0], [1.2], [0.5]]), np.array([[-1.0], [0.0], [0.0]])
    points = shading_points_of(at, up)
    unhidden, _ = light.unshadowed(points, False)
    outside = scene(quad((3, 0, 0), (3, 0, 1), (3, 3, 1), (3, 3, 0)), lights=(light,))
    seen = prepare(outside, everything=True, moved=False).needs.sources[0]
    assert unhidden.min() > 0.01
    assert np.abs(Area(samples=256)(points, seen, np.random.default_rng(1))).max() == 0


def test_closed_forms_are_those_of_its_triangles_and_end_where_they_are_many():
    convex = MeshLight(sphere_mesh(5, 0.4), RADIANCE)
    made = scene(floor(2.0, -1.0), lights=(convex,), size=(12, 8))
    image = render(made, Exact())
    assert set(image.routes) == {"lit"}
    apart = render(made.with_(lights=triangles_of(convex)), Analytic())
    np.testing.assert_allclose(image.mean, apart.mean, rtol=1e-9, atol=1e-14)
    assert image.bound.max() < 1e-9
    many = MeshLight(sphere_mesh(12, 0.4), RADIANCE)
    assert many.count > 256
    sampled = render(made.with_(lights=(many,)), Exact(samples=16))
    assert set(sampled.routes) == {"sampled"}


LINES = "meshLight 5 4 3\ntranslate 0 2 0\n{}\nmeshLight 0 0 0\n"
OBJ = "v 0 0 0\nv 1 0 0\nv 0 0 1\nv 1 0 1\nf 1 2 3\nf 2 4 3\n"
TRI = "vertex 0 0 0\nvertex 1 0 0\nvertex 0 0 1\nvertex 1 0 1\ntri 0 1 2\ntri 1 3 2"


def test_surfaces_after_the_command_are_lights(tmp_path):
    (tmp_path / "lamp.obj").write_text(OBJ)
    (tmp_path / "a.test").write_text(HEAD + LINES.format("mesh lamp.obj") + TRI)
    read = read_scene(tmp_path / "a.test")
    (light,) = read.lights
    assert (light.kind, light.radiance, light.hull()[1].tolist()) == ("mesh", RADIANCE, [2.0] * 4)
    assert len(read.meshes) == 1
    typed = parse_scene(HEAD + LINES.format(TRI))
    assert typed.lights == read.lights
    assert read.lines[2] == (5,)
    assert parse_scene(write_scene(read)) == read.with_(name="scene")


def test_lights_stay_in_order_and_each_line_of_a_mesh_is_one():
    text = HEAD + LINES.format(TRI + "\npoint 0 5 0 1 1 1\ntri 0 1 2\ndiffuse 1 1 1\ntri 1 3 2")
    assert [light.kind for light in parse_scene(text).lights] == ["mesh", "point", "mesh", "mesh"]


@pytest.mark.parametrize(
    ("lines", "named"),
    [
        ("meshLight 1 1 -1\n" + TRI, "<text>:3: meshLight radiance"),
        ("meshLight 1 1 1\nsphere 0 0 0 1", "sphereLight"),
        ("meshLight 1 1 1\nscale 1e200 1e200 1e200\n" + TRI, "<text>:9: meshLight area"),
    ],
)
def test_what_is_none_is_refused(lines, named):
    with pytest.raises(InputError, match=named):
        parse_scene(HEAD + lines)


def test_too_many_triangles_are_refused():
    grid = np.repeat(np.arange(3)[:, None], 100_001, axis=1)
    with pytest.raises(InputError, match="1 to 100000 triangles"):
        MeshLight(Mesh(np.eye(3), grid), RADIANCE)


def test_how_far_it_is_from_what_it_lights_is_that_of_its_nearest_triangle():
    """With fewer triangles before it than it has, and more; and a ball about it, from below, where it has very many."""
    light = MeshLight(replace(sphere_mesh(4, 0.4), vertices=sphere_mesh(4, 0.4).vertices + 1.0), RADIANCE)
    few, many = (build_geometry(scene(mesh)) for mesh in (floor(2.0), sphere_mesh(8, 0.5)))
    for geometry in (few, many):
        index = np.arange(geometry.triangles)
        one, _ = clearance(light, geometry, index)
        apart = np.min([clearance(part, geometry, index)[0] for part in triangles_of(light)], axis=0)
        np.testing.assert_allclose(one[np.isfinite(apart)], apart[np.isfinite(apart)], rtol=1e-12)
    fine = MeshLight(replace(sphere_mesh(34, 0.4), vertices=sphere_mesh(34, 0.4).vertices + 1.0), RADIANCE)
    assert fine.count > 4096
    assert 0.5 < clearance(fine, few, np.arange(2))[0].min() <= 0.6


@pytest.mark.parametrize(
    "corners",
    [((1, -1, 1e-9), (2, 1, 1e-9), (3, -1, 1e-9)), ((1, -0.5, -0.999999999), (1, 0, 1e-9), (1, 0.5, -0.999999999))],
    ids=["below its plane, beside it", "upright, its tip above"],
)
def test_a_value_that_has_cancelled_whole_is_not_called_exact(corners):
    """It gives 1.5e-19 and 1.7e-28: less than the rounding of what its boundary integrals add up."""
    light = TriangleLight(*corners, (1.0, 1.0, 1.0))
    mesh = MeshLight(Mesh(np.array(corners).T, np.arange(3)[:, None]), light.radiance)
    points = shading_points_of(np.zeros((3, 1)), np.array([[0.0], [0.0], [1.0]]))
    for one in (light, mesh):
        value, bound = one.unshadowed(points, False)
        assert (value == 0).all()
        assert bound == 1
