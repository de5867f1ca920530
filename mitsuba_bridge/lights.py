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
from numpy.typing import NDArray

from nusselt.renderer.errors import InputError
from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.lights import DirectionalLight, DiskLight, Light, PointLight, QuadLight, SunLight
from nusselt.renderer.vectors import Floats, column, dot, frame

from .distance import distance_to_triangles

SIZE = 50.0
"""Half extent of the scene as Mitsuba sees it; its valid range is about 10 to 1000."""
SUN_DISTANCE = 1e5
"""Distance of the sun's disk in scene radii: its irradiance is then off by 2e-6 in the mean (measured)."""
GRID = 3
"""Points a side at which a parallelogram is compared with the triangles; their corners are compared with all of it."""

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
def described(light: Light, place: Place, scale: float) -> dict[str, Any]:
    """A light's entry in a `Description`.

    Parameters
    ----------
    place : callable
        From the scene's points to Mitsuba's.
    scale : float
        Lengths there over lengths in the scene.
    """
    _unknown(light)


@described.register
def _(light: QuadLight, place: Place, scale: float) -> dict[str, Any]:
    ab, ac = (np.array(v) * scale / 2 for v in (light.ab, light.ac))
    # A rectangle faces +(x cross y): ac before ab, so that it emits on the side of -(ab x ac).
    centre = place(light.corner) + ab + ac
    to_world = _columns(ac, ab, np.array(light.normal), centre)
    return {"kind": "rectangle", "to_world": to_world, "radiance": rgb(light.radiance)}


@described.register
def _(light: PointLight, place: Place, scale: float) -> dict[str, Any]:
    intensity = [c * scale**2 for c in light.intensity]
    return {"kind": "point", "position": place(light.position).tolist(), "intensity": intensity}


@described.register
def _(light: DirectionalLight, place: Place, scale: float) -> dict[str, Any]:
    direction = (-np.array(light.direction)).tolist()
    return {"kind": "directional", "direction": direction, "irradiance": rgb(light.irradiance)}


@described.register
def _(light: SunLight, place: Place, scale: float) -> dict[str, Any]:
    direction, distance = np.array(light.direction), SUN_DISTANCE * SIZE
    x, y = (v[:, 0] for v in frame(-direction[:, None]))
    radius = distance * math.tan(light.half_angle)
    to_world = _columns(x * radius, y * radius, -direction, direction * distance)
    return {"kind": "disk", "to_world": to_world, "radiance": rgb(light.radiance)}


@described.register
def _(light: DiskLight, place: Place, scale: float) -> dict[str, Any]:
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
@approximations.register(PointLight)
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
@strata_alike.register(PointLight)
@strata_alike.register(DirectionalLight)
def _(light: Light) -> bool:
    return True


@strata_alike.register(SunLight)
@strata_alike.register(DiskLight)
def _(light: Light) -> bool:
    return False  # disks to Mitsuba, which lays squares out on them concentrically


@singledispatch
def clearance(light: Light, geometry: Geometry, others: NDArray[np.intp]) -> float:
    """From a light to the nearest triangle, of those chosen (t,), that its light can meet; infinity where none is."""
    _unknown(light)


@clearance.register(DirectionalLight)
@clearance.register(SunLight)
def _(light: Light, geometry: Geometry, others: NDArray[np.intp]) -> float:
    return math.inf


@clearance.register
def _(light: PointLight, geometry: Geometry, others: NDArray[np.intp]) -> float:
    a, b, c = (corner[:, others] for corner in (geometry.a, geometry.b, geometry.c))
    return float(distance_to_triangles(column(light.position), a, b, c).min(initial=np.inf))


@clearance.register
def _(light: QuadLight, geometry: Geometry, others: NDArray[np.intp]) -> float:
    a, b, c = (points[:, others] for points in (geometry.a, geometry.b, geometry.c))
    corner, ab, ac = light.columns
    heights = np.stack([dot(p - corner, column(light.normal)) for p in (a, b, c)])
    size = np.sqrt(dot(ab, ab) + dot(ac, ac))
    ahead = (heights > 1e-12 * size).any(axis=0)
    a, b, c = a[:, ahead], b[:, ahead], c[:, ahead]
    distances = [np.inf]
    for u in np.linspace(0, 1, GRID):
        for v in np.linspace(0, 1, GRID):
            distances.append(float(distance_to_triangles(light.at(u, v), a, b, c).min(initial=np.inf)))
    # The other way round: corners of triangles in front of the middle of the light.
    inverse = np.linalg.pinv(np.hstack((ab, ac)))
    for p, height in zip((a, b, c), heights[:, ahead], strict=True):
        u, v = inverse @ (p - corner)
        over = (height > 0) & (u >= 0) & (u <= 1) & (v >= 0) & (v <= 1)
        distances.append(float(height[over].min(initial=np.inf)))
    return min(distances)


@clearance.register
def _(light: DiskLight, geometry: Geometry, others: NDArray[np.intp]) -> float:
    a, b, c = (points[:, others] for points in (geometry.a, geometry.b, geometry.c))
    center, normal = column(light.center), column(light.normal)
    heights = np.stack([dot(p - center, normal) for p in (a, b, c)])
    ahead = (heights > 1e-12 * light.radius).any(axis=0)
    a, b, c = a[:, ahead], b[:, ahead], c[:, ahead]
    distances = [np.inf]
    for u in np.linspace(0, 1, GRID):
        for v in np.arange(2 * GRID) / (2 * GRID):
            distances.append(float(distance_to_triangles(light.at(u, v), a, b, c).min(initial=np.inf)))
    # The other way round: corners of triangles in front of the disk.
    for p, height in zip((a, b, c), heights[:, ahead], strict=True):
        across = p - center - height * normal
        over = (height > 0) & (dot(across, across) <= light.radius**2)
        distances.append(float(height[over].min(initial=np.inf)))
    return min(distances)
