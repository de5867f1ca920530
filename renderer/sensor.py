"""A point that measures irradiance, and what it is expected to read."""

from __future__ import annotations

from dataclasses import dataclass

from .errors import InputError
from .validation import Vec3, colour, direction, finite, vector


@dataclass(frozen=True)
class Sensor:
    """A cosine-weighted meter: irradiance, W m^-2, of direct light on a plane.

    It is no body: nothing is shadowed by it. Where it lies on a surface it looks away from it.

    Parameters
    ----------
    position : Vec3
    normal : Vec3
        Of the side that is lit; made unit length.
    expected : Vec3, optional
        Irradiance that it should read.
    percent : float
        How far from that it may be, in percent of it: how well it is known.
    """

    position: Vec3
    normal: Vec3
    expected: Vec3 | None = None
    percent: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", vector("sensor position", self.position))
        object.__setattr__(self, "normal", direction("sensor normal", self.normal))
        if self.expected is not None:
            object.__setattr__(self, "expected", colour("expect irradiance", self.expected))
        object.__setattr__(self, "percent", finite("expect percent", self.percent))
        if self.percent < 0:
            raise InputError("expect percent", self.percent, "a number from 0 on")
