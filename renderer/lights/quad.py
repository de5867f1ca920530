"""A parallelogram that shines to one side."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from nusselt.renderer import validation as checked
from nusselt.renderer.errors import InputError
from nusselt.renderer.lobes import Lobe
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.validation import Vec3, colour, parallel, unit, vector
from nusselt.renderer.vectors import Floats, column, cross, dot

from .body import Body, Plane
from .facing import faced_by, solid_angle
from .plain import Plain
from .quad_patch import quad_patch
from .spherical_fan import Outline, fan_beams
from .spherical_rectangle import is_rectangle, rectangle_beams
from .text import Text


@dataclass(frozen=True)
class QuadLight(Plain):
    """A parallelogram corner + u ab + v ac, u, v in [0, 1], that emits on the side of -(ab x ac) only.

    Black as a reflector on both sides, opaque, and visible to the camera.

    Parameters
    ----------
    corner, ab, ac : Vec3
        Corner and the two edges from it.
    radiance : Vec3
        W m^-2 sr^-1.
    """

    corner: Vec3
    ab: Vec3
    ac: Vec3
    radiance: Vec3
    kind: ClassVar[str] = "quad"
    has_extent: ClassVar[bool] = True
    at_infinity: ClassVar[bool] = False
    TEXT: ClassVar[Text] = Text("quadLight", "corner:xyz ab:xyz ac:xyz radiance:rgb")

    def __post_init__(self) -> None:
        for name in ("corner", "ab", "ac"):
            object.__setattr__(self, name, vector(f"quadLight {name}", getattr(self, name)))
        object.__setattr__(self, "radiance", colour("quadLight radiance", self.radiance))
        for name in ("ab", "ac"):
            if max(map(abs, getattr(self, name))) == 0:
                raise InputError(f"quadLight {name}", getattr(self, name), "an edge that is not zero")
        if parallel(self.ab, self.ac):
            raise InputError("quadLight ac", self.ac, "an edge not parallel to ab (the light would have no area)")
        if not 0 < self.area < math.inf:
            raise InputError("quadLight area", self.area, "an area above 0 and finite in double precision")

    @property
    def area(self) -> float:
        return math.hypot(*checked.cross(self.ab, self.ac))

    @property
    def normal(self) -> Vec3:
        """Unit normal of the emitting side, -(ab x ac)/|ab x ac|."""
        ux, uy, uz = unit("", checked.cross(unit("", self.ab), unit("", self.ac)))
        return -ux, -uy, -uz

    @property
    def colour(self) -> Vec3:
        return self.radiance

    def with_colour(self, rgb: Vec3) -> QuadLight:
        return replace(self, radiance=rgb)

    @property
    def columns(self) -> tuple[Floats, Floats, Floats]:
        """Corner and edges, each (3, 1)."""
        return column(self.corner), column(self.ab), column(self.ac)

    def beams(self, points: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        """Area measure: density 1/A, so a sample stands for A cos(theta_l) / R^2 of solid angle, over N."""
        corner, ab, ac = self.columns
        d = (corner - points)[:, :, None] + ab[:, :, None] * u + ac[:, :, None] * v
        faced = faced_by(corner, ab, ac, points)[:, None]
        return d, self.worth(points, d) * (faced / u.shape[1])

    def solid_beams(self, points: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        outline = Outline(*self.columns, four=True)
        beams = rectangle_beams if is_rectangle(outline) else fan_beams
        return beams(outline, points, u, v, self.beams(points, u, v))

    def worth(self, points: Floats, d: Floats) -> Floats:
        return solid_angle(cross(column(self.ab), column(self.ac)), d)

    def at(self, u: float, v: float) -> Floats:
        corner, ab, ac = self.columns
        return corner + u * ab + v * ac

    def hull(self) -> Floats:
        p, ab, ac = self.columns
        return np.hstack((p, p + ab, p + ac, p + ab + ac))

    def middle(self) -> tuple[Floats, float]:
        corner, ab, ac = self.columns
        across = max(dot(ab + ac, ab + ac).item(), dot(ab - ac, ab - ac).item())
        return corner + (ab + ac) / 2, float(np.sqrt(across)) / 2

    def body(self) -> Body:
        """Two triangles, wound so that their normal is the emitting side's, -(ab x ac)."""
        p, ab, ac = self.columns
        far = p + ab + ac
        return Body((np.hstack((p, p)), np.hstack((p + ac, far)), np.hstack((far, p + ab))))

    def plane(self) -> Plane:
        return column(self.normal), column(self.corner)

    def unshadowed(self, points: ShadingPoints, glossy: bool) -> tuple[Floats, Floats]:
        radiance, bound = quad_patch(points, *self.columns, glossy)
        return radiance * column(self.colour), bound

    def has_form(self, kind: type[Lobe]) -> bool:
        return kind.patch is not None

    def parallelogram(self) -> QuadLight:  # type: ignore[override]
        return self

    def anchored(self) -> Floats:
        return column(self.corner)

    def moved(self, origin: Floats) -> QuadLight:
        x, y, z = (np.array(self.corner) - origin).tolist()
        return replace(self, corner=(x, y, z))
