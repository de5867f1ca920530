"""Lights as UsdLux defines them, over a plane: the open question of what a renderer should show.

Radiance of an area light: intensity 2^exposure colour. Of a distant light with ``normalize``: intensity over
pi sin^2 of its half angle, so that a facing patch gets the intensity in lux. The scenes are those on which public
renderers were compared without a right answer: a plane of albedo 0.18 beneath a light; its radiance at the nadir.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from nusselt.renderer.lights import DiskLight, Light, SphereLight, SunLight
from nusselt.renderer.sensor import Sensor

from .entry import Entry, PublicTable, rectangle, scene_of
from .factors import corner_parallel

SOURCE = "UsdLux, closed forms"
ALBEDO = 0.18
BENEATH = Sensor((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))


def _rect(distance: float) -> tuple[Light, float]:
    """A facing square: four times the catalogues' factor to a rectangle with a corner above the point."""
    radiance, half = 10.0, 0.5 / distance
    light = rectangle((-0.5, -0.5, distance), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0), radiance)
    return light, math.pi * radiance * 4 * corner_parallel(half, half)


def _disk(distance: float) -> tuple[Light, float]:
    radius, radiance = 0.5, 30.0
    light = DiskLight((0.0, 0.0, distance), (0.0, 0.0, -1.0), radius, (radiance,) * 3)
    return light, math.pi * radiance * radius**2 / (radius**2 + distance**2)


def _sphere(distance: float) -> tuple[Light, float]:
    """As far as its centre."""
    radius, radiance = 0.5, 30.0
    light = SphereLight((0.0, 0.0, distance), radius, (radiance,) * 3)
    return light, math.pi * radiance * (radius / distance) ** 2


def _distant(angle: float) -> tuple[Light, float]:
    """With ``normalize``, intensity 1: our suns are given by their irradiance."""
    return SunLight((0.0, 0.0, 1.0), (1.0, 1.0, 1.0), angle), 1.0


LIGHTS: dict[str, tuple[Callable[[float], tuple[Light, float]], float]] = {
    "rect 1 x 1, intensity 10, at 1": (_rect, 1.0),
    "disk of radius 0.5, intensity 30, at 2": (_disk, 2.0),
    "sphere of radius 0.5, intensity 30, at 2": (_sphere, 2.0),
    "distant of 0.53 degrees, normalize": (_distant, 0.53),
    "distant of 10 degrees, normalize": (_distant, 10.0),
}


def tables() -> tuple[PublicTable, ...]:
    """A table a light: each stands alone over the plane."""
    found = []
    for name, (make, size) in LIGHTS.items():
        light, irradiance = make(size)
        weight = ALBEDO / math.pi
        entry = Entry("nadir", (BENEATH,), (weight,), weight * irradiance, 1e-9)
        found.append(PublicTable(f"UsdLux {name}", SOURCE, "radiance", scene_of("usdlux", light), (entry,)))
    return tuple(found)
