"""A triangle that shines to one side."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from nusselt.renderer import validation as checked
from nusselt.renderer.errors import InputError
from nusselt.renderer.lobes import Lobe
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.surfaces import has_area
from nusselt.renderer.validation import Vec3, colour, unit, vector
from nusselt.renderer.vectors import Floats, column, cross, dot

from .body import Body, Plane
from .facing import faced_by, solid_angle
from .plain import Plain
from .polygon_patch import polygon_patch
from .quad import QuadLight
from .spherical_fan import Outline, fan_beams
from .text import Text


@dataclass(frozen=True)
class TriangleLight(Plain):
    """A triangle that emits on the side from which its corners run counter-clockwise, as a surface's front.

    Black as a reflector on both sides, opaque, and visible to the camera.

    Parameters
    ----------
    a, b, c : Vec3
        Corners.
    radiance : Vec3
        W m^-2 sr^-1.
    """

    a: Vec3
    b: Vec3
    c: Vec3
    radiance: Vec3
    kind: ClassVar[str] = "triangle"
    has_extent: ClassVar[bool] = True
    at_infinity: ClassVar[bool] = False
    TEXT: ClassVar[Text] = Text("triLight", "a:xyz b:xyz c:xyz radiance:rgb")

    def __post_init__(self) -> None:
        for name in ("a", "b", "c"):
            object.__setattr__(self, name, vector(f"triLight {name}", getattr(self, name)))
        object.__setattr__(self, "radiance", colour("triLight radiance", self.radiance))
        if not has_area(*(column(v) for v in (self.a, self.b, self.c)))[0]:
            raise InputError("triLight c", self.c, "a corner off the line through the other two")
        if not 0 < self.area < math.inf:
            raise InputError("triLight area", self.area, "an area above 0 and finite in double precision")

    @property
    def _edges(self) -> tuple[Vec3, Vec3]:
        ax, ay, az = self.a
        (bx, by, bz), (cx, cy, cz) = self.b, self.c
        return (bx - ax, by - ay, bz - az), (cx - ax, cy - ay, cz - az)

    @property
    def area(self) -> float:
        return math.hypot(*checked.cross(*self._edges)) / 2

    @property
    def normal(self) -> Vec3:
        """Unit normal of the emitting side, (b - a) x (c - a) over its length."""
        first, second = self._edges
        return unit("", checked.cross(unit("", first), unit("", second)))

    @property
    def colour(self) -> Vec3:
        return self.radiance

    def with_colour(self, rgb: Vec3) -> TriangleLight:
        return replace(self, radiance=rgb)

    @property
    def columns(self) -> tuple[Floats, Floats, Floats]:
        """First corner and the edges from it, (3, 1) each, the last first: as those of a `QuadLight` of this front."""
        a, b, c = (column(v) for v in (self.a, self.b, self.c))
        return a, c - a, b - a

    def beams(self, points: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        """Area measure: density 1/A; the square's lines u become lines through a's side, sqrt(1 - u) of the way off."""
        a, ac, ab = self.columns
        way = np.sqrt(1 - u)
        d = (a - points)[:, :, None] + ab[:, :, None] * (1 - way) + ac[:, :, None] * (way * v)
        faced = faced_by(a, ac, ab, points)[:, None]
        return d, self.worth(points, d) * (faced / u.shape[1])

    def solid_beams(self, points: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        return fan_beams(Outline(*self.columns, four=False), points, u, v, self.beams(points, u, v))

    def worth(self, points: Floats, d: Floats) -> Floats:
        _, ac, ab = self.columns
        return solid_angle(cross(ac, ab) / 2, d)

    def at(self, u: float, v: float) -> Floats:
        a, ac, ab = self.columns
        way = math.sqrt(1 - u)
        return a + (1 - way) * ab + way * v * ac

    def hull(self) -> Floats:
        return np.hstack([column(v) for v in (self.a, self.b, self.c)])

    def middle(self) -> tuple[Floats, float]:
        corners = self.hull()
        place = corners.mean(axis=1, keepdims=True)
        away = corners - place
        return place, float(np.sqrt(dot(away, away).max()))

    def body(self) -> Body:
        return Body((column(self.a), column(self.b), column(self.c)))

    def plane(self) -> Plane:
        return column(self.normal), column(self.a)

    def unshadowed(self, points: ShadingPoints, glossy: bool) -> tuple[Floats, Floats]:
        """Boundary integrals, cut at the horizon, or nodes where it is small (`polygon_patch`).

        Before it, for any exponent. Lambert against 50 digits: 4e-16 (wide, small or far), 1e-8 where its width is
        1e-7 of its length, 3e-5 (bound 8e-2) seen edge-on from 1e-7 beside its plane. Two halves against the forms of
        the parallelogram, all lobes, across all horizons: within the bounds, whose median is below 1e-11.
        """
        facing = faced_by(*self.columns, points.position)
        radiance, bound = polygon_patch(points, facing, self.hull(), glossy, "triangle")
        return radiance * column(self.colour), bound

    def has_form(self, kind: type[Lobe]) -> bool:
        return kind.contour is not None

    def half_of(self) -> QuadLight:  # type: ignore[override]
        a, b, c = (np.array(v) for v in (self.a, self.b, self.c))
        return QuadLight(self.a, tuple((c - a).tolist()), tuple((b - a).tolist()), self.radiance)

    def anchored(self) -> Floats:
        return self.hull()

    def moved(self, origin: Floats) -> TriangleLight:
        a, b, c = (tuple((np.array(v) - origin).tolist()) for v in (self.a, self.b, self.c))
        return replace(self, a=a, b=b, c=c)
