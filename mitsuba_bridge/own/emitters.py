"""Mitsuba's emitters as our lights."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from nusselt.renderer.lights import (
    DirectionalLight,
    Light,
    MeshLight,
    PointLight,
    SkyLight,
    SphereLight,
    SpotLight,
)
from nusselt.renderer.lights.of_triangles import of_triangles
from nusselt.renderer.placed import ROUND, disk_light, disk_scale, rectangle_light
from nusselt.renderer.surfaces import Material
from nusselt.renderer.validation import Vec3, triple
from nusselt.renderer.vectors import Floats

from .nodes import Node
from .shapes import CUBE, FILES, mesh_of, round_axes, triangles_of


def _point(node: Node) -> Light:
    node.only("position", "to_world", "intensity", "sampling_weight")
    position = np.array(node.point("position", (0.0, 0.0, 0.0)))
    placed = position if "position" in node.properties else node.matrix()[:3, 3]
    return PointLight(triple(placed), node.colour("intensity", (1.0, 1.0, 1.0), emits=True))


def _directional(node: Node) -> Light:
    node.only("direction", "to_world", "irradiance", "sampling_weight")
    travel = node.matrix()[:3, 2] if "to_world" in node.properties else np.array(node.point("direction"))
    if "to_world" in node.properties and abs(math.hypot(*travel) - 1) > ROUND:
        raise node.refused("a to_world that scales", "one that turns alone: Mitsuba takes the light by its square")
    return DirectionalLight(triple(-travel), node.colour("irradiance", (1.0, 1.0, 1.0), emits=True))


def _spot(node: Node) -> Light:
    """Its cone is about the z axis; the full intensity ends at three quarters of the cutoff unless said."""
    node.only("to_world", "intensity", "cutoff_angle", "beam_width", "sampling_weight")
    node.plain("texture")
    placed, cutoff = node.matrix(), node.number("cutoff_angle", 20.0)
    begin, intensity = node.number("beam_width", 0.75 * cutoff), node.colour("intensity", (1.0, 1.0, 1.0), emits=True)
    return SpotLight(triple(placed[:3, 3]), triple(placed[:3, 2]), cutoff, begin, intensity)


def _constant(node: Node) -> Light:
    node.only("radiance", "scale", "to_world", "sampling_weight")
    scale = node.number("scale", 1.0)
    r, g, b = node.colour("radiance", (1.0, 1.0, 1.0), emits=True)
    return SkyLight((scale * r, scale * g, scale * b))


EMITTERS: dict[str, Callable[[Node], Light]] = {
    "point": _point,
    "directional": _directional,
    "spot": _spot,
    "constant": _constant,
}
"""Lights that are no shapes, by plugin."""


def _refuse_unsampled(node: Node) -> None:
    if node.number("sampling_weight", 1.0) == 0:
        raise node.refused("sampling_weight 0", "a weight above 0: such a light is never sampled")


def light_of(node: Node) -> Light:
    """An emitter that is no shape."""
    _refuse_unsampled(node)
    if node.plugin not in EMITTERS:
        raise node.refused(node.plugin, f"{', '.join(EMITTERS)}, or area on a shape")
    return EMITTERS[node.plugin](node)


def area_light(shape: Node, emitter: Node, matrix: Floats) -> Light:
    """The light of an emitting shape, placed by a matrix (4, 4)."""
    if emitter.plugin != "area":
        raise emitter.refused(emitter.plugin, "area")
    emitter.only("radiance", "sampling_weight")
    _refuse_unsampled(emitter)
    shape.holds("BSDF", "Emitter")
    if shape.plugin not in AREAS:
        raise shape.refused(f"{shape.plugin} with an emitter", f"a light that is a {' or '.join(AREAS)}")
    return AREAS[shape.plugin](shape, matrix, emitter.colour("radiance", (1.0, 1.0, 1.0), emits=True))


def _side(shape: Node) -> float:
    """Of the xy plane, along z, that shines; a transform moves it by its inverse transpose, as Mitsuba has it."""
    return -1.0 if shape.flag("flip_normals") else 1.0


def _quad(shape: Node, matrix: Floats, radiance: Vec3) -> Light:
    return rectangle_light(matrix, (-1.0, -1.0), (1.0, 1.0), radiance, _side(shape))


def _disk(shape: Node, matrix: Floats, radiance: Vec3) -> Light:
    if disk_scale(matrix) is None:
        raise shape.refused("an ellipse with an emitter", "a disk that is round")
    return disk_light(matrix, 1.0, (0.0, 0.0, _side(shape)), radiance)


def _sphere(shape: Node, matrix: Floats, radiance: Vec3) -> Light:
    if shape.flag("flip_normals"):
        raise shape.refused("flip_normals", "a ball that shines outwards")
    centre = matrix @ np.append(shape.point("center", (0.0, 0.0, 0.0)), 1.0)
    return SphereLight(triple(centre[:3]), round_axes(shape, matrix), radiance)


def _mesh(shape: Node, matrix: Floats, radiance: Vec3) -> Light:
    """One triangle, two that are a parallelogram, or more: Mitsuba has loaded them, placed by their own transform."""
    vertices, faces = triangles_of(shape)
    turned = faces[::-1] if shape.flag("flip_normals") else faces
    return of_triangles(vertices, turned.astype(np.int64), radiance)


def _cube(shape: Node, matrix: Floats, radiance: Vec3) -> Light:
    return MeshLight(mesh_of(*CUBE, matrix, shape, Material()), radiance)


AREAS: dict[str, Callable[[Node, Floats, Vec3], Light]] = {
    "rectangle": _quad,
    "disk": _disk,
    "sphere": _sphere,
    "cube": _cube,
    **dict.fromkeys(FILES, _mesh),
}
"""Shapes that may emit, by plugin."""
