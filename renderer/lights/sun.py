"""A uniform disk at infinity."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.lobes import Lobe
from nusselt.renderer.shading import ShadingPoints, reflect
from nusselt.renderer.validation import Vec3, colour, direction, finite
from nusselt.renderer.vectors import Floats, Ints, column, dot, frame

from .one_beam import CLOSED
from .plain import Plain
from .text import Text

ACROSS = 1e-2
"""Bound of the error of the lobe of a sun whose disk is cut by a horizon, or large against the lobe."""
RADII, ANGLES = 12, 24
"""Nodes over the disk for a glossy surface: Gauss-Legendre in the squared radius, equal steps around."""


@dataclass(frozen=True)
class SunLight(Plain):
    """A uniform disk at infinity, not seen by the camera.

    Its radiance is irradiance / (pi sin^2 alpha), alpha the half angle: exactly the irradiance named, on a
    plane that faces it.

    Parameters
    ----------
    direction : Vec3
        Towards the centre; made unit length.
    irradiance : Vec3
        On a plane that faces the centre, W m^-2.
    angle : float
        Full angular diameter 2 alpha in degrees, in (0, 180).
    """

    direction: Vec3
    irradiance: Vec3
    angle: float
    kind: ClassVar[str] = "sun"
    has_extent: ClassVar[bool] = True
    at_infinity: ClassVar[bool] = True
    area: ClassVar[float] = 0.0
    TEXT: ClassVar[Text] = Text("sun", "direction:xyz irradiance:rgb degrees")

    def __post_init__(self) -> None:
        object.__setattr__(self, "direction", direction("sun direction", self.direction))
        object.__setattr__(self, "irradiance", colour("sun irradiance", self.irradiance))
        object.__setattr__(self, "angle", finite("sun angle", self.angle))
        if not 0 < self.angle < 180:
            raise InputError("sun angle", self.angle, "an angular diameter in (0, 180) degrees")
        if math.sin(self.half_angle) ** 2 == 0 or math.isinf(max(self.radiance)):
            raise InputError("sun angle", self.angle, "an angle wide enough for the radiance to be finite")

    @property
    def half_angle(self) -> float:
        """alpha in radians."""
        return math.radians(self.angle) / 2

    @property
    def radiance(self) -> Vec3:
        """W m^-2 sr^-1."""
        r, g, b = (e / (math.pi * math.sin(self.half_angle) ** 2) for e in self.irradiance)
        return r, g, b

    @property
    def colour(self) -> Vec3:
        return self.irradiance

    def with_colour(self, rgb: Vec3) -> SunLight:
        return replace(self, irradiance=rgb)

    def directions(self, u: Floats, v: Floats) -> Floats:
        """Unit directions over the disk, (3, n, k), uniform in projected solid angle about its centre.

        Density 1/(pi sin^2 alpha): with the radiance E/(pi sin^2 alpha) a direction stands for E/N on a plane
        that faces the centre, and for E/N / cos(theta_centre) of radiance times solid angle on any plane.
        """
        axis = column(self.direction)
        x, y = frame(axis)
        sine = math.sin(self.half_angle) * np.sqrt(u)
        angle = 2 * math.pi * v
        cosine = np.sqrt(1 - sine * sine)
        across = x[:, :, None] * (sine * np.cos(angle)) + y[:, :, None] * (sine * np.sin(angle))
        return across + axis[:, :, None] * cosine

    def beams(self, points: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        n, k = points.shape[1], u.shape[1]
        d = self.directions(u, v)
        weight = 1 / (k * dot(column(self.direction)[:, :, None], d))
        return np.broadcast_to(d, (3, n, k)), np.array(np.broadcast_to(weight, (n, k)))

    def worth(self, points: Floats, d: Floats) -> Floats:
        return np.asarray(1 / dot(column(self.direction)[:, :, None], d))

    def at(self, u: float, v: float) -> Floats:
        return self.directions(np.array([[u]]), np.array([[v]]))[:, :, 0]

    def hull(self) -> Floats:
        axis, reach = self.middle()  # a square around the disk's cone
        x, y = frame(axis)
        return np.hstack([axis + reach * (sx * x + sy * y) for sx in (-1, 1) for sy in (-1, 1)])

    def middle(self) -> tuple[Floats, float]:
        return column(self.direction), math.tan(self.half_angle)

    def body(self) -> None:
        return None

    def plane(self) -> None:
        return None

    def irradiance_on(self, normals: Floats) -> Floats:
        """Irradiance on planes of the given normals, relative to a plane that faces the sun's centre.

        Lambert's boundary integral 1/2 of n.(u x du) along the cap's circle and the horizon. With
        theta the angle from the normal to the centre and alpha the cap's half angle, cos(phi0) = -cot(alpha)
        cot(theta) and psi the half width of the cap on the horizon, the part above the horizon gives
        phi0 sin^2(alpha) cos(theta) - sin(alpha) cos(alpha) sin(theta) sin(phi0) + psi; wholly above it,
        pi sin^2(alpha) cos(theta).

        Relative error: rounding wholly above; 1e-16/alpha^2 across the horizon, where terms of order alpha leave
        one of order alpha^3 (5e-12 for the sun's 0.25 degrees).

        Parameters
        ----------
        normals : (3, n) float64
            Unit normals.

        Returns
        -------
        (n,) float64
            Multiply by ``irradiance``.
        """
        alpha = self.half_angle
        sin_a, cos_a = math.sin(alpha), math.cos(alpha)
        cos_t = dot(column(self.direction), normals)
        x = normals - cos_t * column(self.direction)
        sin_t = np.sqrt(dot(x, x))  # from the perpendicular part: keeps its digits near the pole
        across = np.abs(cos_t) < sin_a
        cos_phi = np.clip(-cos_t * cos_a / np.where(across, sin_t * sin_a, 1.0), -1.0, 1.0)
        sin_phi = np.sqrt(1 - cos_phi * cos_phi)
        half_width = sin_a * sin_phi
        psi = np.arctan2(half_width, cos_a * sin_t - sin_a * cos_phi * cos_t)
        cut = np.arccos(cos_phi) * sin_a * sin_a * cos_t - sin_a * cos_a * sin_t * sin_phi + psi
        return np.where(across, np.maximum(cut, 0.0) / (math.pi * sin_a * sin_a), np.maximum(cos_t, 0.0))

    def unshadowed(self, points: ShadingPoints, glossy: bool) -> tuple[Floats, Floats]:
        """Closed form for Lambert, quadrature over the disk for the other lobes.

        The quadrature's relative error is below 1e-12 while the disk lies above both horizons and the exponent times
        alpha^2 is below about 100; across a horizon it is about 1/300 of the lobe's share.
        """
        out = points.diffuse * (self.irradiance_on(points.normal) / math.pi)
        shiny = _shiny(points) if glossy else np.empty(0, dtype=np.int64)
        for start in range(0, shiny.size, 4096):
            index = shiny[start : start + 4096]
            out[:, index] += self._lobes(points.take(index))
        return out * column(self.colour), self._bound(points, glossy)

    def has_form(self, kind: type[Lobe]) -> bool:
        return True

    def _lobes(self, points: ShadingPoints) -> Floats:
        nodes, weights = np.polynomial.legendre.leggauss(RADII)
        u = np.repeat((nodes + 1) / 2, ANGLES)[None]
        v = np.tile((np.arange(ANGLES) + 0.5) / ANGLES, RADII)[None]
        d = np.broadcast_to(self.directions(u, v), (3, points.count, u.size))
        share = np.repeat(weights / 2, ANGLES) / ANGLES / dot(column(self.direction)[:, :, None], d[:, :1])
        return reflect(points, d, share, True) - reflect(points, d, share, False)

    def _bound(self, points: ShadingPoints, glossy: bool) -> Floats:
        half, toward = self.half_angle, column(self.direction)
        out = np.full(points.count, max(CLOSED, 1e-15 / half**2))
        lowest = math.sin(half) * 1.001
        whole = (dot(points.normal, toward) > lowest) & (dot(points.mirror, toward) > lowest)
        for kind in points.reflecting(glossy):
            if kind.glossy:
                steep = kind.steepness(points) * half**2 > 100
                out[(points.albedo(kind).max(axis=0) > 0) & (steep | ~whole)] = ACROSS
        return out

    def anchored(self) -> Floats:
        return np.zeros((3, 0))

    def moved(self, origin: Floats) -> SunLight:
        return self


def _shiny(points: ShadingPoints) -> Ints:
    """The points with a lobe besides Lambert's."""
    there = np.zeros(points.count, dtype=bool)
    for kind in points.lobes:
        if kind.glossy:
            there |= (points.albedo(kind) > 0).any(axis=0)
    return np.flatnonzero(there)
