"""Small scenes that show what an estimator can get wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nusselt.renderer.lights import DirectionalLight, Light, PointLight, QuadLight, SunLight
from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.surfaces import Ellipsoid, Material, Mesh

CAMERA = Camera((0.0, 3.0, 6.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 40.0)
DULL, SHINY = Material((0.5, 0.4, 0.3)), Material((0.4, 0.3, 0.2), (0.3, 0.3, 0.3), 20.0)
LAMP = QuadLight((-0.5, 2.0, -0.5), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (5.0, 5.0, 5.0))
LOW = QuadLight((1.5, 1.0, -1.0), (0.1, 0.9, 0.2), (0.2, 0.1, 1.1), (3.0, 2.0, 1.0))
"""Sheared, and cut by the floor's horizon."""


def _floor(material: Material, half: float = 2.0) -> Mesh:
    corners = np.array([(-half, 0, half), (half, 0, half), (half, 0, -half), (-half, 0, -half)], dtype=float)
    return Mesh(corners.T, np.array([(0, 1, 2), (0, 2, 3)]).T, material)


def _box(low: tuple[float, float, float], high: tuple[float, float, float], material: Material) -> Mesh:
    corners = np.array([[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)], dtype=float)
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
    return Mesh(corners.T, np.array(triangles).T, material)


def _scene(lights: tuple[Light, ...], *meshes: Mesh, balls: tuple[Ellipsoid, ...] = ()) -> Scene:
    return Scene(16, 12, CAMERA, meshes, balls, lights)


def open_scene(glossy: bool) -> Scene:
    """A lamp over a floor, and nothing between."""
    return _scene((LAMP,), _floor(SHINY if glossy else DULL))


def shadow_scene(material: Material = SHINY) -> Scene:
    """Two parallelograms over a block and a ball."""
    ball = Ellipsoid.sphere((0.7, 0.4, 0.5), 0.4, material)
    return _scene((LAMP, LOW), _floor(material), _box((-0.7, 0.3, -0.4), (0.0, 0.8, 0.3), material), balls=(ball,))


def scaled(scene: Scene, factor: float) -> Scene:
    """The same image at another size of the world."""

    def times(v: tuple[float, ...]) -> tuple[float, float, float]:
        return tuple(factor * c for c in v)  # type: ignore[return-value]

    lights = tuple(
        replace(light, corner=times(light.corner), ab=times(light.ab), ac=times(light.ac))
        for light in scene.quad_lights
    )
    camera = replace(scene.camera, position=times(scene.camera.position), target=times(scene.camera.target))
    meshes = tuple(replace(mesh, vertices=mesh.vertices * factor) for mesh in scene.meshes)
    balls = tuple(
        replace(ball, center=times(ball.center), axes=(times(ball.axes[0]), times(ball.axes[1]), times(ball.axes[2])))
        for ball in scene.ellipsoids
    )
    return scene.with_(lights=lights, camera=camera, meshes=meshes, ellipsoids=balls)


SCENES: dict[str, Scene] = {
    "open": open_scene(True),
    "shadows": shadow_scene(),
    "diffuse shadows": shadow_scene(DULL),
    "seen from behind": _scene((replace(LAMP, ab=LAMP.ac, ac=LAMP.ab), LOW), _floor(DULL)),
    "no extent": _scene(
        (PointLight((-1.5, 2, 1), (2, 2, 2)), DirectionalLight((-1, 3, -1), (0.2, 0.3, 0.4))),
        _floor(SHINY),
        _box((-0.7, 0.3, -0.4), (0.0, 0.8, 0.3), SHINY),
    ),
    "sun": _scene(
        (SunLight((1, 2, 1), (0.5, 0.5, 0.5), 5.0),), _floor(SHINY), _box((-0.7, 0.3, -0.4), (0.0, 0.8, 0.3), DULL)
    ),
    "tiny": scaled(shadow_scene(DULL), 1e-5),
    "huge": scaled(shadow_scene(DULL), 1e6),
}
"""By what each is about."""
