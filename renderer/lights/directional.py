"""Parallel light."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from nusselt.renderer.validation import Vec3, colour, direction
from nusselt.renderer.vectors import Floats, column

from .one_beam import OneBeam
from .text import Text


@dataclass(frozen=True)
class DirectionalLight(OneBeam):
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
    kind: ClassVar[str] = "directional"
    at_infinity: ClassVar[bool] = True
    TEXT: ClassVar[Text] = Text("directional", "direction:xyz irradiance:rgb")

    def __post_init__(self) -> None:
        object.__setattr__(self, "direction", direction("directional direction", self.direction))
        object.__setattr__(self, "irradiance", colour("directional irradiance", self.irradiance))

    @property
    def colour(self) -> Vec3:
        return self.irradiance

    def with_colour(self, rgb: Vec3) -> DirectionalLight:
        return replace(self, irradiance=rgb)

    def beams(self, points: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        d = np.broadcast_to(column(self.direction)[:, :, None], (3, points.shape[1], 1))
        return d, self.worth(points, d)

    def worth(self, points: Floats, d: Floats) -> Floats:
        return np.ones(d.shape[1:])

    def at(self, u: float, v: float) -> Floats:
        return column(self.direction)

    def anchored(self) -> Floats:
        return np.zeros((3, 0))

    def moved(self, origin: Floats) -> DirectionalLight:
        return self
