"""UsdLux lights as ours: radiance = intensity 2^exposure color, divided by the light's size where it says `normalize`.

Sizes are in the stage's own unit, as lengths are: an area in the world, and for a distant light pi sin^2 of its half
angle, so that it then says irradiance.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from nusselt.renderer.lights import DirectionalLight, Light, PointLight, SkyLight, SunLight
from nusselt.renderer.lights.of_triangles import of_triangles
from nusselt.renderer.placed import Faces, ball_light, disk_light, rectangle_light
from nusselt.renderer.validation import Vec3, triple
from nusselt.renderer.vectors import Floats

from .library import UsdLux
from .prims import Notes, Prim

OLD = (
    *("intensity", "exposure", "color", "normalize", "diffuse", "enableColorTemperature"),
    *("width", "height", "radius", "angle"),
)
"""Names of a light's inputs before USD 21.02, which say nothing now."""
WHITE = 6500.0
"""Kelvin of a light that has a colour temperature and does not say which."""
STOPS = 500
"""Most of an exposure: beyond, radiance leaves double precision."""
WHOLE = 90.0
"""Half angle of a cone that cuts nothing off a light that shines to one side."""


def _emitted(prim: Prim) -> Vec3:
    exposure = prim.number("inputs:exposure", 0.0)
    if abs(exposure) > STOPS:
        raise prim.refused(f"inputs:exposure {exposure:g}", f"-{STOPS} to {STOPS}")
    scale = prim.number("inputs:intensity", 1.0) * 2.0**exposure
    colour = np.array(prim.colour("inputs:color", (1.0, 1.0, 1.0)))
    if prim.get("inputs:enableColorTemperature", False):  # Blender 5 says so of every lamp
        colour = colour * np.array(UsdLux.BlackbodyTemperatureAsRgb(prim.number("inputs:colorTemperature", WHITE)))
    return triple(scale * colour)


def _normalised(prim: Prim, light: Light, notes: Notes) -> Light:
    if not prim.get("inputs:normalize", False):
        return light
    notes.say(prim, "normalize: areas are in the stage's own unit")
    r, g, b = light.colour
    return light.with_colour((r / light.area, g / light.area, b / light.area))


def _refuse_rest(prim: Prim) -> None:
    """What would change the light and is not read."""
    for name in OLD:
        if prim.authored(name):
            raise prim.refused(name, f"inputs:{name}, as USD has it since 21.02")
    if prim.number("inputs:diffuse", 1.0) != 1:
        raise prim.refused(f"inputs:diffuse {prim.number('inputs:diffuse', 1.0):g}", "1: a light gives what is seen")
    if not prim.get("inputs:shadow:enable", True) or tuple(prim.get("inputs:shadow:color", (0, 0, 0))) != (0, 0, 0):
        raise prim.refused("shadows that are not those of its light", "shadow:enable true, shadow:color 0 0 0")
    for relation in ("light:filters", "collection:lightLink:excludes", "collection:shadowLink:excludes"):
        found = prim.usd.GetRelationship(relation)
        if found and found.GetTargets():
            raise prim.refused(relation, "a light that lights everything")
    for link in ("lightLink", "shadowLink"):
        if prim.get(f"collection:{link}:includeRoot", True) is False:
            raise prim.refused(f"collection:{link}", "a light that lights everything")


def _refuse_shaping(prim: Prim, round_: bool) -> None:
    if prim.usd.HasAPI(UsdLux.ShapingAPI):
        angle = prim.number("inputs:shaping:cone:angle", WHOLE)
        if angle < (180.0 if round_ else WHOLE):
            raise prim.refused(f"shaping:cone:angle {angle:g}", "no cone: its edge is no spotLight's")
        if prim.number("inputs:shaping:focus", 0.0) != 0:
            raise prim.refused("shaping:focus", "0")
        if str(prim.get("inputs:shaping:ies:file", "")).strip("@"):
            raise prim.refused("shaping:ies:file", "a light without a profile")


def _textured(prim: Prim) -> None:
    if str(prim.get("inputs:texture:file", "") or "").strip("@"):
        raise prim.refused("texture:file", "one colour")


def _rectangle(prim: Prim, matrix: Floats) -> Light:
    _textured(prim)
    x, y = prim.number("inputs:width", 1.0) / 2, prim.number("inputs:height", 1.0) / 2
    return rectangle_light(matrix, (-x, -y), (x, y), _emitted(prim))


def _disk(prim: Prim, matrix: Floats) -> Light:
    return disk_light(matrix, prim.number("inputs:radius", 0.5), (0.0, 0.0, -1.0), _emitted(prim))


def _sphere(prim: Prim, matrix: Floats) -> Light:
    return ball_light(matrix, prim.number("inputs:radius", 0.5), _emitted(prim))


def _point(prim: Prim, matrix: Floats) -> Light:
    """A sphere so small that its radius plays no part: its radiance over the disk that it shows."""
    square = prim.number("inputs:radius", 0.5) ** 2 * abs(float(np.linalg.det(matrix[:3, :3]))) ** (2 / 3)
    shown = 0.25 if prim.get("inputs:normalize", False) else math.pi * square
    r, g, b = _emitted(prim)
    return PointLight(triple(matrix[:3, 3]), (shown * r, shown * g, shown * b))


def _distant(prim: Prim, matrix: Floats) -> Light:
    angle, towards = prim.number("inputs:angle", 0.53), triple(matrix[:3, 2])
    sine2 = math.sin(math.radians(angle) / 2) ** 2
    size = 1.0 if prim.get("inputs:normalize", False) or angle == 0 else math.pi * sine2
    r, g, b = _emitted(prim)
    irradiance = size * r, size * g, size * b
    return SunLight(towards, irradiance, angle) if angle > 0 else DirectionalLight(towards, irradiance)


def _dome(prim: Prim, matrix: Floats) -> Light:
    _textured(prim)
    return SkyLight(_emitted(prim))


AREAS: dict[str, Callable[[Prim, Floats], Light]] = {
    "RectLight": _rectangle,
    "DiskLight": _disk,
    "SphereLight": _sphere,
}
OTHERS: dict[str, Callable[[Prim, Floats], Light]] = {"DistantLight": _distant, "DomeLight": _dome}


def light_of(prim: Prim, notes: Notes) -> Light:
    """A prim that is a light of a kind of its own."""
    if prim.kind not in (*AREAS, *OTHERS):
        raise prim.refused(prim.kind, f"{', '.join((*AREAS, *OTHERS))}, or MeshLightAPI on a Mesh")
    _refuse_rest(prim)
    _refuse_shaping(prim, prim.kind == "SphereLight")
    if prim.kind == "SphereLight" and prim.get("treatAsPoint", False):
        return _point(prim, prim.matrix())
    if prim.kind in OTHERS:
        return OTHERS[prim.kind](prim, prim.matrix())
    return _normalised(prim, AREAS[prim.kind](prim, prim.matrix()), notes)


def mesh_light(prim: Prim, vertices: Floats, faces: Faces, notes: Notes) -> Light:
    """A mesh that shines, placed in the world."""
    mode = str(prim.get("light:materialSyncMode", "materialGlowTintsLight"))
    if mode == "materialGlowTintsLight":
        raise prim.refused(mode, "light:materialSyncMode noMaterialResponse or independent")
    if mode == "independent":
        notes.say(prim, "what a mesh that shines reflects is left out")
    _refuse_rest(prim)
    return _normalised(prim, of_triangles(vertices, faces, _emitted(prim)), notes)
