"""Shapes that every made scene is built of: sheets, boxes, lamps; and scenes scaled and moved.

The numbers of `room` are short in binary, so that moving it is exact.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from nusselt.renderer.lights import Light, QuadLight
from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.surfaces import Ellipsoid, Material, Mesh
from nusselt.renderer.validation import Vec3

GREY = Material((0.5, 0.4, 0.3))
SHINY = Material((0.375, 0.25, 0.125), (0.25, 0.25, 0.25), 20.0)
WHITE = (4.0, 4.0, 4.0)


def plate(x: tuple[float, float], z: tuple[float, float], y: float, material: Material = GREY) -> Mesh:
    """A level rectangle that faces up, or down where ``z`` falls."""
    return sheet((x[0], y, z[1]), (x[1], y, z[1]), (x[1], y, z[0]), (x[0], y, z[0]), material)


def sheet(a: Vec3, b: Vec3, c: Vec3, d: Vec3, material: Material = GREY) -> Mesh:
    """Two triangles a b c and a c d; their front is where they are counter-clockwise."""
    return Mesh(np.array([a, b, c, d], dtype=float).T, np.array([[0, 1, 2], [0, 2, 3]]).T, material)


def box(low: tuple[float, ...], high: tuple[float, ...], material: Material = GREY, inwards: bool = False) -> Mesh:
    """A closed box, its faces outwards or inwards."""
    corners = np.array([[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)], dtype=float).T
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]).T
    return Mesh(corners, triangles[::-1] if inwards else triangles, material)


def lamp(
    x: tuple[float, float], z: tuple[float, float], y: float, radiance: tuple[float, float, float] = WHITE
) -> QuadLight:
    """A level rectangle that shines down."""
    return QuadLight((x[0], y, z[0]), (0.0, 0.0, z[1] - z[0]), (x[1] - x[0], 0.0, 0.0), radiance)


def pieces(light: QuadLight, side: int) -> tuple[QuadLight, ...]:
    """The light cut into side x side."""
    corner, ab, ac = (np.array(v) for v in (light.corner, light.ab, light.ac))
    return tuple(
        QuadLight(tuple(corner + i / side * ab + j / side * ac), tuple(ab / side), tuple(ac / side), light.radiance)
        for i in range(side)
        for j in range(side)
    )


ABOVE = Camera((0.25, 3.0, 6.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 40.0)


def scene(*meshes: Mesh, lights: tuple[Light, ...] = (), camera: Camera = ABOVE, **options: Any) -> Scene:
    """A small image of these things, from above."""
    return Scene(32, 24, camera, meshes, lights=lights, **options)


def room() -> Scene:
    """A shiny room seen from inside, with a block, a ball and a lamp: coordinates are multiples of 1/16."""
    ball = Ellipsoid.sphere((0.625, 0.4375, 0.3125), 0.375, SHINY)
    return scene(
        box((-2, 0, -2), (2, 3, 2), SHINY, inwards=True),
        box((-0.8125, 0.0, -0.625), (-0.125, 0.875, 0.125)),
        lights=(lamp((-0.5, 0.5), (-0.5, 0.5), 2.875),),
        camera=Camera((0.3125, 1.375, 1.875), (0.0, 0.8125, 0.0), (0.0, 1.0, 0.0), 75.0),
        ellipsoids=(ball,),
    )


def scaled(one: Scene, factor: float) -> Scene:
    """Every length times the factor."""
    return _mapped(one, factor, np.zeros(3))


def moved(one: Scene, step: tuple[float, float, float]) -> Scene:
    """Everything a step away."""
    return _mapped(one, 1.0, np.array(step))


def _mapped(one: Scene, factor: float, step: Any) -> Scene:
    def at(p: Any) -> Any:
        return tuple((np.array(p) * factor + step).tolist())

    def sized(v: Any) -> Any:
        return tuple((np.array(v) * factor).tolist())

    camera = Camera(at(one.camera.position), at(one.camera.target), one.camera.up, one.camera.fov_y)
    meshes = tuple(Mesh(m.vertices * factor + step[:, None], m.triangles, m.material) for m in one.meshes)
    balls = tuple(Ellipsoid(at(e.center), tuple(sized(row) for row in e.axes), e.material) for e in one.ellipsoids)
    lights = tuple(QuadLight(at(v.corner), sized(v.ab), sized(v.ac), v.radiance) for v in one.quad_lights)
    return one.with_(camera=camera, meshes=meshes, ellipsoids=balls, lights=lights)
