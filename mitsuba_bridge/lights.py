"""A light as Mitsuba is to see it: the half of every kind that the renderer knows nothing of.

Each function has one implementation a kind, and raises where there is none: a kind that is new is never taken for
another.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import singledispatch
from typing import Any, NoReturn

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.lights import (
    CosineLight,
    DirectionalLight,
    DiskLight,
    Light,
    MeshLight,
    PointLight,
    QuadLight,
    SkyLight,
    SphereLight,
    SpotLight,
    SunLight,
    TriangleLight,
)
from nusselt.renderer.vectors import Floats, column, dot, frame

from .distance import Triangle
from .placement import SIZE

SUN_DISTANCE = 1e5
"""Distance of the sun's disk in scene radii: its irradiance is then off by 2e-6 in the mean (measured)."""

SHAPES = ("rectangle", "disk", "sphere", "ply")
"""Kinds of a description that are a shape which emits."""
COLOURS = ("radiance", "intensity", "irradiance")
EMITTERS = {"cosine_point": "cosine"}
"""Kinds that are not Mitsuba's own, and the modules of ``child/`` that register them."""

Matrix = list[list[float]]
Place = Callable[[Any], Floats]


def _unknown(light: Light) -> NoReturn:
    raise InputError("light", type(light).__name__, "a kind that mitsuba_bridge/lights.py knows")


def rgb(colour: tuple[float, ...]) -> list[float]:
    """A colour as plain numbers."""
    return [float(c) for c in colour]


def _columns(x: Floats, y: Floats, z: Floats, origin: Floats) -> Matrix:
    matrix = np.eye(4)
    for k, entry in enumerate((x, y, z, origin)):
        matrix[:3, k] = entry
    return matrix.tolist()


@singledispatch
def described(light: Light, place: Place, scale: float, reach: float = SIZE) -> dict[str, Any]:
    """A light's entry in a `Description`.

    Parameters
    ----------
    place : callable
        From the scene's points to Mitsuba's.
    scale : float
        Lengths there over lengths in the scene.
    reach : float
        Half extent of the scene there.
    """
    _unknown(light)


@described.register
def _(light: QuadLight, place: Place, scale: float, reach: float = SIZE) -> dict[str, Any]:
    ab, ac = (np.array(v) * scale / 2 for v in (light.ab, light.ac))
    # A rectangle faces +(x cross y): ac before ab, so that it emits on the side of -(ab x ac).
    centre = place(light.corner) + ab + ac
    to_world = _columns(ac, ab, np.array(light.normal), centre)
    return {"kind": "rectangle", "to_world": to_world, "radiance": rgb(light.radiance)}


@described.register
def _(light: PointLight, place: Place, scale: float, reach: float = SIZE) -> dict[str, Any]:
    intensity = [c * scale**2 for c in light.intensity]
    return {"kind": "point", "position": place(light.position).tolist(), "intensity": intensity}


@described.register
def _(light: SpotLight, place: Place, scale: float, reach: float = SIZE) -> dict[str, Any]:
    axis = np.array(light.direction)
    x, y = (v[:, 0] for v in frame(axis[:, None]))
    return {
        "kind": "spot",
        "to_world": _columns(x, y, axis, place(light.position)),
        "cutoff_angle": light.cutoff,
        "beam_width": light.begin,
        "intensity": [c * scale**2 for c in light.intensity],
    }


@described.register
def _(light: CosineLight, place: Place, scale: float, reach: float = SIZE) -> dict[str, Any]:
    return {
        "kind": "cosine_point",
        "position": place(light.position).tolist(),
        "normal": list(light.normal),
        "intensity": [c * scale**2 for c in light.intensity],
    }


@described.register
def _(light: SphereLight, place: Place, scale: float, reach: float = SIZE) -> dict[str, Any]:
    center, radius = place(light.center).tolist(), light.radius * scale
    return {"kind": "sphere", "center": center, "radius": radius, "radiance": rgb(light.radiance)}


@described.register
def _(light: TriangleLight, place: Place, scale: float, reach: float = SIZE) -> dict[str, Any]:
    corners = [place(corner).tolist() for corner in (light.a, light.b, light.c)]
    return {"kind": "ply", "corners": corners, "triangles": [[0], [1], [2]], "radiance": rgb(light.radiance)}


@described.register
def _(light: MeshLight, place: Place, scale: float, reach: float = SIZE) -> dict[str, Any]:
    corners = [place(corner).tolist() for corner in light.surface.vertices.T]
    return {
        "kind": "ply",
        "corners": corners,
        "triangles": light.surface.triangles.tolist(),
        "radiance": rgb(light.radiance),
    }


@described.register
def _(light: SkyLight, place: Place, scale: float, reach: float = SIZE) -> dict[str, Any]:
    return {"kind": "constant", "radiance": rgb(light.radiance)}


@described.register
def _(light: DirectionalLight, place: Place, scale: float, reach: float = SIZE) -> dict[str, Any]:
    direction = (-np.array(light.direction)).tolist()
    return {"kind": "directional", "direction": direction, "irradiance": rgb(light.irradiance)}


@described.register
def _(light: SunLight, place: Place, scale: float, reach: float = SIZE) -> dict[str, Any]:
    direction, distance = np.array(light.direction), SUN_DISTANCE * reach
    x, y = (v[:, 0] for v in frame(-direction[:, None]))
    radius = distance * math.tan(light.half_angle)
    to_world = _columns(x * radius, y * radius, -direction, direction * distance)
    return {"kind": "disk", "to_world": to_world, "radiance": rgb(light.radiance)}


