"""Small scenes that show what an estimator can get wrong."""

from __future__ import annotations

from dataclasses import replace

from nusselt.experiments.scenes.shapes import box, lamp, plate, scaled
from nusselt.renderer.lights import DirectionalLight, Light, PointLight, QuadLight, SunLight
from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.surfaces import Ellipsoid, Material, Mesh

CAMERA = Camera((0.0, 3.0, 6.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 40.0)
DULL, SHINY = Material((0.5, 0.4, 0.3)), Material((0.4, 0.3, 0.2), (0.3, 0.3, 0.3), 20.0)
LAMP = lamp((-0.5, 0.5), (-0.5, 0.5), 2.0, (5.0, 5.0, 5.0))
LOW = QuadLight((1.5, 1.0, -1.0), (0.1, 0.9, 0.2), (0.2, 0.1, 1.1), (3.0, 2.0, 1.0))
"""Sheared, and cut by the floor's horizon."""


def _floor(material: Material, half: float = 2.0) -> Mesh:
    return plate((-half, half), (-half, half), 0.0, material)


def _scene(lights: tuple[Light, ...], *meshes: Mesh, balls: tuple[Ellipsoid, ...] = ()) -> Scene:
    return Scene(16, 12, CAMERA, meshes, balls, lights)


def open_scene(glossy: bool) -> Scene:
    """A lamp over a floor, and nothing between."""
    return _scene((LAMP,), _floor(SHINY if glossy else DULL))


def shadow_scene(material: Material = SHINY) -> Scene:
    """Two parallelograms over a block and a ball."""
    ball = Ellipsoid.sphere((0.7, 0.4, 0.5), 0.4, material)
    return _scene((LAMP, LOW), _floor(material), box((-0.7, 0.3, -0.4), (0.0, 0.8, 0.3), material), balls=(ball,))


SCENES: dict[str, Scene] = {
    "open": open_scene(True),
    "shadows": shadow_scene(),
    "diffuse shadows": shadow_scene(DULL),
    "seen from behind": _scene((replace(LAMP, ab=LAMP.ac, ac=LAMP.ab), LOW), _floor(DULL)),
    "no extent": _scene(
        (PointLight((-1.5, 2, 1), (2, 2, 2)), DirectionalLight((-1, 3, -1), (0.2, 0.3, 0.4))),
        _floor(SHINY),
        box((-0.7, 0.3, -0.4), (0.0, 0.8, 0.3), SHINY),
    ),
    "sun": _scene(
        (SunLight((1, 2, 1), (0.5, 0.5, 0.5), 5.0),), _floor(SHINY), box((-0.7, 0.3, -0.4), (0.0, 0.8, 0.3), DULL)
    ),
    "tiny": scaled(shadow_scene(DULL), 1e-5),
    "huge": scaled(shadow_scene(DULL), 1e6),
}
"""By what each is about."""
