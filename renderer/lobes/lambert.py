"""Lambert's lobe: 1/pi in all directions."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from nusselt.renderer.closed_forms.arc_lambert import lambert_arcs
from nusselt.renderer.closed_forms.circles.circles import CircleArcs, lambert_circles
from nusselt.renderer.closed_forms.circles.pairing import columns
from nusselt.renderer.closed_forms.irradiance import irradiance
from nusselt.renderer.validation import Vec3, colour
from nusselt.renderer.vectors import Floats, Ints, chosen, dot

from .protocol import Contour, Estimate, Parameter, PatchForm, ShadingPoints


def _over_patch(points: ShadingPoints, index: Ints, corner: Floats, ab: Floats, ac: Floats) -> Estimate:
    """The irradiance over pi."""
    x, n, corner, ab, ac = (chosen(v, index) for v in (points.position, points.normal, corner, ab, ac))
    heights = [dot(n, v - x) for v in (corner, corner + ab, corner + ac, corner + ab + ac)]
    lit = np.flatnonzero(np.maximum.reduce(heights) > 0)  # the others are the dearest, and get nothing
    value, bound = np.zeros(index.size), np.zeros(index.size)
    if lit.size:
        x, n, corner, ab, ac = (chosen(v, lit) for v in (x, n, corner, ab, ac))
        power, bound[lit] = irradiance(x, n, corner, ab, ac, enough=points.enough)
        value[lit] = power / math.pi
    return value, bound


class LambertContour:
    """Twice the irradiance."""

    dear: ClassVar[bool] = False

    def arcs(self, points: ShadingPoints, index: Ints, start: Floats, end: Floats) -> Estimate:
        return lambert_arcs(start, end, columns(points.normal, index))

    def circles(self, points: ShadingPoints, arcs: CircleArcs) -> Estimate:
        return lambert_circles(arcs, columns(points.normal, arcs.cone.point))

    def density(self, points: ShadingPoints, index: Ints) -> Callable[[Floats, Floats], float]:
        return lambda d, square_length: 2.0

    def peak(self, points: ShadingPoints) -> float:
        return 2.0

    def is_smooth(self, points: ShadingPoints, middle: Floats, distance: Floats, spread: Floats) -> bool:
        return True


@dataclass(frozen=True)
class Lambert:
    """f = albedo / pi.

    Parameters
    ----------
    albedo : Vec3
        None negative; above 1 is legal.
    """

    albedo: Vec3 = (0.0, 0.0, 0.0)
    kind: ClassVar[str] = "lambert"
    title: ClassVar[str] = "Lambert's lobe"
    glossy: ClassVar[bool] = False
    PARAMETERS: ClassVar[tuple[Parameter, ...]] = (Parameter("diffuse", "r g b"),)
    patch: ClassVar[PatchForm | None] = _over_patch
    contour: ClassVar[Contour | None] = LambertContour()

    def __post_init__(self) -> None:
        object.__setattr__(self, "albedo", colour("diffuse", self.albedo))

    @classmethod
    def evaluate(cls, points: ShadingPoints, d: Floats, length: Floats) -> Floats:
        return np.full_like(length, 1 / math.pi)

    @classmethod
    def over_beams(cls, points: ShadingPoints, arriving: Floats, d: Floats, length: Floats) -> Floats:
        return np.asarray(arriving.sum(axis=1) / math.pi)

    @classmethod
    def steepness(cls, points: ShadingPoints) -> float:
        return 0.0
