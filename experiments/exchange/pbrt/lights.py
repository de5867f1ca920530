"""pbrt's lights as ours. An rgb value of a light is a multiple of white of 1: pbrt divides by the white's luminance."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from nusselt.renderer.lights import DirectionalLight, Light, PointLight, SkyLight
from nusselt.renderer.placed import moved
from nusselt.renderer.validation import Vec3, triple
from nusselt.renderer.vectors import Floats

from .tokens import Directive


def _times(directive: Directive, name: str, factor: float = 1.0) -> Vec3:
    scale = directive.number("scale", 1.0) * factor
    r, g, b = directive.colour(name, 1.0)
    return scale * r, scale * g, scale * b


def _point(directive: Directive, matrix: Floats) -> Light:
    directive.only("I", "scale", "power", "from")
    power = directive.number("power", -1.0)
    placed = moved(matrix, directive.point("from", (0.0, 0.0, 0.0))[:, None])[:, 0]
    return PointLight(triple(placed), _times(directive, "I", power / (4 * math.pi) if power > 0 else 1.0))


def _distant(directive: Directive, matrix: Floats) -> Light:
    directive.only("L", "scale", "from", "to")
    towards = directive.point("from", (0.0, 0.0, 0.0)) - directive.point("to", (0.0, 0.0, 1.0))
    return DirectionalLight(triple(matrix[:3, :3] @ towards), _times(directive, "L"))


def _infinite(directive: Directive, matrix: Floats) -> Light:
    directive.only("L", "scale", "illuminance")
    illuminance = directive.number("illuminance", -1.0)
    return SkyLight(_times(directive, "L", illuminance / math.pi if illuminance > 0 else 1.0))


LIGHTS: dict[str, Callable[[Directive, Floats], Light]] = {"point": _point, "distant": _distant, "infinite": _infinite}


def light_of(directive: Directive, matrix: Floats) -> Light:
    """A LightSource, its transform to our world given."""
    if directive.kind == "spot":
        raise directive.refused("spot", "another light: its edge is a smooth step of the cosine, and no spotLight's")
    if directive.kind not in LIGHTS:
        raise directive.refused(directive.kind, ", ".join(LIGHTS))
    if np.linalg.matrix_rank(matrix) < 4:
        raise directive.refused("a transform that flattens", "one that does not")
    return LIGHTS[directive.kind](directive, matrix)


def area_radiance(directive: Directive, area: float, lights: int) -> Vec3:
    """Radiance of an AreaLightSource on a shape of that area, world units.

    ``power`` is that of each of the lights that it is to pbrt.
    """
    if directive.kind != "diffuse":
        raise directive.refused(directive.kind, "diffuse")
    directive.only("L", "scale", "power", "twosided")
    if directive.flag("twosided"):
        raise directive.refused("twosided true", "a light that shines to one side", "twosided")
    power = directive.number("power", -1.0)
    if power > 0 and lights > 1:
        raise directive.refused("power on several triangles or patches", "L and scale, or one of them", "power")
    return _times(directive, "L", power / (math.pi * area) if power > 0 else 1.0)
