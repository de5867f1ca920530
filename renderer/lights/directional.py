"""Parallel light."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from nusselt.renderer.lobes import Lobe
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.validation import Vec3, colour, direction
from nusselt.renderer.vectors import Floats, column

from .one_beam import one_beam
from .text import Text


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
    kind: ClassVar[str] = "directional"
    has_extent: ClassVar[bool] = False
    at_infinity: ClassVar[bool] = True
    area: ClassVar[float] = 0.0
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
        return d, self.worth(d)

    def worth(self, d: Floats) -> Floats:
        return np.ones(d.shape[1:])

    def at(self, u: float, v: float) -> Floats:
        return column(self.direction)

    def hull(self) -> Floats:
        return column(self.direction)

    def middle(self) -> tuple[Floats, float]:
        return column(self.direction), 0.0

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
        return np.zeros((3, 0))

    def moved(self, origin: Floats) -> DirectionalLight:
        return self
