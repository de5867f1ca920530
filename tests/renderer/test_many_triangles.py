"""Big meshes: what the camera sees and what a light sees, against every ray testing every triangle."""

from __future__ import annotations

import numpy as np
import pytest
from builders import floor, geometry, lamp, scene, sphere_mesh

from nusselt.experiments.scenes.meshes import displaced_sphere, many_small, torus_knot
from nusselt.renderer.camera.first_hits import first_hits
from nusselt.renderer.camera.rays import pixel_centres, primary_directions
from nusselt.renderer.camera.screen_boxes import ImageBoxes
from nusselt.renderer.estimators import Area
from nusselt.renderer.geometry.arrays import build_geometry
from nusselt.renderer.image import render
from nusselt.renderer.surfaces import Mesh
from nusselt.renderer.vectors import column
from nusselt.renderer.visibility.bvh import Hierarchy
from nusselt.renderer.visibility.segments import Blockers, crosses

SHAPES = (displaced_sphere, torus_knot, many_small)


def made(shape, triangles: int, scale: float = 1.0, offset=(0.0, 0.0, 0.0)) -> Mesh:
    vertices, corners = shape(triangles)
    return Mesh(vertices * scale + column(offset), corners)


@pytest.mark.parametrize("shape", SHAPES)
def test_formula_meshes_are_wound_outwards(shape):
    a, b, c = made(shape, 3000).corners
    assert (a * np.cross(b, c, axis=0)).sum() > 0


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("jitter", [0.0, 0.5])
def test_binned_camera_rays_hit_what_testing_every_triangle_hits(shape, jitter, monkeypatch):
    s = scene(made(shape, 800, 1.5, (0, 1, 0)), floor(), lights=(lamp(),), size=(32, 24))
    g = build_geometry(s)
    x, y = pixel_centres(range(0, 32), range(0, 24))
    shift = np.random.default_rng(1).uniform(-jitter, jitter, (2, x.size))
    d = primary_directions(s, x + shift[0], y + shift[1])
    pixel = primary_directions(s, np.array([0, 1.0, 0]), np.array([0, 0, 1.0]))
    origin = column(s.camera.position)
    asked = []
    monkeypatch.setattr(ImageBoxes, "_dense", lambda *_: asked.append(1))
    binned = first_hits(g, origin, d, pixel)
    assert not asked  # the control: the other path was not taken
    monkeypatch.undo()
    every = first_hits(g, origin, d)
    assert (every.surface == 0).sum() > 60
    for name in ("surface", "position", "normal"):
        np.testing.assert_array_equal(getattr(binned, name), getattr(every, name))
    np.testing.assert_allclose(binned.distance, every.distance, rtol=1e-15)  # h / n.d, and one over n/h . d


def rays(mesh: Mesh, n: int, seed: int = 0):
    """Half from the mesh's own surface, at vertices and edges too, half from around it; to points around it."""
    rng = np.random.default_rng(seed)
    pick = rng.integers(0, mesh.triangles.shape[1], n)
    w = rng.dirichlet((1, 1, 1), n).T
    w[:, : n // 10] = np.eye(3)[rng.integers(0, 3, n // 10)].T
    own = sum(share * corner[:, pick] for share, corner in zip(w, mesh.corners, strict=True))
    low, high = mesh.vertices.min(axis=1, keepdims=True), mesh.vertices.max(axis=1, keepdims=True)
    around = low + (high - low) * rng.uniform(-0.5, 1.5, (3, n))
    p = np.where(rng.random(n) < 0.5, own, around)
    return p, low + (high - low) * rng.uniform(-0.5, 1.5, (3, n)) - p


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize(("scale", "offset"), [(1.0, 0.0), (1e-6, 0.0), (1.0, 1e4)])
@pytest.mark.parametrize("at_infinity", [False, True])
def test_the_hierarchy_hides_what_testing_every_triangle_hides(shape, scale, offset, at_infinity):
    mesh = made(shape, 300, scale, (offset, -offset, offset))
    blockers = Blockers.everything(geometry(mesh))
    gathered = blockers.gathered()
    assert gathered.hierarchy is not None
    p, d = rays(mesh, 600)
    own = np.full(p.shape[1], -1)
    every = blockers.visible(p, own, d[:, :, None], at_infinity)
    walked = gathered.visible(p, own, d[:, :, None], at_infinity)
    assert 0.1 < every.mean() < 0.9
    # At 1e4 sizes from the origin a point's own rounding is larger, and its bound is taken point by point.
    assert (every != walked).sum() == 0


def test_a_hierarchy_without_its_padding_loses_rays():
    """The control: boxes that are too small by their rounding are missed by rays that touch what they hold."""
    mesh = made(displaced_sphere, 2000)
    g = geometry(mesh)
    tree = Hierarchy.over(g, np.arange(g.triangles))
    shrunk = tuple(level + np.float32(0.02) * np.repeat([[1], [-1]], 3, axis=0).astype("f4") for level in tree.levels)
    p, d = rays(mesh, 3000)

    def hits(ray, triangle):
        return crosses(g, triangle, p[:, ray], d[:, ray], False)

    right = tree.any_hit(p, d, False, hits)
    wrong = Hierarchy(tree.triangles, tree.centre, tree.half, shrunk).any_hit(p, d, False, hits)
    assert (right & ~wrong).sum() > 10


def test_a_big_mesh_shades_the_same_with_and_without_the_hierarchy(monkeypatch):
    s = scene(sphere_mesh(), floor(), lights=(lamp(),), size=(24, 16))
    with_hierarchy = render(s, Area(samples=4), seed=3)
    monkeypatch.setattr("nusselt.renderer.visibility.segments.FEW", 1 << 30)
    without = render(s.with_(name="again", light_samples=2), Area(samples=4), seed=3)
    np.testing.assert_array_equal(with_hierarchy.mean, without.mean)
