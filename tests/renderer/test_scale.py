"""Whole images of a scene, scaled and moved: the same image."""

from __future__ import annotations

import numpy as np
import pytest
from builders import box, lamp, scene

from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render
from nusselt.renderer.lights import QuadLight
from nusselt.renderer.scene import Camera
from nusselt.renderer.surfaces import Ellipsoid, Material, Mesh


def world(scale: float, offset: float):
    """A glossy corner with a box, a ball and a lamp; the camera looks from the side."""
    shift = np.array([offset, -offset / 2, offset / 4])

    def at(p):
        return tuple((np.array(p) * scale + shift).tolist())

    def sized(v):
        return tuple((np.array(v) * scale).tolist())

    shiny = Material((0.4, 0.3, 0.2), (0.3, 0.3, 0.3), 20.0)
    room = box((-2, 0, -2), (2, 3, 2), shiny)
    inside_out = Mesh(room.vertices * scale + shift[:, None], room.triangles[[0, 2, 1]], shiny)
    block = box((-0.8, 0, -0.6), (-0.1, 0.9, 0.1))
    block = Mesh(block.vertices * scale + shift[:, None], block.triangles, block.material)
    light = lamp(2.9, 0.5)
    moved = QuadLight(at(light.corner), sized(light.ab), sized(light.ac), light.radiance)
    ball = Ellipsoid.sphere(at((0.6, 0.4, 0.3)), 0.4 * scale, shiny)
    camera = Camera(at((0.3, 1.4, 1.9)), at((0.0, 0.8, 0.0)), (0, 1, 0), 75.0)
    return scene(inside_out, block, ellipsoids=(ball,), lights=(moved,), camera=camera, size=(48, 36))


@pytest.mark.parametrize(
    ("scale", "offset", "same"),
    [(1e-30, 0, 1), (1e-6, 0, 1), (1e9, 0, 1), (1e30, 0, 1), (1, 1e3, 0.999), (1, 1e6, 0.999), (1e3, 1e9, 0.995)],
)
def test_scaling_and_moving_a_scene_changes_no_pixel_beyond_its_rounded_input(scale, offset, same):
    """Scaling by a number keeps every pixel; moving rounds the vertices, so that a few edges may flip."""
    plain = render(world(1, 0), Area(samples=9, stratified=True), seed=4)
    other = render(world(scale, offset), Area(samples=9, stratified=True), seed=4)
    close = np.isclose(plain.mean, other.mean, rtol=1e-9 if offset == 0 else 1e-4, atol=0).all(axis=0)
    assert close.mean() >= same
    assert plain.mean.min(axis=0).astype(bool).mean() > 0.8
