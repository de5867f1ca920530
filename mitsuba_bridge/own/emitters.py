"""Mitsuba's emitters as our lights."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from nusselt.renderer.lights import DirectionalLight, DiskLight, Light, PointLight, QuadLight
from nusselt.renderer.validation import Vec3
from nusselt.renderer.vectors import Floats

from .nodes import Node

ROUND = 1e-6
"""Relative difference of a disk's axes at which it is one."""


def _triple(values: Floats) -> Vec3:
    x, y, z = np.asarray(values).tolist()
    return x, y, z


def _point(node: Node, matrix: Floats) -> Light:
    node.only("position", "to_world", "intensity", "sampling_weight")
    position = np.array(node.point("position", (0.0, 0.0, 0.0)))
    placed = position if "position" in node.properties else node.matrix()[:3, 3]
    return PointLight(_triple((matrix @ np.append(placed, 1))[:3]), node.colour("intensity", (1.0, 1.0, 1.0)))


def _directional(node: Node, matrix: Floats) -> Light:
    node.only("direction", "to_world", "irradiance", "sampling_weight")
    travel = node.matrix()[:3, 2] if "to_world" in node.properties else np.array(node.point("direction"))
    return DirectionalLight(_triple(-(matrix[:3, :3] @ travel)), node.colour("irradiance", (1.0, 1.0, 1.0)))


EMITTERS: dict[str, Callable[[Node, Floats], Light]] = {"point": _point, "directional": _directional}
"""Lights that are no shapes, by plugin."""


def light_of(node: Node) -> Light:
    """An emitter that is no shape."""
    if node.plugin not in EMITTERS:
        raise node.refused(node.plugin, f"{', '.join(EMITTERS)}, or area on a rectangle or disk")
    return EMITTERS[node.plugin](node, np.eye(4))


def area_light(shape: Node, emitter: Node, matrix: Floats) -> Light:
    """The light of an emitting shape, placed by a matrix (4, 4)."""
    if emitter.plugin != "area":
        raise emitter.refused(emitter.plugin, "area")
    emitter.only("radiance", "sampling_weight")
    if shape.plugin not in AREAS:
        raise shape.refused(f"{shape.plugin} with an emitter", f"a light that is a {' or '.join(AREAS)}")
    return AREAS[shape.plugin](shape, matrix, emitter.colour("radiance", (1.0, 1.0, 1.0)))


def _normal(shape: Node, matrix: Floats) -> Floats:
    """Where the z axis's plane faces: by the inverse transpose, as Mitsuba has it."""
    normal = np.linalg.inv(matrix[:3, :3]).T[:, 2]
    return np.asarray(-normal if shape.flag("flip_normals") else normal)


def _quad(shape: Node, matrix: Floats, radiance: Vec3) -> Light:
    corner = matrix @ (-1, -1, 0, 1)
    ab, ac = 2 * matrix[:3, 0], 2 * matrix[:3, 1]
    if np.cross(ab, ac) @ _normal(shape, matrix) > 0:  # ours shines along -(ab x ac)
        ab, ac = ac, ab
    return QuadLight(_triple(corner[:3]), _triple(ab), _triple(ac), radiance)


def _disk(shape: Node, matrix: Floats, radiance: Vec3) -> Light:
    x, y = matrix[:3, 0], matrix[:3, 1]
    radius = math.hypot(*x)
    if abs(math.hypot(*y) / radius - 1) > ROUND or abs(x @ y) > ROUND * radius**2:
        raise shape.refused("an ellipse with an emitter", "a disk that is round")
    return DiskLight(_triple(matrix[:3, 3]), _triple(_normal(shape, matrix)), radius, radiance)


AREAS: dict[str, Callable[[Node, Floats, Vec3], Light]] = {"rectangle": _quad, "disk": _disk}
"""Shapes that may emit, by plugin."""
