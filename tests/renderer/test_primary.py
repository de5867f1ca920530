"""Primary visibility: watertight, scale-free, and the same as one ray at a time."""

from __future__ import annotations

import numpy as np
import pytest
from builders import box, floor, geometry, lamp, scene, sphere_mesh

from nusselt.renderer.camera.first_hits import first_hits
from nusselt.renderer.camera.rays import primary_directions
from nusselt.renderer.geometry.arrays import build_geometry
from nusselt.renderer.scene import Camera
from nusselt.renderer.surfaces import Ellipsoid
from nusselt.renderer.vectors import column, cross, dot, unit


def edge_rays(mesh, count: int, seed: int = 0):
    """Directions from near the centre at points on shared edges and vertices of a closed mesh."""
    rng = np.random.default_rng(seed)
    origin = column(rng.normal(size=3) * 0.02)
    a, b, _ = (corner[:, rng.integers(0, mesh.triangles.shape[1], count)] for corner in mesh.corners)
    a, b, _ = mesh.corners
    pick = rng.integers(0, mesh.triangles.shape[1], count)
    t = rng.random(count)
    t[: count // 3] = 0  # exactly at vertices
    return origin, a[:, pick] * (1 - t) + b[:, pick] * t - origin


def test_no_ray_slips_between_triangles_of_a_closed_mesh():
    mesh = sphere_mesh()
    origin, d = edge_rays(mesh, 4000)
    hits = first_hits(geometry(mesh), origin, d)
    assert (hits.surface == 0).all()


def test_the_same_rays_do_slip_through_edge_functions_without_slack():
    """The control: signs of rounded edge functions lose rays at vertices, though zero counts as inside."""
    mesh = sphere_mesh()
    origin, d = edge_rays(mesh, 4000)
    a, b, c = (corner - origin for corner in mesh.corners)
    w = np.stack([dot(cross(*pair)[:, :, None], d[:, None, :]) for pair in ((b, c), (c, a), (a, b))])
    ahead = dot(cross(b - a, c - a)[:, :, None], d[:, None, :]) > 0  # the faces look outwards
    without_slack = (((w >= 0).all(axis=0) | (w <= 0).all(axis=0)) & ahead).any(axis=0)
    assert (~without_slack).sum() > 10


def one_ray(g, o, d):
    """Cramer's rule, one triangle at a time: slow and obvious."""
    best = (np.inf, -1)
    for k in range(g.triangles):
        a, b, c = g.a[:, k], g.b[:, k], g.c[:, k]
        matrix = np.stack([a - b, a - c, d], axis=1)
        if abs(np.linalg.det(matrix)) < 1e-14:
            continue
        beta, gamma, t = np.linalg.solve(matrix, a - o)
        if t > 0 and beta >= 0 and gamma >= 0 and beta + gamma <= 1 and t < best[0]:
            best = (t, g.triangle_surface[k])
    return best


def test_nearest_hit_is_that_of_the_obvious_loop():
    s = scene(floor(), box((-0.5, 0, -0.5), (0.5, 1, 0.5)), lights=(lamp(),), size=(12, 9))
    g = build_geometry(s)
    x, y = np.random.default_rng(1).random((2, 150)) * [[12], [9]]
    d = primary_directions(s, x, y)
    origin = column(s.camera.position)
    corners = primary_directions(s, np.array([0, 1.0, 0]), np.array([0, 0, 1.0]))
    hits = first_hits(g, origin, d, corners)
    for k in range(150):
        t, surface = one_ray(g, origin[:, 0], d[:, k])
        assert hits.surface[k] == surface
        if surface >= 0:
            assert hits.distance[k] == pytest.approx(t, rel=1e-12)


def test_tile_cone_leaves_out_nothing_that_is_seen():
    s = scene(floor(), sphere_mesh(), lights=(lamp(),), size=(64, 48))
    g = build_geometry(s)
    for x0, y0 in ((0, 0), (20, 10), (32, 24), (60, 40)):
        x, y = (v.ravel() for v in np.meshgrid(np.arange(x0, x0 + 4) + 0.5, np.arange(y0, y0 + 4) + 0.5))
        corners = primary_directions(s, np.array([0, 1.0, 0]), np.array([0, 0, 1.0]))
        d = primary_directions(s, x, y)
        all_of_it = first_hits(g, column(s.camera.position), d)
        in_cone = first_hits(g, column(s.camera.position), d, corners)
        np.testing.assert_array_equal(all_of_it.surface, in_cone.surface)
        np.testing.assert_array_equal(all_of_it.position, in_cone.position)


@pytest.mark.parametrize("distance", [10.0, 1e3, 1e6])
def test_hit_lies_on_its_plane_however_far_the_camera(distance):
    tilted = box((-1, -1.3, -0.7), (0.9, 1.1, 0.8))
    camera = Camera((0.3 * distance, distance, 0.7 * distance), (0, 0, 0), (0, 1, 0), 1e-1 / distance * 20)
    s = scene(tilted, size=(16, 16), camera=camera)
    g = build_geometry(s)
    x, y = np.random.default_rng(0).random((2, 400)) * 16
    hits = first_hits(g, column(camera.position), primary_directions(s, x, y))
    on = hits.surface >= 0
    assert on.sum() > 50
    planes = np.array([-1, 0.9, -1.3, 1.1, -0.7, 0.8])
    axis = np.abs(hits.normal[:, on]).argmax(axis=0)
    coordinate = hits.position[:, on][axis, np.arange(on.sum())]
    assert np.abs(coordinate[:, None] - planes).min(axis=1).max() < 1e-15


def test_ellipsoid_is_hit_on_its_surface_with_its_gradient_as_normal():
    axes = ((0.5, 0.2, 0.0), (0.0, 0.9, 0.1), (0.1, 0.0, 0.3))
    g = geometry(ellipsoids=(Ellipsoid((0.2, 0.1, -0.3), axes),))
    origin = column((3.0, 2.0, 5.0))
    d = column((0.2, 0.1, -0.3)) - origin + np.random.default_rng(2).normal(size=(3, 500)) * 0.3
    hits = first_hits(g, origin, d)
    on = hits.surface >= 0
    assert 50 < on.sum() < 500
    inverse = np.linalg.inv(np.array(axes))
    local = inverse @ (hits.position[:, on] - column((0.2, 0.1, -0.3)))
    assert np.abs(dot(local, local) - 1).max() < 1e-14
    assert np.abs(unit(inverse.T @ local) - hits.normal[:, on]).max() < 1e-14
    along = origin + d[:, on] * hits.distance[on]
    assert np.abs(along - hits.position[:, on]).max() < 1e-13


@pytest.mark.parametrize("scale", [1e-30, 1e-6, 1.0, 1e9, 1e30])
def test_scale_changes_nothing(scale):
    def seen(k):
        mesh = box((-k, -k, -k), (k, k, k))
        ball = Ellipsoid.sphere((1.5 * k, 0, 0), 0.7 * k)
        s = scene(mesh, ellipsoids=(ball,), camera=Camera((2 * k, 3 * k, 5 * k), (0, 0, 0), (0, 1, 0), 45.0))
        x, y = (v.ravel() for v in np.meshgrid(np.arange(32) + 0.5, np.arange(24) + 0.5))
        return first_hits(build_geometry(s), column(s.camera.position), primary_directions(s, x, y))

    one, other = seen(1.0), seen(scale)
    np.testing.assert_array_equal(one.surface, other.surface)
    np.testing.assert_allclose(other.position / scale, one.position, rtol=1e-12, atol=1e-13)
