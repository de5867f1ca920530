"""A scene as plain arrays that any renderer's adapter understands.

The scene is moved to the origin and scaled by a power of two to about one, so that the absolute epsilons of other
renderers (1e-6 to 1e-3) mean the same in every scene. Radiance does not change by that. An adapter scales it once more
where its renderer's epsilons ask for it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from nusselt.renderer.camera.rays import view_frame
from nusselt.renderer.errors import InputError
from nusselt.renderer.lights import QuadLight
from nusselt.renderer.scene import Scene
from nusselt.renderer.surfaces import Ellipsoid, Material
from nusselt.renderer.vectors import Floats, unit

HALF = 1.0
"""Half extent of a described scene, at least; less than twice as much at most."""


def describe(scene: Scene) -> dict[str, Floats]:
    """Arrays by name.

    Returns
    -------
    dict
        ``size`` (2,) width and height; ``fov`` vertical, degrees; ``position``, ``look``, ``right``, ``up`` (3,) of
        the camera, the last three unit; ``corners`` (t, 3, 3) of the triangles and ``thing`` (t,) their mesh's number;
        ``albedo`` (m, 3) of the meshes, and of their Phong lobes (see `Material`) ``specular`` (m, 3) and
        ``shininess`` (m,); ``spheres`` (s, 4) centre and radius, ``sphere_albedo`` and so on; ``lights`` (l, 3, 3)
        corner, ab and ac, shining to the side -(ab x ac), black behind; ``radiance`` (l, 3).

    Raises
    ------
    InputError
        If the scene has what is no plain surface of diffuse and Phong's parts, or no parallelogram light.
    """
    axes = (unit(axis)[:, 0] for axis in view_frame(scene))
    corners = [np.stack(mesh.corners).transpose(2, 0, 1) for mesh in scene.meshes]
    lights = np.array([_light(light) for light in scene.lights]).reshape(-1, 3, 3)
    spheres = np.array([_sphere(ball) for ball in scene.ellipsoids]).reshape(-1, 4)
    found = {
        "size": np.array([scene.width, scene.height]),
        "fov": np.array(scene.camera.fov_y),
        "position": np.array(scene.camera.position),
        **dict(zip(("look", "right", "up"), axes, strict=True)),
        "corners": np.concatenate([np.zeros((0, 3, 3)), *corners]),
        "thing": np.repeat(np.arange(len(corners)), [len(triangles) for triangles in corners]),
        **_surfaces("", [mesh.material for mesh in scene.meshes]),
        "spheres": spheres,
        **_surfaces("sphere_", [ball.material for ball in scene.ellipsoids]),
        "lights": lights,
        "radiance": np.array([light.colour for light in scene.lights]).reshape(-1, 3),
    }
    return _placed(found)


def write_description(path: Path, scene: Scene) -> None:
    """The arrays of `describe` in an NPZ file."""
    arrays: dict[str, Any] = describe(scene)
    np.savez(path, **arrays)


def _surfaces(prefix: str, materials: Sequence[Material]) -> dict[str, Floats]:
    for material in materials:
        if material.further or max(material.emission) > 0 or material.texture is not None:
            raise InputError(
                "material", material, "a diffuse or Phong's surface of one colour, without emission, as peers have them"
            )
    return {
        f"{prefix}albedo": np.array([material.diffuse for material in materials]).reshape(-1, 3),
        f"{prefix}specular": np.array([material.specular for material in materials]).reshape(-1, 3),
        f"{prefix}shininess": np.array([material.shininess for material in materials]),
    }


def _light(light: object) -> tuple[tuple[float, ...], ...]:
    if not isinstance(light, QuadLight):
        raise InputError("light", type(light).__name__, "a quadLight, which every peer has")
    return light.corner, light.ab, light.ac


def _sphere(ball: Ellipsoid) -> tuple[float, ...]:
    if ball.radius is None:
        raise InputError("sphere axes", ball.axes, "a sphere, which every peer has")
    return *ball.center, ball.radius


def _placed(found: dict[str, Floats]) -> dict[str, Floats]:
    """Moved by the middle of what there is, and scaled."""
    balls, lights = found["spheres"], found["lights"]
    outlines = np.concatenate([lights[:, 0] + i * lights[:, 1] + j * lights[:, 2] for i in (0, 1) for j in (0, 1)])
    places = [found["corners"].reshape(-1, 3), outlines, found["position"][None]]
    places += [balls[:, :3] + sign * balls[:, 3:] for sign in (-1, 1)]
    every = np.concatenate(places)
    low, high = every.min(axis=0), every.max(axis=0)
    centre, half = (low + high) / 2, float((high - low).max()) / 2
    scale = 2.0 ** math.ceil(math.log2(HALF / half)) if half > 0 else 1.0
    moved = lights - centre * np.array([1.0, 0.0, 0.0])[:, None]  # edges have no place
    return found | {
        "position": scale * (found["position"] - centre),
        "corners": scale * (found["corners"] - centre),
        "spheres": scale * (balls - np.append(centre, 0.0)),
        "lights": scale * moved,
    }
