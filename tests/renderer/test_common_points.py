"""What one light point sees of closed meshes; light points shared by all pixels; images at a requested error."""

from __future__ import annotations

import numpy as np
import pytest
from builders import box, floor, geometry, lamp, scene
from scipy import stats
from test_many_triangles import SHAPES, made, rays

from nusselt.experiments.check.adaptive import PASSES, render_until
from nusselt.experiments.scenes.meshes import displaced_sphere, torus_knot
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Area, CommonPoints, CommonPointsFixed
from nusselt.renderer.estimators.common_points import lattice
from nusselt.renderer.geometry.closed_surfaces import closed_surface
from nusselt.renderer.image import render
from nusselt.renderer.lights import DirectionalLight, SunLight
from nusselt.renderer.needs import Source
from nusselt.renderer.prepared import prepare
from nusselt.renderer.surfaces import Ellipsoid, Mesh
from nusselt.renderer.vectors import column
from nusselt.renderer.visibility import shared_points as common_visibility
from nusselt.renderer.visibility.segments import Blockers
from nusselt.renderer.visibility.shared_points import CommonVisibility


@pytest.mark.parametrize("shape", SHAPES)
def test_closed_meshes_have_euler_characteristics_of_their_kind(shape):
    mesh = made(shape, 2000)
    surface, reason = closed_surface(*mesh.corners)
    assert surface is not None, reason
    faces, pieces = mesh.triangles.shape[1], 1
    if shape is not displaced_sphere:
        pieces = faces // 8 if shape is not torus_knot else 0
    assert surface.vertices.shape[1] - surface.edges.shape[1] + faces == 2 * pieces


def test_surfaces_that_do_not_close_are_refused_with_the_reason():
    mesh = box((0, 0, 0), (1, 1, 1))
    a, b, c = mesh.corners
    surface, reason = closed_surface(a[:, 1:], b[:, 1:], c[:, 1:])
    assert surface is None
    assert "3 edges belong to one triangle alone" in reason
    flipped = [np.hstack((p[:, :1], q[:, 1:])) for p, q in ((a, a), (c, b), (b, c))]
    surface, reason = closed_surface(*flipped)
    assert surface is None
    assert "3 edges are run along more often one way" in reason


def test_surfaces_that_touch_cross_or_are_inside_out_are_closed():
    one, touching, crossing = box((0, 0, 0), (1, 1, 1)), box((1, 1, 0), (2, 2, 1)), box((0.5, 0.5, 0.5), (3, 3, 3))
    for other in (touching, crossing):
        assert closed_surface(*(np.hstack(pair) for pair in zip(one.corners, other.corners, strict=True)))[0]
    a, b, c = one.corners
    assert closed_surface(a, c, b)[0]


LIGHTS = (lamp(3.0, 0.7), SunLight((0.3, 2, 0.4), (1, 1, 1), 20.0), DirectionalLight((0.3, 2, 0.4), (1, 1, 1)))


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("light", LIGHTS, ids=lambda light: type(light).__name__)
@pytest.mark.parametrize("turned", [False, True])
def test_silhouettes_hide_what_testing_every_triangle_hides(shape, light, turned):
    mesh = made(shape, 400)
    if turned:  # inside out
        mesh = Mesh(mesh.vertices, mesh.triangles[::-1])
    g = geometry(mesh)
    source = Source(0, light, Blockers.everything(g).gathered(), False)
    view = CommonVisibility.of(source.blockers, source.light)
    assert view.outline is not None
    p, _ = rays(mesh, 700, seed=5)
    own = np.full(p.shape[1], -1)
    wrong = 0
    for u, v in np.random.default_rng(2).random((3, 2)):
        if isinstance(light, type(LIGHTS[0])):
            eye = column(light.corner) + u * column(light.ab) + v * column(light.ac)
            d, infinite = eye - p, False
        else:
            eye = column(light.direction) + (0.05 * column((u, 0, v)) if isinstance(light, SunLight) else 0)
            d, infinite = np.broadcast_to(eye, p.shape), True
        every = Blockers.everything(g).visible(p, own, d[:, :, None], infinite)[:, 0]
        wrong += (view.seen(p, own, d, eye, infinite) != every).sum()
        assert 0.1 < every.mean() < 0.95
    assert wrong == 0


