"""The same radiance from everywhere."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from nusselt.renderer.closed_forms.circles.cones import Rounds
from nusselt.renderer.lobes import Lobe
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.validation import Vec3, colour
from nusselt.renderer.vectors import Floats, column, frame

from .plain import Plain
from .round_patch import round_patch
from .text import Text

ABOVE = 8 * float(np.finfo(np.float64).eps)
"""Height of a cone that no rounding of normals lets sink below the horizon; what is lost has that for a cosine too."""


@dataclass(frozen=True)
class SkyLight(Plain):
    """A constant environment: it shines from every direction that no surface hides, and is seen where there is none.

    To masks it is the background, which then is not black.

    Parameters
    ----------
    radiance : Vec3
        W m^-2 sr^-1.
    """

    radiance: Vec3
    kind: ClassVar[str] = "sky"
    has_extent: ClassVar[bool] = True
    at_infinity: ClassVar[bool] = True
    surrounds: ClassVar[bool] = True
    area: ClassVar[float] = 0.0
    TEXT: ClassVar[Text] = Text("sky", "radiance:rgb")

    def __post_init__(self) -> None:
        object.__setattr__(self, "radiance", colour("sky radiance", self.radiance))

    @property
    def colour(self) -> Vec3:
        return self.radiance

    def with_colour(self, rgb: Vec3) -> SkyLight:
        return replace(self, radiance=rgb)

    def directions(self, u: Floats, v: Floats) -> Floats:
        """Unit directions (3, n, k), uniform over the sphere: density 1/(4 pi). u turns about z, v goes down it."""
        height, angle = 1 - 2 * v, 2 * math.pi * u
        across = np.sqrt(np.maximum(1 - height * height, 0.0))
        return np.stack((across * np.cos(angle), across * np.sin(angle), height))

    def beams(self, points: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        """Half of them from below the horizon: the points' normals are not known here."""
        n, k = points.shape[1], u.shape[1]
        d = np.broadcast_to(self.directions(u, v), (3, n, k))
        return d, self.worth(points, d) / k

    def worth(self, points: Floats, d: Floats) -> Floats:
        return np.full(d.shape[1:], 4 * math.pi)

    def at(self, u: float, v: float) -> Floats:
        return self.directions(np.array([[u]]), np.array([[v]]))[:, :, 0]

    def hull(self) -> Floats:
        return np.hstack((np.eye(3), -np.eye(3)))

    def middle(self) -> tuple[Floats, float]:
        return column((0.0, 0.0, 1.0)), math.inf

    def body(self) -> None:
        return None

    def plane(self) -> None:
        return None

    def unshadowed(self, points: ShadingPoints, glossy: bool) -> tuple[Floats, Floats]:
        """Lambert's lobe reflects its albedo times the radiance; the others by boundary integrals along the horizon.

        The Phong lobe at exponents from 0 to 1000 and mirrors up to 1e-6 of grazing: right to the 2e-9 of the
        quadrature that it was held to, bounds below 1e-6; at an exponent of 0 none where the mirror is the normal.
        """
        radiance, bound = round_patch(points, np.ones(points.count, dtype=bool), _hemisphere, glossy, "sky")
        return radiance * column(self.colour), bound

    def has_form(self, kind: type[Lobe]) -> bool:
        return kind.contour is not None

    def anchored(self) -> Floats:
        return np.zeros((3, 0))

    def moved(self, origin: Floats) -> SkyLight:
        return self


def _hemisphere(points: ShadingPoints) -> tuple[Rounds, Floats]:
    """What lies above the horizon, by more than its rounding, as a cone; see `Seen`."""
    n, (e1, e2), above = points.count, frame(points.normal), np.full(points.count, ABOVE)
    return Rounds(np.arange(n), e1, e2, points.normal, np.zeros(n), above, np.ones(n), True), 2 * math.pi * above**2