@described.register
def _(light: DiskLight, place: Place, scale: float, reach: float = SIZE) -> dict[str, Any]:
    normal, radius = np.array(light.normal), light.radius * scale
    x, y = (v[:, 0] for v in frame(normal[:, None]))
    to_world = _columns(x * radius, y * radius, normal, place(light.center))
    return {"kind": "disk", "to_world": to_world, "radiance": rgb(light.radiance)}


@singledispatch
def approximations(light: Light) -> list[str]:
    """What is approximate about a light in Mitsuba, in plain sentences."""
    _unknown(light)


@approximations.register(QuadLight)
@approximations.register(DiskLight)
@approximations.register(SphereLight)
@approximations.register(SkyLight)
@approximations.register(TriangleLight)
@approximations.register(MeshLight)
@approximations.register(PointLight)
@approximations.register(SpotLight)
@approximations.register(CosineLight)
@approximations.register(DirectionalLight)
def _(light: Light) -> list[str]:
    return []


@approximations.register
def _(light: SunLight) -> list[str]:
    return [f"the sun of {light.angle:g} degrees is a far disk in Mitsuba"] if light.angle > 2 else []


@singledispatch
def strata_alike(light: Light) -> bool:
    """Whether Mitsuba lays strata out on a light as we do, so that both have the same noise."""
    _unknown(light)


@strata_alike.register(QuadLight)
@strata_alike.register(SkyLight)
@strata_alike.register(TriangleLight)
@strata_alike.register(MeshLight)
@strata_alike.register(PointLight)
@strata_alike.register(SpotLight)
@strata_alike.register(CosineLight)
@strata_alike.register(DirectionalLight)
def _(light: Light) -> bool:
    return True


@strata_alike.register(SunLight)
@strata_alike.register(DiskLight)
@strata_alike.register(SphereLight)
def _(light: Light) -> bool:
    return False  # disks to Mitsuba, which lays squares out on them concentrically; balls' frames are its own


@singledispatch
def cover(light: Light) -> tuple[Triangle, float]:
    """Triangles (3, k) each corner, and a distance from them, that hold every finite place from which it shines."""
    _unknown(light)


@cover.register(DirectionalLight)
@cover.register(SunLight)
@cover.register(SkyLight)
def _(light: Light) -> tuple[Triangle, float]:
    return (np.empty((3, 0)), np.empty((3, 0)), np.empty((3, 0))), 0.0


@cover.register(PointLight)
@cover.register(SpotLight)
@cover.register(CosineLight)
def _(light: PointLight | SpotLight | CosineLight) -> tuple[Triangle, float]:
    place = column(light.position)
    return (place, place, place), 0.0


@cover.register
def _(light: SphereLight) -> tuple[Triangle, float]:
    place = column(light.center)
    return (place, place, place), light.radius


@cover.register(QuadLight)
@cover.register(TriangleLight)
def _(light: QuadLight | TriangleLight) -> tuple[Triangle, float]:
    return light.body().corners, 0.0


@cover.register
def _(light: MeshLight) -> tuple[Triangle, float]:
    """Its triangles, or a ball about them where they are many."""
    if light.count <= PIECES:
        return light.body().corners, 0.0
    place, radius = light.middle()
    return (place, place, place), radius


@cover.register
def _(light: DiskLight) -> tuple[Triangle, float]:
    x, y = frame(column(light.normal))
    angle = 2 * math.pi * np.arange(SIDES) / SIDES
    rim = column(light.center) + light.radius / math.cos(math.pi / SIDES) * (x * np.cos(angle) + y * np.sin(angle))
    return (np.repeat(column(light.center), SIDES, axis=1), rim, np.roll(rim, -1, axis=1)), 0.0


PIECES = 4096
"""Triangles of a light that are looked at one by one."""
SIDES = 48
"""Of the polygon around a disk: 0.2 % of the radius too far out."""


@singledispatch
def rounding(light: Light, points: Floats) -> Floats:
    """By how much (n,) float32 may make a light brighter or darker at points (3, n), relative to itself."""
    _unknown(light)


@rounding.register(QuadLight)
@rounding.register(SkyLight)
@rounding.register(TriangleLight)
@rounding.register(MeshLight)
@rounding.register(DiskLight)
@rounding.register(PointLight)
@rounding.register(CosineLight)
@rounding.register(DirectionalLight)
@rounding.register(SunLight)
def _(light: Light, points: Floats) -> Floats:
    return np.zeros(points.shape[1])


SINGLE = 2.0**-24


@rounding.register
def _(light: SphereLight, points: Floats) -> Floats:
    """The density 1/(2 pi (1 - cos alpha)) is taken from cos alpha."""
    v = column(light.center) - points
    sine2 = np.minimum(light.radius**2 / np.maximum(dot(v, v), 1e-300), 1.0)
    return np.asarray(COSINE * SINGLE * (1 + np.sqrt(1 - sine2)) / np.maximum(sine2, 1e-30))


@rounding.register
def _(light: SpotLight, points: Floats) -> Floats:
    """The angle is the arc cosine of a cosine; relative to the whole intensity."""
    narrow = math.sin(math.radians(min(light.cutoff, 90.0))) * math.radians(light.cutoff - light.begin)
    return np.full(points.shape[1], min(ANGLE * SINGLE / narrow, 1.0))


COSINE, ANGLE = 1.0, 2.0
"""Roundings of a ball's cosine, its square's and the root's, counted as 3/4 (0.4 measured); of a spot's (0.7)."""