def test_a_silhouette_that_loses_an_edge_is_caught(monkeypatch):
    """The control of the test above."""
    whole = common_visibility.silhouette

    def torn(outline, eye, at_infinity):
        from dataclasses import replace

        return whole(
            replace(outline, left=np.where(np.arange(outline.left.size) % 50, outline.left, outline.right)),
            eye,
            at_infinity,
        )

    monkeypatch.setattr(common_visibility, "silhouette", torn)
    with pytest.raises(AssertionError):
        test_silhouettes_hide_what_testing_every_triangle_hides(displaced_sphere, LIGHTS[0], False)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("light", LIGHTS[:2], ids=lambda light: type(light).__name__)
def test_faces_turned_to_a_light_hide_from_points_outside_what_all_hide(shape, light):
    g = geometry(made(shape, 400))
    view = CommonVisibility.of(Blockers.everything(g).gathered(), light)
    p = (g.a + g.b + g.c) / 3
    eye = light.hull().mean(axis=1, keepdims=True)
    d = np.broadcast_to(eye, p.shape) if light.at_infinity else eye - p
    facing = np.flatnonzero((g.normal * d).sum(axis=0) > 0)
    p, d = p[:, facing], d[:, facing]
    fewer, every = (b.hierarchy_hides(p, d, light.at_infinity) for b in (view.turned, view.blockers))
    assert view.turned.hierarchy.triangles.size < 0.7 * view.blockers.hierarchy.triangles.size
    assert 0.02 < every.mean() < 0.95
    assert np.array_equal(fewer, every)


def mesh_scene(size=(20, 15)):
    ball = Ellipsoid.sphere((0.9, 0.4, 0.9), 0.3)
    return scene(made(torus_knot, 600, 0.7, (0, 1, 0)), floor(), ellipsoids=(ball,), lights=(lamp(2.5),), size=size)


def test_common_points_behind_a_mesh_average_to_what_plain_sampling_does():
    s = mesh_scene()
    needs = prepare(s).needs
    assert needs.sources[0].blockers.hierarchy is not None
    plain = render(s, Area(samples=16, stratified=True), seed=1, passes=12)
    image = render(s, CommonPoints(samples=5), seed=2, passes=30)
    k = image.shaded
    noise = image.pixel_variance * image.clumping / 30 + plain.pixel_variance / 12
    z = (image.mean - plain.mean).mean(axis=0)[k].sum() / np.sqrt(noise[k].sum())
    assert 2 * stats.t(29).sf(abs(z)) > 1e-6
    worst = np.abs(image.mean - plain.mean).mean(axis=0) / np.sqrt(noise / image.clumping + 1e-12)
    assert worst[k].max() < 8


def test_the_clumping_is_that_of_repeated_images():
    """One tile: the variance of the image's sum over passes, measured outright."""
    s = scene(box((-0.6, 0.5, -0.6), (0.6, 0.7, 0.6)), floor(), lights=(lamp(2.5),), size=(24, 18))
    image = render(s, CommonPoints(samples=1), seed=7, passes=30)
    k = image.shaded
    outright = image.pass_means.var(ddof=1) * k.sum() ** 2 / image.pixel_variance[k].sum()
    assert image.clumping == pytest.approx(outright, rel=1e-9)
    assert image.clumping > 2
    assert render(s, Area(samples=4), seed=7, passes=4).clumping == 1


def test_the_lattice_in_place_converges_faster_than_one_over_the_root():
    s = mesh_scene()
    exact = render(s, CommonPointsFixed(samples=610)).mean

    def error(samples):
        return float(np.sqrt(((render(s, CommonPointsFixed(samples=samples)).mean - exact) ** 2).mean()))

    assert error(89) < error(8) * (8 / 89) ** 0.6


def test_lattices_are_fibonacci_and_cover_the_square():
    for asked, size in ((1, 1), (5, 5), (6, 8), (100, 144)):
        at = lattice(asked)
        assert at.shape == (2, size)
        assert np.unique(at[1]).size == size


def test_an_image_at_a_requested_error_is_that_near():
    s = mesh_scene((16, 12))
    reached = render_until(s, CommonPoints(), 2e-2, seed=3)
    assert reached.error <= 2e-2
    exact = render(s, CommonPointsFixed(samples=610)).mean.mean(axis=0)
    k = reached.image.shaded
    off = np.sqrt(((reached.image.mean.mean(axis=0) - exact)[k] ** 2).mean() / (exact[k] ** 2).mean())
    assert 0.3 * reached.error < off < 3 * reached.error  # PASSES passes: the estimate itself is known to 20 %
    assert PASSES == 8
    with pytest.raises(InputError, match="cannot tell its error"):
        render_until(s, CommonPointsFixed(), 1e-2)
    with pytest.raises(InputError, match="error"):
        render_until(s, CommonPoints(), 0.0)
