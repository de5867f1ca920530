"""Where light comes from, each kind in its own units; frozen, validated."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

from .errors import InputError
from .validation import Vec3, colour, cross, direction, finite, parallel, unit, vector


@dataclass(frozen=True)
class QuadLight:
    """A parallelogram corner + u ab + v ac, u, v in [0, 1], that emits on the side of -(ab x ac) only.

    Black as a reflector on both sides, opaque, and visible to the camera.

    Parameters
    ----------
    corner, ab, ac : Vec3
        Corner and the two edges from it.
    radiance : Vec3
        W m^-2 sr^-1.
    """

    corner: Vec3
    ab: Vec3
    ac: Vec3
    radiance: Vec3

    def __post_init__(self) -> None:
        for name in ("corner", "ab", "ac"):
            object.__setattr__(self, name, vector(f"quadLight {name}", getattr(self, name)))
        object.__setattr__(self, "radiance", colour("quadLight radiance", self.radiance))
        for name in ("ab", "ac"):
            if max(map(abs, getattr(self, name))) == 0:
                raise InputError(f"quadLight {name}", getattr(self, name), "an edge that is not zero")
        if parallel(self.ab, self.ac):
            raise InputError("quadLight ac", self.ac, "an edge not parallel to ab (the light would have no area)")
        if not 0 < self.area < math.inf:
            raise InputError("quadLight area", self.area, "an area above 0 and finite in double precision")

    @property
    def area(self) -> float:
        return math.hypot(*cross(self.ab, self.ac))

    @property
    def normal(self) -> Vec3:
        """Unit normal of the emitting side, -(ab x ac)/|ab x ac|."""
        ux, uy, uz = unit("", cross(unit("", self.ab), unit("", self.ac)))
        return -ux, -uy, -uz


@dataclass(frozen=True)
class PointLight:
    """Irradiance intensity cos / R^2 at distance R.

    Parameters
    ----------
    position : Vec3
    intensity : Vec3
        Radiant intensity, W/sr.
    """

    position: Vec3
    intensity: Vec3

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", vector("point position", self.position))
        object.__setattr__(self, "intensity", colour("point intensity", self.intensity))


@dataclass(frozen=True)
class DirectionalLight:
    """Parallel light.

    Parameters
    ----------
    direction : Vec3
        *Towards* the light; made unit length.
    irradiance : Vec3
        On a plane that faces the light, W m^-2.
    """

    direction: Vec3
    irradiance: Vec3

    def __post_init__(self) -> None:
        object.__setattr__(self, "direction", direction("directional direction", self.direction))
        object.__setattr__(self, "irradiance", colour("directional irradiance", self.irradiance))


@dataclass(frozen=True)
class SunLight:
    """A uniform disk at infinity, not seen by the camera.

    Its radiance is irradiance / (pi sin^2 alpha), alpha the half angle: exactly the irradiance named, on a
    plane that faces it.

    Parameters
    ----------
    direction : Vec3
        Towards the centre; made unit length.
    irradiance : Vec3
        On a plane that faces the centre, W m^-2.
    angle : float
        Full angular diameter 2 alpha in degrees, in (0, 180).
    """

    direction: Vec3
    irradiance: Vec3
    angle: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "direction", direction("sun direction", self.direction))
        object.__setattr__(self, "irradiance", colour("sun irradiance", self.irradiance))
        object.__setattr__(self, "angle", finite("sun angle", self.angle))
        if not 0 < self.angle < 180:
            raise InputError("sun angle", self.angle, "an angular diameter in (0, 180) degrees")
        if math.sin(self.half_angle) ** 2 == 0 or math.isinf(max(self.radiance)):
            raise InputError("sun angle", self.angle, "an angle wide enough for the radiance to be finite")

    @property
    def half_angle(self) -> float:
        """alpha in radians."""
        return math.radians(self.angle) / 2

    @property
    def radiance(self) -> Vec3:
        """W m^-2 sr^-1."""
        r, g, b = (e / (math.pi * math.sin(self.half_angle) ** 2) for e in self.irradiance)
        return r, g, b


Light: TypeAlias = QuadLight | PointLight | DirectionalLight | SunLight
