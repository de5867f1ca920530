"""Where a scene goes and what is cut: the same to Mitsuba, and right where little of a scene is seen."""

from __future__ import annotations

import numpy as np
import pytest
from builders import box, floor, lamp, scene
from limit_scenes import BODIES, text

from nusselt.experiments.scenes import catalogue
from nusselt.mitsuba_bridge import placement as placement_module
from nusselt.mitsuba_bridge.cutting import cut
from nusselt.mitsuba_bridge.description import describe
from nusselt.mitsuba_bridge.placement import Placement, place
from nusselt.mitsuba_bridge.reference import Reference, render_reference
from nusselt.mitsuba_bridge.tessellation import tessellate_about
from nusselt.mitsuba_bridge.tolerance import ray_tolerance
from nusselt.renderer.estimators import Exact
from nusselt.renderer.image import render
from nusselt.renderer.scene import Scene
from nusselt.renderer.scene_text import parse_scene
from nusselt.renderer.vectors import column, cross, dot, unit

pytestmark = pytest.mark.mitsuba

WIDE = [name for name in BODIES if name.startswith(("ground", "planet", "far-l", "far-p", "far-b"))]


def reference(made: Scene, seed: int = 3) -> Reference:
    return render_reference(made, seed=seed, target_relative_se=2e-3, max_samples=1 << 12, timeout=120)


@pytest.mark.parametrize("name", ["quad", "cornell-boxes", "three-lights", "lonely", "horizon", "mesh"])
def test_ordinary_scenes_are_sent_as_they_are(name, tmp_path):
    made = catalogue.load(name)
    assert not place(made).wide
    for mesh in made.meshes:
        assert cut(np.stack(mesh.corners, axis=2), place(made)) is None
    assert not any("pieces" in note for note in describe(made.with_(meshes=made.meshes[:4]), tmp_path).notes)


def test_pieces_cover_what_they_were_cut_from():
    """As much area in each direction, no corner off its triangle's plane, and both sides of a shared edge alike."""
    where = Placement((0.3, 0.1, -0.2), 1.0, 1e6, wide=True)
    corners = np.random.default_rng(5).normal(size=(3, 50, 3)) * 10.0 ** np.random.default_rng(6).uniform(0, 6, (50, 1))
    pieces = cut(corners, where)
    assert pieces is not None
    assert pieces.shape[1] > 500

    def area(of):
        return cross(of[:, :, 1] - of[:, :, 0], of[:, :, 2] - of[:, :, 0]).sum(axis=1)

    np.testing.assert_allclose(area(pieces), area(corners), rtol=1e-9)
    square = np.array([[-1e6, 0, 1e6], [1e6, 0, 1e6], [1e6, 0, -1e6], [-1e6, 0, -1e6]]).T
    halves = cut(np.stack((square[:, [0, 1, 2]], square[:, [0, 2, 3]]), axis=1), where)
    edges = np.concatenate([halves[:, :, [k, (k + 1) % 3]] for k in range(3)], axis=1)
    starts = {(*edge[:, 0], *edge[:, 1]) for edge in edges.transpose(1, 0, 2)}
    alone = [edge for edge in starts if (*edge[3:], *edge[:3]) not in starts]
    assert all(max(abs(np.array(edge))) == pytest.approx(1e6) for edge in alone)  # the rim: no T anywhere else
    nearest = np.abs(halves - column(where.centre)[:, :, None]).max(axis=0)
    assert (nearest.max(axis=1) <= 8 * np.maximum(nearest.min(axis=1), 40)).mean() > 0.5


def test_a_mesh_about_a_place_is_as_near_its_sphere_as_is_said():
    for axes, finest in ((np.diag([6e6] * 3), 1e-8), (np.array([[90.0, 5, 0], [0, 60, 3], [0, 0, -40]]), 1e-3)):
        foot = unit(column((0.1, 1.0, 0.2)))
        vertices, normals, triangles, error = tessellate_about(axes, foot, finest)
        a, b, c = (vertices[:, index] for index in triangles)
        inverse = np.linalg.inv(axes)
        for weight in np.random.default_rng(0).dirichlet([1, 1, 1], size=8):
            p = weight[0] * a + weight[1] * b + weight[2] * c
            local = inverse @ p
            height = dot(2 * foot + local, local) / 2
            slope = inverse.T @ (local + foot)
            off = np.abs(height) / np.sqrt(dot(slope, slope))
            assert (off <= 1.1 * error * np.sqrt(dot(p, p))).all()
        assert (dot(cross(b - a, c - a), normals[:, triangles[0]]) > 0).all()


def test_a_scene_placed_by_what_is_seen_is_the_same_to_mitsuba(monkeypatch):
    """An ordinary scene both ways: nothing may change but the noise."""
    made = scene(floor(), box((-0.4, 0.0, -0.4), (0.3, 0.6, 0.2)), lights=(lamp(1.8, 0.3),))
    before = reference(made)
    monkeypatch.setattr(placement_module, "WIDE", 0.0)
    placement_module._place.cache_clear()
    try:
        assert place(made).wide
        after = reference(made, seed=4)
    finally:
        placement_module._place.cache_clear()
    np.testing.assert_array_equal(before.background, after.background)
    np.testing.assert_array_equal(before.emitter, after.emitter)
    error = np.hypot(np.hypot(before.pixel_standard_error, after.pixel_standard_error), 1e-5 * before.mean.max())
    z = np.abs((before.mean - after.mean).mean(axis=0)) / error
    assert (z > 4.5).mean() < 0.01
    assert before.mean.mean() == pytest.approx(
        after.mean.mean(), abs=8 * np.hypot(before.pooled_error, after.pooled_error)
    )


@pytest.mark.parametrize("name", WIDE)
def test_what_is_far_larger_than_what_is_seen_agrees_with_ours(name):
    made = parse_scene(text(name, "48 36"))
    assert place(made).wide
    ours, seen = render(made, Exact(samples=256, stratified=True), tolerance=ray_tolerance(made)), reference(made)
    sure = ~ours.unjudged & (seen.holes == 0)
    np.testing.assert_array_equal(ours.background[sure], seen.background[sure])
    shaded = sure & ours.shaded
    assert shaded.sum() > 300
    difference = (ours.mean - seen.mean).mean(axis=0)[shaded]
    size = seen.mean.mean(axis=0)[shaded].mean()
    assert abs(difference.mean()) < 7 * seen.pooled_error + 2e-4 * size
    # Mitsuba lifts its rays by a ten-thousandth of what is seen: single pixels of a penumbra's edge may differ.
    error = np.hypot(seen.pixel_standard_error[shaded], 1e-4 * size)
    assert (np.abs(difference) > 6 * error).mean() < 0.02
