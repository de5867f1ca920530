"""What lights without extent have in common: one beam from any point, and no body."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar

import numpy as np

from nusselt.renderer.lobes import Lobe
from nusselt.renderer.shading import ShadingPoints, reflect
from nusselt.renderer.validation import Vec3
from nusselt.renderer.vectors import Floats, column

from .body import Plane
from .plain import Plain
from .sampling import one_place

CLOSED = 1e-12
"""Bound of a product of few factors, relative to its value; t^s adds its own."""


class OneBeam(Plain):
    """The answers to `Light` that such kinds share; a kind adds its colour, its place and its beam."""

    has_extent: ClassVar[bool] = False
    area: ClassVar[float] = 0.0

    @property
    @abstractmethod
    def colour(self) -> Vec3: ...

    @abstractmethod
    def beams(self, points: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats]: ...

    @abstractmethod
    def at(self, u: float, v: float) -> Floats: ...

    def hull(self) -> Floats:
        return self.at(0.0, 0.0)

    def middle(self) -> tuple[Floats, float]:
        return self.at(0.0, 0.0), 0.0

    def body(self) -> None:
        return None

    def plane(self) -> Plane | None:
        return None

    def unshadowed(self, points: ShadingPoints, glossy: bool) -> tuple[Floats, Floats]:
        d, weight = self.beams(points.position, *one_place())
        steep = np.zeros(points.count)
        for kind in points.reflecting(glossy):
            steep = np.maximum(steep, kind.steepness(points))
        return reflect(points, d, weight, glossy) * column(self.colour), CLOSED * (1 + steep / 1000) + self.doubt(d)

    def doubt(self, d: Floats) -> Floats | float:
        """Relative error (n,) of a beam along d (3, n, 1), beyond that."""
        return 0.0

    def has_form(self, kind: type[Lobe]) -> bool:
        return True
