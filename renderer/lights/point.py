"""A lamp without extent."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from nusselt.renderer.validation import Vec3, colour, vector
from nusselt.renderer.vectors import Floats, column, dot

from .one_beam import OneBeam
from .text import Text


@dataclass(frozen=True)
class PointLight(OneBeam):
    """Irradiance intensity cos / R^2 at distance R.

    Parameters
    ----------
    position : Vec3
    intensity : Vec3
        Radiant intensity, W/sr.
    """

    position: Vec3
    intensity: Vec3
    kind: ClassVar[str] = "point"
    at_infinity: ClassVar[bool] = False
    TEXT: ClassVar[Text] = Text("point", "position:xyz intensity:rgb")

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", vector("point position", self.position))
        object.__setattr__(self, "intensity", colour("point intensity", self.intensity))

    @property
    def colour(self) -> Vec3:
        return self.intensity

    def with_colour(self, rgb: Vec3) -> PointLight:
        return replace(self, intensity=rgb)

    def beams(self, points: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        d = (column(self.position) - points)[:, :, None]
        return d, self.worth(points, d)

    def worth(self, points: Floats, d: Floats) -> Floats:
        length2 = dot(d, d)
        return np.divide(1.0, length2, out=np.zeros_like(length2), where=length2 > 0)

    def at(self, u: float, v: float) -> Floats:
        return column(self.position)

    def anchored(self) -> Floats:
        return column(self.position)

    def moved(self, origin: Floats) -> PointLight:
        x, y, z = (np.array(self.position) - origin).tolist()
        return replace(self, position=(x, y, z))
