"""A ball that shines."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from nusselt.renderer.closed_forms.circles.cones import Rounds, outside, spheres
from nusselt.renderer.errors import InputError
from nusselt.renderer.lobes import Lobe
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.surfaces import Ellipsoid
from nusselt.renderer.validation import Vec3, colour, finite, vector
from nusselt.renderer.vectors import Floats, column, dot

from .body import Body
from .plain import Plain
from .round_patch import round_patch
from .text import Text


@dataclass(frozen=True)
class SphereLight(Plain):
    """A ball that emits outwards: black as a reflector, opaque, and visible to the camera. Inside it is dark.

    Parameters
    ----------
    center : Vec3
    radius : float
        Above 0, scene units.
    radiance : Vec3
        W m^-2 sr^-1.
    """

    center: Vec3
    radius: float
    radiance: Vec3
    kind: ClassVar[str] = "sphere"
    has_extent: ClassVar[bool] = True
    at_infinity: ClassVar[bool] = False
    TEXT: ClassVar[Text] = Text("sphereLight", "center:xyz radius radiance:rgb")

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", vector("sphereLight center", self.center))
        object.__setattr__(self, "radius", finite("sphereLight radius", self.radius))
        object.__setattr__(self, "radiance", colour("sphereLight radiance", self.radiance))
        if self.radius <= 0 or not 0 < self.area < math.inf:
            raise InputError(
                "sphereLight radius", self.radius, "a radius above 0, its square finite in double precision"
            )

    @property
    def area(self) -> float:
        return 4 * math.pi * self.radius * self.radius

    @property
    def colour(self) -> Vec3:
        return self.radiance

    def with_colour(self, rgb: Vec3) -> SphereLight:
        return replace(self, radiance=rgb)

    def _seen(self, points: ShadingPoints) -> tuple[Rounds, Floats]:
        """The ball's cone about points, all outside it; its rim lies where its middle and width say (`Seen`)."""
        return self._cones(points.position), np.zeros(points.count)

    def _cones(self, points: Floats) -> Rounds:
        n = points.shape[1]
        return spheres(points, np.arange(n), np.repeat(column(self.center), n, axis=1), np.full(n, self.radius))

    def _height(self, cone: Rounds) -> Floats:
        """1 - cos of the cones' half angles, without cancellation."""
        return cone.rho * cone.rho / (1 + cone.k3)

    def beams(self, points: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        """Uniform in solid angle over the cone under which each point sees the ball: density 1/(2 pi (1 - cos alpha)).

        u is the height of the cap, from the middle to the rim, v the angle around. A beam ends where it meets the ball.
        """
        n, k = points.shape[1], u.shape[1]
        d = np.zeros((3, n, k))
        d[0] = 1.0  # from inside nothing is seen, whatever the way
        weight = np.zeros((n, k))
        out = np.flatnonzero(self._outside(points))
        if out.size:
            cone = self._cones(points[:, out])
            u, v = (np.broadcast_to(w, (n, k))[out] for w in (u, v))
            d[:, out] = self._ways(cone, points[:, out], u, v)
            weight[out] = (2 * math.pi / k) * self._height(cone)[:, None]
        return d, weight

    def _ways(self, cone: Rounds, points: Floats, u: Floats, v: Floats) -> Floats:
        """From points (3, n) through (u, v) (n, k) to the ball."""
        cap = self._height(cone)[:, None]
        height, angle = u * cap, 2 * math.pi * v
        sine = np.sqrt(height * (2 - height))
        e1, e2, e3 = (axis[:, :, None] for axis in (cone.e1, cone.e2, cone.e3))
        way = e1 * (sine * np.cos(angle)) + e2 * (sine * np.sin(angle)) + e3 * (1 - height)
        # Distance over that of the centre: the nearer root, its discriminant (cos^2 - cos^2 alpha) / rho^2 times rho^2.
        root = np.sqrt((1 - u) * cap * (2 - height - cap))
        to = column(self.center) - points
        distance = np.sqrt(dot(to, to))[:, None]
        return way * (distance * cone.k3[:, None] ** 2 / (1 - height + root))

    def _outside(self, points: Floats) -> np.ndarray:
        return outside(points, column(self.center), self.radius)

    def worth(self, points: Floats, d: Floats) -> Floats:
        out = np.zeros(d.shape[1:])
        k = np.flatnonzero(self._outside(points))
        if k.size:
            out[k] = 2 * math.pi * self._height(self._cones(points[:, k]))[:, None]
        return out

    def at(self, u: float, v: float) -> None:
        return None

    def hull(self) -> Floats:
        corners = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8)
        return column(self.center) + self.radius * corners

    def middle(self) -> tuple[Floats, float]:
        return column(self.center), self.radius

    def body(self) -> Body:
        return Body(balls=(Ellipsoid.sphere(self.center, self.radius),))

    def plane(self) -> None:
        return None

    def unshadowed(self, points: ShadingPoints, glossy: bool) -> tuple[Floats, Floats]:
        """Boundary integrals over the outline and, where it is cut, along the horizon (`round_patch`).

        Anywhere outside, touching included, for any exponent; inside nothing. Lambert against 40 digits: 7e-16 above
        the horizon, at any distance up to 1e12 radii; within its bound where it is cut, which is below 1e-8 down to
        1e-12 radii from the skin. The Phong lobe above both horizons against quadrature, to exponents of 500: 1e-13.
        """
        radiance, bound = round_patch(points, self._reaches(points), self._seen, glossy, "ball")
        return radiance * column(self.colour), bound

    def _reaches(self, points: ShadingPoints) -> np.ndarray:
        """Which points are outside, and have some of it above their horizon."""
        top = dot(points.normal, column(self.center) - points.position) + self.radius
        return np.asarray(self._outside(points.position) & (top > 0))

    def has_form(self, kind: type[Lobe]) -> bool:
        return kind.contour is not None

    def anchored(self) -> Floats:
        return column(self.center)

    def moved(self, origin: Floats) -> SphereLight:
        x, y, z = (np.array(self.center) - origin).tolist()
        return replace(self, center=(x, y, z))
