"""Where light comes from: one kind a file, each in its own units; frozen, validated. See `protocol` to add one."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from nusselt.renderer.vectors import Floats, column

from .cosine import CosineLight
from .directional import DirectionalLight
from .disk import DiskLight
from .mesh import MeshLight
from .point import PointLight
from .protocol import Light, check_kind
from .quad import QuadLight
from .sky import SkyLight
from .sphere import SphereLight
from .spot import SpotLight
from .sun import SunLight
from .triangle import TriangleLight

LIGHTS: tuple[type[Light], ...] = (
    QuadLight,
    PointLight,
    DirectionalLight,
    SunLight,
    DiskLight,
    SpotLight,
    CosineLight,
    SphereLight,
    TriangleLight,
    MeshLight,
    SkyLight,
)
"""Every kind, once."""

for _kind in LIGHTS:
    check_kind(_kind)

__all__ = [
    "LIGHTS",
    "CosineLight",
    "DirectionalLight",
    "DiskLight",
    "Light",
    "MeshLight",
    "PointLight",
    "QuadLight",
    "SkyLight",
    "SphereLight",
    "SpotLight",
    "SunLight",
    "TriangleLight",
    "around",
    "colour",
]


def around(lights: Iterable[Light]) -> Floats | None:
    """Radiance (3, 1) that is seen where no surface is; None if that is no light's."""
    colours = [colour(light) for light in lights if light.surrounds]
    return np.sum(colours, axis=0) if colours else None


def colour(light: Light) -> Floats:
    """What the weights of a light's beams multiply, (3, 1)."""
    return column(light.colour)
