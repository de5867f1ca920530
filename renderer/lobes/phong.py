"""The modified Phong lobe (Lafortune & Willems 1994). Its integrals are read where something is glossy."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from nusselt.renderer.closed_forms.circles.circles import CircleArcs
from nusselt.renderer.closed_forms.circles.pairing import columns
from nusselt.renderer.errors import InputError
from nusselt.renderer.validation import Vec3, colour, finite
from nusselt.renderer.vectors import Bools, Floats, Ints, chosen, dot

from .protocol import Contour, Estimate, Parameter, PatchForm, SampledLobe, ShadingPoints


def _over_patch(points: ShadingPoints, index: Ints, corner: Floats, ab: Floats, ac: Floats) -> Estimate:
    """(s+2)/(2 pi) times the lobe integral."""
    from nusselt.renderer.closed_forms.phong_lobe import phong_lobe

    s = points.shininess[index]
    x, n, w = (chosen(v, index) for v in (points.position, points.normal, points.mirror))
    corner, ab, ac = (chosen(v, index) for v in (corner, ab, ac))
    power, bound = phong_lobe(x, n, w, s, corner, ab, ac, enough=points.enough)
    return (s + 2) / (2 * math.pi) * power, bound


class PhongContour:
    """s + 2 times the lobe integral."""

    dear: ClassVar[bool] = True

    def arcs(self, points: ShadingPoints, index: Ints, start: Floats, end: Floats) -> Estimate:
        from nusselt.renderer.closed_forms.arc_lobe import lobe_arcs

        n, w = columns(points.normal, index), columns(points.mirror, index)
        return lobe_arcs(start, end, n, w, points.shininess[index])

    def circles(self, points: ShadingPoints, arcs: CircleArcs) -> Estimate:
        from nusselt.renderer.closed_forms.circles.lobe import lobe_circles

        index = arcs.cone.point
        n, w = columns(points.normal, index), columns(points.mirror, index)
        return lobe_circles(arcs, n, w, points.shininess[index])

    def density(self, points: ShadingPoints, index: Ints) -> Callable[[Floats, Floats], Floats]:
        w, s = columns(points.mirror, index), points.shininess[index]
        return lambda d, square_length: (s + 2) * np.maximum(dot(w, d) / np.sqrt(square_length), 0.0) ** s

    def peak(self, points: ShadingPoints) -> Floats:
        return points.shininess + 2

    def is_smooth(self, points: ShadingPoints, middle: Floats, distance: Floats, spread: Floats) -> Bools:
        slant = dot(points.mirror, middle) / distance  # the cosine at the middle; it changes by the light's half angle
        steep = points.shininess * spread / np.maximum(slant - spread, 1e-300)
        return np.asarray((slant > 2 * spread) & (steep < 0.5))


@dataclass(frozen=True)
class Phong(SampledLobe):
    """f = albedo (s+2)/(2 pi) max(r.w, 0)^s, with r the mirror direction of the viewer.

    Parameters
    ----------
    albedo : Vec3
        None negative; above 1 is legal.
    shininess : float
        The exponent s, at least 0. At 0 the lobe is 1 where r.w > 0 and 0 elsewhere.
    """

    albedo: Vec3 = (0.0, 0.0, 0.0)
    shininess: float = 1.0
    kind: ClassVar[str] = "phong"
    title: ClassVar[str] = "the glossy lobe"
    PARAMETERS: ClassVar[tuple[Parameter, ...]] = (Parameter("specular", "r g b"), Parameter("shininess", "exponent"))
    patch: ClassVar[PatchForm | None] = _over_patch
    contour: ClassVar[Contour | None] = PhongContour()

    def __post_init__(self) -> None:
        object.__setattr__(self, "albedo", colour("specular", self.albedo))
        object.__setattr__(self, "shininess", finite("shininess", self.shininess))
        if self.shininess < 0:
            raise InputError("shininess", self.shininess, "an exponent of at least 0")

    @classmethod
    def evaluate(cls, points: ShadingPoints, d: Floats, length: Floats) -> Floats:
        """At s = 0 the power is 1 above the mirror direction's horizon, and it is 0 exactly at a right angle."""
        s = points.shininess[:, None]
        cosine = dot(points.mirror[:, :, None], d) / length
        with np.errstate(under="ignore"):
            power = np.where(cosine > 0, np.maximum(cosine, 0.0) ** s, 0.0)
        return (s + 2) / (2 * math.pi) * power

    @classmethod
    def steepness(cls, points: ShadingPoints) -> Floats:
        return points.shininess
