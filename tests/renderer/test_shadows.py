"""Shadow rays: no surface hides itself, nothing near is missed, at any scale and place."""

from __future__ import annotations

import numpy as np
import pytest
from builders import box, floor, geometry, lamp, quad, sphere_mesh

from nusselt.renderer.surfaces import Ellipsoid
from nusselt.renderer.vectors import column, cross, dot, unit
from nusselt.renderer.visibility.segments import Blockers


def seen(g, points, targets, own=None, at_infinity=False):
    """Visibility of one target (3, n) from each point (3, n)."""
    own = np.full(points.shape[1], -1) if own is None else own
    d = (targets if at_infinity else targets - points)[:, :, None]
    return Blockers.everything(g).visible(points, own, d, at_infinity)[:, 0]


def triangles(rng, count, scale, offset):
    return [rng.normal(size=(3, count)) * scale + offset for _ in range(3)]


@pytest.mark.parametrize(
    ("scale", "offset"),
    [(1e-6, 0), (1e-3, 0), (1, 0), (1e3, 0), (1e9, 0), (1, 1e3), (1, 1e6), (1e-30, 0), (1e30, 0)],
)
def test_no_surface_hides_itself_even_from_grazing_light(scale, offset):
    rng = np.random.default_rng(7)
    for _ in range(40):
        a, b, c = triangles(rng, 1, scale, offset)
        mesh = quad(a[:, 0], b[:, 0], c[:, 0], (a + c - b)[:, 0])
        g = geometry(mesh)
        w = rng.dirichlet((1, 1, 1), 200).T
        p = g.a[:, [0]] * w[0] + g.b[:, [0]] * w[1] + g.c[:, [0]] * w[2]
        n = unit(g.normal[:, [0]])
        along = unit(cross(np.broadcast_to(n, p.shape), rng.normal(size=p.shape)))
        q = p + scale * (along + n * rng.uniform(1e-4, 0.03, 200))
        assert seen(g, p, q).all()
        assert seen(g, p, (q - p) / scale, at_infinity=True).all()


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e9])
@pytest.mark.parametrize("gap", [1e-12, 1e-9, 1e-6, 1e-3, 0.1])
def test_a_blocker_hides_however_close_to_either_end(scale, gap):
    for y in (gap, 1 - gap):
        g = geometry(floor(0.5 * scale), floor(0.2 * scale, y * scale), lights=(lamp(scale, 0.1 * scale),))
        p = scale * np.array([[0.0, 0.03], [0, 0], [0, 0.01]])
        q = scale * np.array([[0.02, -0.05], [1, 1], [0.01, 0.0]])
        assert not seen(g, p, q).any()


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e9])
def test_light_and_floor_do_not_hide_each_other(scale):
    g = geometry(floor(2 * scale), lights=(lamp(scale, 0.5 * scale),))
    rng = np.random.default_rng(3)
    p = scale * np.stack([rng.uniform(-2, 2, 500), np.zeros(500), rng.uniform(-2, 2, 500)])
    q = scale * np.stack([rng.uniform(-0.5, 0.5, 500), np.ones(500), rng.uniform(-0.5, 0.5, 500)])
    assert seen(g, p, q).all()


def test_no_segment_leaves_a_closed_mesh():
    mesh = sphere_mesh()
    g = geometry(mesh)
    rng = np.random.default_rng(0)
    a, b, _ = mesh.corners
    pick, t = rng.integers(0, mesh.triangles.shape[1], 3000), rng.random(3000)
    t[:1000] = 0
    p = np.broadcast_to(column((0.013, -0.007, 0.002)), (3, 3000))
    aim = a[:, pick] * (1 - t) + b[:, pick] * t - p
    assert not seen(g, p, p + 5 * aim).any()
    assert not seen(g, p, aim, at_infinity=True).any()


def test_the_point_far_away_counts_as_the_direction():
    g = geometry(box((-0.5, 0.5, -0.5), (0.5, 1.0, 0.5)), ellipsoids=(Ellipsoid.sphere((1.2, 0.8, 0), 0.4),))
    rng = np.random.default_rng(5)
    p = np.stack([rng.uniform(-2, 2, 2000), np.zeros(2000), rng.uniform(-2, 2, 2000)])
    d = unit(np.stack([rng.normal(size=2000) * 0.4, np.ones(2000), rng.normal(size=2000) * 0.4]))
    near, far = seen(g, p, p + 1e7 * d), seen(g, p, d, at_infinity=True)
    assert 0.02 < (~far).mean() < 0.9
    np.testing.assert_array_equal(near, far)


def test_ellipsoids_hide_as_their_tessellation_does():
    axes = ((0.5, 0.1, 0.0), (0.0, 0.4, 0.1), (0.05, 0.0, 0.3))
    center = (0.1, 1.0, 0.0)
    fine = sphere_mesh(rings=40)
    vertices = np.array(axes) @ fine.vertices + column(center)
    meshed = geometry(type(fine)(vertices, fine.triangles))
    exact = geometry(ellipsoids=(Ellipsoid(center, axes),))
    rng = np.random.default_rng(11)
    p = np.stack([rng.uniform(-1, 1, 1500), np.zeros(1500), rng.uniform(-1, 1, 1500)])
    q = np.stack([rng.uniform(-0.5, 0.5, 1500), np.full(1500, 2.0), rng.uniform(-0.5, 0.5, 1500)])
    one, other = seen(exact, p, q), seen(meshed, p, q)
    assert 0.1 < (~one).mean() < 0.9
    assert (one != other).mean() < 1e-2  # the mesh lies up to 3e-3 inside


def test_a_sphere_hides_what_is_behind_it_from_its_own_surface_only_by_its_horizon():
    g = geometry(ellipsoids=(Ellipsoid.sphere((0, 0, 0), 1.0),))
    rng = np.random.default_rng(1)
    p = unit(rng.normal(size=(3, 1000)))
    q = 3 * unit(rng.normal(size=(3, 1000)))
    above = dot(p, q - p) > 0
    own = np.zeros(1000, dtype=int)
    assert seen(g, p, q, own)[above].all()
    inside = 0.5 * p  # from within, everything outside is hidden
    assert not seen(g, inside, q).any()


def test_candidates_leave_out_no_blocker():
    g = geometry(
        floor(),
        box((-0.5, 0.2, -0.5), (0.3, 0.7, 0.4)),
        box((0.6, 0, 0.6), (0.9, 1.5, 0.9)),
        lights=(lamp(1.6),),
        ellipsoids=(Ellipsoid.sphere((-1, 0.5, 0.5), 0.3),),
    )
    rng = np.random.default_rng(9)
    everything = Blockers.everything(g)
    corners = np.array([[-0.5, -0.5, 0.5, 0.5], [1.6] * 4, [-0.5, 0.5, -0.5, 0.5]])
    hidden = 0
    for _ in range(20):
        x, z = rng.uniform(-2, 1.7, 2)
        p = np.stack([rng.uniform(x, x + 0.3, 60), np.zeros(60), rng.uniform(z, z + 0.3, 60)])
        q = np.stack([rng.uniform(-0.5, 0.5, 60), np.full(60, 1.6), rng.uniform(-0.5, 0.5, 60)])
        d, own = (q - p)[:, :, None], np.full(60, -1)
        few = everything.between(p, corners, False)
        assert few.triangles.size < g.triangles
        full = everything.visible(p, own, d, False)
        np.testing.assert_array_equal(few.visible(p, own, d, False), full)
        hidden += (~full).sum()
    assert hidden > 200
