"""A receiver in a light's own plane: edge-on to rounding, so dark; above it by more than rounding, lit."""

from __future__ import annotations

import numpy as np
import pytest
from builders import GREY, scene
from places import TEST_SCENES

from nusselt.renderer.estimators import ESTIMATORS, Exact
from nusselt.renderer.image import render
from nusselt.renderer.lights import QuadLight
from nusselt.renderer.lights.facing import faced_by
from nusselt.renderer.lobes import Lambert
from nusselt.renderer.scene import Camera
from nusselt.renderer.scene_text import read_scene
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.surfaces import Mesh
from nusselt.renderer.vectors import column, cross, unit

CASES = TEST_SCENES
SAMPLED = [kind for kind in ESTIMATORS if kind is not Exact]  # `exact` decides by itself what a light faces


def quads(rng, count: int, scale: float, place: float, thin: float = 1.0):
    """Parallelograms (corner, ab, ac), each (3, 1), anywhere."""
    for _ in range(count):
        corner, ab, ac = (column(rng.normal(size=3) * scale) for _ in range(3))
        yield corner + column(rng.normal(size=3) * place), ab, ab * (1 - thin) + ac * thin


@pytest.mark.parametrize(
    ("scale", "place", "thin"),
    [(1, 0, 1), (1, 1, 1), (1e-9, 0, 1), (1e9, 0, 1), (1, 1e4, 1), (1e-3, 1, 1), (1, 1, 1e-4), (1, 0, 1e-8)],
)
def test_no_light_faces_its_own_plane_and_every_light_faces_what_is_above_it(scale, place, thin):
    rng = np.random.default_rng(2)
    for corner, ab, ac in quads(rng, 100, scale, place, thin):
        u, v = rng.uniform(-0.2, 1.2, (2, 300))
        on = corner + u * ab + v * ac
        assert not faced_by(corner, ab, ac, on).any()
        away = -unit(cross(ab, ac))
        # Rounding of the place, and of the normal, which is large where the edges are nearly parallel.
        size, across, doubled = (np.linalg.norm(v, axis=0).max() for v in (on, on - corner, cross(ab, ac)))
        height = 1e-13 * (size + across * np.linalg.norm(ab) * np.linalg.norm(ac) / doubled)
        assert faced_by(corner, ab, ac, on + away * height).all()
        assert not faced_by(corner, ab, ac, on - away * height).any()


def points_on(position, normal):
    n = position.shape[1]
    normal = np.broadcast_to(normal, position.shape)
    flags = np.full(n, -1), np.zeros(n, dtype=bool)
    return ShadingPoints(position, normal, normal, normal, (Lambert,), {"diffuse": np.full((3, n), 0.5)}, *flags)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e6])
def test_a_light_a_hair_above_a_surface_fills_its_sky(scale):
    """At 1e-12 of the light's size: the radiance times the albedo."""
    light = QuadLight((-scale, 0, -scale), (0, 0, 2 * scale), (2 * scale, 0, 0), (5, 5, 5))
    rng = np.random.default_rng(3)
    x, z = rng.uniform(-0.9, 0.9, (2, 50)) * scale
    points = points_on(np.stack([x, np.full(50, -1e-12 * scale), z]), column((0, 1, 0)))
    np.testing.assert_allclose(light.unshadowed(points, False)[0], 2.5, rtol=1e-9)
    level = points_on(np.stack([x, np.zeros(50), z]), column((0, 1, 0)))
    assert not light.unshadowed(level, False)[0].any()
    u, v = rng.random((2, 50, 9))
    assert (light.beams(points.position, u, v)[1] > 0).all()
    assert not light.beams(level.position, u, v)[1].any()


@pytest.mark.parametrize("kind", SAMPLED)
def test_the_case_of_a_light_on_a_side_of_a_box(kind):
    made = read_scene(CASES / "coplanar_light_firefly.test")
    image = render(made, kind(samples=16, stratified=True), seed=1)
    # Where the side lies that the light covers, and from elsewhere no pixel gets a hundredth of the light's radiance.
    assert 0 < image.mean.max() < 0.2 * max(made.lights[0].radiance)


@pytest.mark.parametrize("kind", SAMPLED)
def test_faces_with_lamps_flush_in_them_are_dark(kind):
    """Turned off the axes, so that hits lie on either side of the lamp's plane by rounding."""
    q, _ = np.linalg.qr(np.random.default_rng(11).normal(size=(3, 3)))
    corners = q @ np.array([[-2.0, 0, -2], [2, 0, -2], [2, 0, 2], [-2, 0, 2]]).T
    up = Mesh(corners, np.array([[0, 2, 1], [0, 3, 2]]).T, GREY)
    # The light shines into the face: seen from behind it is black, and so is the face where the light is not seen.
    corner, ab, ac = (tuple(q @ np.array(v)) for v in ((-1.0, 0, -1), (2.0, 0, 0), (0, 0, 2.0)))
    light = QuadLight(corner, ab, ac, (5, 5, 5))
    camera = Camera(tuple(q @ np.array([0.3, 3.0, 0.7])), (0, 0, 0), tuple(q @ np.array([0, 0, 1.0])), 60.0)
    made = scene(up, lights=(light,), camera=camera, two_sided=True)
    image = render(made, kind(samples=16, stratified=True), seed=1)
    assert image.shaded.sum() > 300
    assert not image.mean[:, image.shaded].any()
