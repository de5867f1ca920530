"""A lamp without extent."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from nusselt.renderer.lobes import Lobe
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.validation import Vec3, colour, vector
from nusselt.renderer.vectors import Floats, column, dot

from .one_beam import one_beam
from .text import Text


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
    kind: ClassVar[str] = "point"
    has_extent: ClassVar[bool] = False
    at_infinity: ClassVar[bool] = False
    area: ClassVar[float] = 0.0
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
        return d, self.worth(d)

    def worth(self, d: Floats) -> Floats:
        length2 = dot(d, d)
        return np.divide(1.0, length2, out=np.zeros_like(length2), where=length2 > 0)

    def at(self, u: float, v: float) -> Floats:
        return column(self.position)

    def hull(self) -> Floats:
        return column(self.position)

    def middle(self) -> tuple[Floats, float]:
        return column(self.position), 0.0

    def body(self) -> None:
        return None

    def plane(self) -> None:
        return None

    def unshadowed(self, points: ShadingPoints, glossy: bool) -> tuple[Floats, Floats]:
        return one_beam(self, points, glossy)

    def has_form(self, kind: type[Lobe]) -> bool:
        return True

    def parallelogram(self) -> None:
        return None

    def anchored(self) -> Floats:
        return column(self.position)

    def moved(self, origin: Floats) -> PointLight:
        x, y, z = (np.array(self.position) - origin).tolist()
        return replace(self, position=(x, y, z))
