"""Scenes in other colours."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from nusselt.renderer.scene import Scene
from nusselt.renderer.surfaces import Material, Mesh
from nusselt.renderer.validation import Vec3
from nusselt.renderer.vectors import Floats

Recolour = Callable[[Floats], Floats]
"""Of r, g and b, (3,)."""


def recoloured(
    scene: Scene, lights: Recolour = lambda rgb: rgb, emission: Recolour = lambda rgb: rgb, **reflected: Recolour
) -> Scene:
    """The scene with other colours of its lights, of what glows, and of parameters of lobes, by their names."""

    def changed(change: Recolour, rgb: Vec3) -> Vec3:
        r, g, b = change(np.array(rgb)).tolist()
        return r, g, b

    def painted(material: Material) -> Material:
        new = {name: changed(change, getattr(material, name)) for name, change in reflected.items()}
        return replace(material, emission=changed(emission, material.emission), **new)  # type: ignore[arg-type]

    return scene.with_(
        lights=tuple(light.with_colour(changed(lights, light.colour)) for light in scene.lights),
        meshes=tuple(Mesh(mesh.vertices, mesh.triangles, painted(mesh.material)) for mesh in scene.meshes),
        ellipsoids=tuple(replace(one, material=painted(one.material)) for one in scene.ellipsoids),
    )
