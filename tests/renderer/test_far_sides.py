"""Triangles that closed bodies hide by themselves: all that turn away from who is outside, and none that is seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import GREY, box, floor, quad, scene, sphere_mesh

from nusselt.experiments.studies.race.scenes import bumpy_ball
from nusselt.renderer.pixels.far_sides import far_sides
from nusselt.renderer.pixels.shade import regions_of
from nusselt.renderer.scene import Camera
from nusselt.renderer.surfaces import Mesh

CAMERA = Camera((0.4, 1.7, 3.0), (0.0, 0.6, 0.0), (0.0, 1.0, 0.0), 60.0)
WITHIN = Camera((0.0, 0.9, 0.1), (0.4, 0.8, -1.0), (0.0, 1.0, 0.0), 100.0)
LATTICE = np.array(np.meshgrid(np.arange(64) + 0.47, np.arange(48) + 0.53)).reshape(2, -1)
BODY = bumpy_ball(8)


def turned(mesh):
    """Inside out."""
    return Mesh(mesh.vertices, mesh.triangles[::-1], mesh.material)


def moved(mesh, x, y, z):
    return Mesh(mesh.vertices + np.array([[x], [y], [z]]), mesh.triangles, mesh.material)


def without(mesh, triangle):
    return Mesh(mesh.vertices, np.delete(mesh.triangles, triangle, axis=1), mesh.material)


def one_turned(mesh, triangle):
    triangles = mesh.triangles.copy()
    triangles[:, triangle] = triangles[::-1, triangle]
    return Mesh(mesh.vertices, triangles, mesh.material)


def pulled(mesh, vertex, to):
    vertices = mesh.vertices.copy()
    vertices[:, vertex] = to
    return Mesh(vertices, mesh.triangles, mesh.material)


BALL = moved(sphere_mesh(6, 0.3), -0.5, 1.3, 0.9)
SPLIT = Mesh(
    np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0.9, 0.8, 0.7)]).T,
    np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 4), (2, 3, 4), (3, 1, 4)]).T,
    GREY,
)
HIDING = {
    "one body": scene(BODY),
    "inside out": scene(turned(BODY)),
    "with a floor and a wall": scene(floor(), BODY, quad((-1, 0, 1), (-0.2, 0, 1), (-0.2, 1, 1), (-1, 1, 1))),
    "two": scene(BODY, BALL),
    "through each other": scene(BODY, moved(BALL, 0.3, -0.2, -0.4)),
    "one on the other": scene(box((-0.5, 0.2, -0.5), (0.6, 0.9, 0.4)), box((-0.4, 0.9, -0.4), (0.2, 1.1, 0.3))),
    "from within": scene(BODY, moved(sphere_mesh(6, 0.1), 0.1, 0.85, -0.3)),
    "from within, inside out": scene(turned(BODY)),
    "a box": scene(box((-0.5, 0.2, -0.5), (0.6, 0.9, 0.4))),
    "not convex": scene(SPLIT),
}
OPEN = {
    "a hole": scene(without(BODY, 40)),
    "one triangle turned": scene(one_turned(BODY, 40)),
    "a flat sheet": scene(floor()),
    "through itself": scene(pulled(BODY, -2, (0.1, -2.0, 0.1))),
}


def regions_in(made, camera=CAMERA):
    made = made.with_(width=64, height=48, camera=camera)
    return regions_of(made, made.digest())[-1]


def far_in(regions):
    return far_sides(regions.geometry, regions.faces, regions.lens.origin, regions.pencil.planes)


def seen(regions):
    _, triangle = regions.pencil.nearest(regions.lens.directions(*LATTICE), np.flatnonzero(regions.pencil.live))
    return np.unique(triangle[triangle >= 0])


@pytest.mark.parametrize("name", HIDING)
def test_what_is_far_is_not_seen_and_turns_away(name):
    regions = regions_in(HIDING[name], WITHIN if "within" in name else CAMERA)
    far, back = far_in(regions), regions.pencil.planes.back
    shown = seen(regions)
    assert not far[shown].any()
    if "within" not in name:
        closed = regions.geometry.triangle_surface == (1 if "floor" in name else 0)
        away = ~back if "inside out" in name else back
        np.testing.assert_array_equal(far, away & (closed | (len(HIDING[name].meshes) == 2)))
    planes = replace(regions.pencil.planes, back=~back)
    assert far_sides(regions.geometry, regions.faces, regions.lens.origin, planes)[shown].any()


@pytest.mark.parametrize("name", OPEN)
def test_what_is_open_or_meets_itself_hides_nothing_for_certain(name):
    assert not far_in(regions_in(OPEN[name])).any()


@pytest.mark.parametrize("at", [(0.5, 0.8, 0.0), (0.5, 1.0, 1.0), (0.2, 1.0, 0.3), (1.0, 1.0, 1.0)])
def test_an_eye_on_a_body_is_on_neither_side(at):
    """In the middle of its faces, on an edge, at a corner."""
    ball = moved(sphere_mesh(6, 0.1), 0.5, 0.5, 0.5)
    eye = Camera(at, (0.5, 0.5, 0.5), (0.0, 0.3, 1.0), 60.0)
    regions = regions_in(scene(box((0, 0, 0), (1, 1, 1)), ball), eye)
    far = far_in(regions)
    assert not far[seen(regions)].any()
    assert not far[regions.geometry.triangle_surface == 0].any() or at[1] < 1
    assert far[regions.geometry.triangle_surface == 1].any()
