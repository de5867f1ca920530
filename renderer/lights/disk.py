"""A flat disk that shines to one side."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.closed_forms.circles.circles import EPS
from nusselt.renderer.closed_forms.circles.cones import Rounds
from nusselt.renderer.errors import InputError
from nusselt.renderer.lobes import Lobe
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.surfaces import FlatDisk
from nusselt.renderer.validation import Vec3, colour, direction, finite, vector
from nusselt.renderer.vectors import Floats, column, dot, frame
from nusselt.renderer.watertight import PLANE_ULPS, largest, one_norm

from .body import Body, Plane
from .facing import solid_angle
from .plain import Plain
from .round_patch import round_patch
from .text import Text

MOVED = 16.0
"""Roundings of the rim's direction in units of eps times coordinates over distance, counted."""


@dataclass(frozen=True)
class DiskLight(Plain):
    """A disk that emits on the side of its normal only: black as a reflector, opaque, and visible to the camera.

    Parameters
    ----------
    center : Vec3
    normal : Vec3
        Of the emitting side; made unit length.
    radius : float
        Above 0, scene units.
    radiance : Vec3
        W m^-2 sr^-1.
    """

    center: Vec3
    normal: Vec3
    radius: float
    radiance: Vec3
    kind: ClassVar[str] = "disk"
    has_extent: ClassVar[bool] = True
    at_infinity: ClassVar[bool] = False
    TEXT: ClassVar[Text] = Text("diskLight", "center:xyz normal:xyz radius radiance:rgb")

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", vector("diskLight center", self.center))
        object.__setattr__(self, "normal", direction("diskLight normal", self.normal))
        object.__setattr__(self, "radius", finite("diskLight radius", self.radius))
        object.__setattr__(self, "radiance", colour("diskLight radiance", self.radiance))
        if self.radius <= 0 or not 0 < self.area < math.inf:
            raise InputError("diskLight radius", self.radius, "a radius above 0, its square finite in double precision")

    @property
    def area(self) -> float:
        return math.pi * self.radius * self.radius

    @property
    def colour(self) -> Vec3:
        return self.radiance

    def with_colour(self, rgb: Vec3) -> DiskLight:
        return replace(self, radiance=rgb)

    def _from_centre(self, u: Floats, v: Floats) -> Floats:
        """Steps (3, n, k) from the centre, uniform in area: radius sqrt(u) at the angle 2 pi v."""
        x, y = frame(column(self.normal))
        length, angle = self.radius * np.sqrt(u), 2 * math.pi * v
        return x[:, :, None] * (length * np.cos(angle)) + y[:, :, None] * (length * np.sin(angle))

    def beams(self, points: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        """Area measure: density 1/A, so a sample stands for A cos(theta_l) / R^2 of solid angle, over N."""
        d = (column(self.center) - points)[:, :, None] + self._from_centre(u, v)
        return d, self.worth(points, d) * (self._faced(points)[:, None] / u.shape[1])

    def _faced(self, points: Floats) -> NDArray[np.bool_]:
        """Which points (3, n) lie before the disk by more than rounding, as for shadow rays."""
        normal, center = column(self.normal), column(self.center)
        bound = PLANE_ULPS * one_norm(normal) * (largest(center) + largest(points))
        return np.asarray(dot(normal, points - center) > bound)

    def worth(self, points: Floats, d: Floats) -> Floats:
        return solid_angle(-self.area * column(self.normal), d)

    def at(self, u: float, v: float) -> Floats:
        return column(self.center) + self._from_centre(np.array([[u]]), np.array([[v]]))[:, :, 0]

    def hull(self) -> Floats:
        x, y = (self.radius * axis for axis in frame(column(self.normal)))
        return np.hstack([column(self.center) + sx * x + sy * y for sx in (-1, 1) for sy in (-1, 1)])

    def middle(self) -> tuple[Floats, float]:
        return column(self.center), self.radius

    def body(self) -> Body:
        return Body(disks=(FlatDisk(self.center, self.normal, self.radius),))

    def plane(self) -> Plane:
        return column(self.normal), column(self.center)

    def unshadowed(self, points: ShadingPoints, glossy: bool) -> tuple[Floats, Floats]:
        """Boundary integrals over the rim's circle and, where it is cut, along the horizon (`round_patch`).

        Anywhere before the disk, for any exponent. Relative error measured against quadrature above both horizons, at
        one to four radii and exponents to 20: Lambert 9e-16, lobe 5e-15 at most, bounds 4e-12 at most. The arcs' sum
        cancels as distance over radius: at 1e3 radii Lambert is off by 1e-12 (bound 3e-10), at 1e5 by 1e-10 (3e-8).
        """
        radiance, bound = round_patch(points, self._reaches(points), self._cones, glossy, "disk")
        return radiance * column(self.colour), bound

    def _reaches(self, points: ShadingPoints) -> NDArray[np.bool_]:
        """Which points it shines on, and above whose horizon some of it is."""
        tilt = dot(points.normal, column(self.normal))
        across = points.normal - tilt * column(self.normal)
        top = dot(points.normal, column(self.center) - points.position) + self.radius * np.sqrt(dot(across, across))
        return self._faced(points.position) & (top > 0)

    def has_form(self, kind: type[Lobe]) -> bool:
        return kind.contour is not None

    def _cones(self, shaded: ShadingPoints) -> tuple[Rounds, Floats]:
        """The disk as points see it, and by how much rounding moves its rim; see `Seen`."""
        points = shaded.position
        normal, v = column(self.normal), column(self.center) - points
        height = -dot(normal, v)
        across = v + height * normal
        aside = np.sqrt(dot(across, across))
        e3 = np.broadcast_to(-normal, points.shape)
        e1 = np.where(aside > 0, across / np.where(aside > 0, aside, 1.0), frame(e3)[0])
        e2 = np.cross(e3, e1, axis=0)
        size = np.sqrt(aside**2 + height**2 + self.radius**2)
        count = np.arange(points.shape[1])
        cone = Rounds(count, e1, e2, e3, aside / size, height / size, self.radius / size, False)
        nearest = np.hypot(aside - self.radius, height)
        moved = MOVED * EPS * (largest(points) + largest(column(self.center)) + self.radius) / nearest
        return cone, moved * 2 * math.pi * np.minimum(self.radius / nearest, 1.0)

    def anchored(self) -> Floats:
        return column(self.center)

    def moved(self, origin: Floats) -> DiskLight:
        x, y, z = (np.array(self.center) - origin).tolist()
        return replace(self, center=(x, y, z))
