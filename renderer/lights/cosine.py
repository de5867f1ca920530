"""A lamp without extent that shines as a small flat light does."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from nusselt.renderer.validation import Vec3, colour, direction, vector
from nusselt.renderer.vectors import Floats, column, dot

from .body import Plane
from .one_beam import OneBeam
from .text import Text

ROUNDINGS = 8.0
"""Of the cosine, in units of eps."""


@dataclass(frozen=True)
class CosineLight(OneBeam):
    """Irradiance intensity max(cos theta, 0) cos / R^2 at distance R, theta the angle from the normal.

    What any flat light of radiance L and area A becomes as it shrinks at constant intensity L A; its flux is pi times
    that.

    Parameters
    ----------
    position : Vec3
    normal : Vec3
        Of the emitting side; made unit length.
    intensity : Vec3
        Radiant intensity along the normal, W/sr.
    """

    position: Vec3
    normal: Vec3
    intensity: Vec3
    kind: ClassVar[str] = "cosine"
    at_infinity: ClassVar[bool] = False
    TEXT: ClassVar[Text] = Text("cosineLight", "position:xyz normal:xyz intensity:rgb")

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", vector("cosineLight position", self.position))
        object.__setattr__(self, "normal", direction("cosineLight normal", self.normal))
        object.__setattr__(self, "intensity", colour("cosineLight intensity", self.intensity))

    @property
    def colour(self) -> Vec3:
        return self.intensity

    def with_colour(self, rgb: Vec3) -> CosineLight:
        return replace(self, intensity=rgb)

    def beams(self, points: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        d = (column(self.position) - points)[:, :, None]
        return d, self.worth(points, d)

    def worth(self, points: Floats, d: Floats) -> Floats:
        square, height = dot(d, d), self._height(d)
        return np.divide(np.maximum(height, 0), square * np.sqrt(square), out=np.zeros_like(square), where=square > 0)

    def _height(self, d: Floats) -> Floats:
        """Of the points over the lamp's plane, for ways d (3, n, k) from them to it."""
        return -dot(column(self.normal)[:, :, None], d)

    def doubt(self, d: Floats) -> Floats:
        """Beside the lamp's plane the cosine is a difference."""
        height = self._height(d)[:, 0]
        length = np.sqrt(dot(d, d))[:, 0]
        eps = np.finfo(np.float64).eps
        return np.divide(ROUNDINGS * eps * length, height, out=np.zeros_like(height), where=height > 0)

    def at(self, u: float, v: float) -> Floats:
        return column(self.position)

    def plane(self) -> Plane:
        return column(self.normal), column(self.position)

    def anchored(self) -> Floats:
        return column(self.position)

    def moved(self, origin: Floats) -> CosineLight:
        x, y, z = (np.array(self.position) - origin).tolist()
        return replace(self, position=(x, y, z))
