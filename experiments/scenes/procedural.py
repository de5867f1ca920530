"""Scenes whose meshes are made on the fly, by name: a text for everything else, and a formula for the mesh."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

from nusselt.renderer.scene import Scene
from nusselt.renderer.scene_text import parse_scene
from nusselt.renderer.surfaces import Material, Mesh
from nusselt.renderer.vectors import Floats, column

from .meshes import Surface, displaced_sphere, torus_knot


@dataclass(frozen=True)
class Generated:
    """A scene and its one mesh.

    Parameters
    ----------
    summary : str
        One line.
    text : str
        The scene without the mesh, in the scene text format.
    shape : callable
        The mesh of about so many triangles.
    place, size : tuple, float
        Where its origin goes, and what it is multiplied by first.
    material : Material
    """

    summary: str
    text: str
    shape: Callable[[int], Surface]
    place: tuple[float, float, float]
    size: float
    material: Material

    def scene(self, name: str, triangles: int = 100_000) -> Scene:
        """The scene, with a mesh of about so many triangles."""
        bare = parse_scene(self.text, name=name, where=name)
        vertices, corners = self.shape(triangles)
        placed: Floats = vertices * self.size + column(self.place)
        return bare.with_(meshes=(*bare.meshes, Mesh(placed, corners, self.material)))


_SQUARE = """
vertex -{0} -{0} 0
vertex  {0} -{0} 0
vertex  {0}  {0} 0
vertex -{0}  {0} 0
tri 0 1 2
tri 0 2 3
"""

_MESH = (
    """
size 256 256
output mesh.png
camera 0 -3 3  0 0 .5  0 0 1  40
integrator direct
lightsamples 25
lightstratify on
quadLight -.5 -.5 2  1 0 0  0 1 0  10 10 10
diffuse .7 .7 .7
"""
    + _SQUARE
)

_COURSE = (
    """
size 640 480
output mesh-course.png
camera 0 -5 3  0 0 1  0 0 1  40
integrator direct
lightsamples 25
lightstratify on
quadLight -7 -5 8  5 0 0  0 10 0  1.5 1.35 1.1
quadLight 9 -5 3  0 10 0  -3 0 4  1 1.25 1.6
diffuse .5 .5 .5
specular .2 .2 .2
shininess 20
"""
    + _SQUARE
)

GENERATED = {
    "mesh": Generated(
        "100,000 triangles over a floor: a bumpy sphere that shadows it and itself",
        _MESH.format(1.5),
        displaced_sphere,
        (0.0, 0.0, 0.9),
        0.4,
        Material((0.7, 0.5, 0.3)),
    ),
    "mesh-course": Generated(
        "The course's mesh scene in shape: a glossy torus knot of 100,000 triangles on wide ground, two big lights",
        _COURSE.format(1000),
        torus_knot,
        (0.0, 0.0, 1.0),
        1.4,
        Material((0.4, 0.3, 0.2), (0.3, 0.3, 0.3), 20.0),
    ),
}


@functools.lru_cache(maxsize=4)
def generated(name: str, triangles: int = 100_000) -> Scene:
    """A scene of this module by name."""
    return GENERATED[name].scene(name, triangles)
