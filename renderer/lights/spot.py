"""A lamp without extent that shines into a cone."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.validation import Vec3, colour, direction, finite, vector
from nusselt.renderer.vectors import Bools, Floats, column, cross, dot

from .body import Plane
from .one_beam import OneBeam
from .text import Text

EPS = float(np.finfo(np.float64).eps)
ANGLE = 8.0
"""Roundings of an angle about the axis, in units of eps: radians."""


@dataclass(frozen=True)
class SpotLight(OneBeam):
    """Irradiance intensity fall(theta) cos / R^2 at distance R, theta the angle from the axis.

    fall is 1 up to ``begin``, 0 from ``cutoff`` on, and linear in the angle between: Mitsuba's `spot`, whose default
    is begin = 3/4 cutoff. The flux of each channel is 2 pi intensity times (1 - cos begin) plus what falls off.

    Parameters
    ----------
    position : Vec3
    direction : Vec3
        *Away* from the lamp, along the axis; made unit length.
    cutoff, begin : float
        Half angles of the cone in degrees, 0 <= begin < cutoff <= 180.
    intensity : Vec3
        Radiant intensity on the axis, W/sr.
    """

    position: Vec3
    direction: Vec3
    cutoff: float
    begin: float
    intensity: Vec3
    kind: ClassVar[str] = "spot"
    at_infinity: ClassVar[bool] = False
    TEXT: ClassVar[Text] = Text("spotLight", "position:xyz direction:xyz cutoff begin intensity:rgb")

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", vector("spotLight position", self.position))
        object.__setattr__(self, "direction", direction("spotLight direction", self.direction))
        object.__setattr__(self, "intensity", colour("spotLight intensity", self.intensity))
        for name in ("cutoff", "begin"):
            object.__setattr__(self, name, finite(f"spotLight {name}", getattr(self, name)))
        if not 0 < self.cutoff <= 180:
            raise InputError("spotLight cutoff", self.cutoff, "a half angle in (0, 180] degrees")
        if not 0 <= self.begin < self.cutoff:
            raise InputError("spotLight begin", self.begin, f"a half angle in [0, {self.cutoff:g}) degrees")

    @property
    def colour(self) -> Vec3:
        return self.intensity

    def with_colour(self, rgb: Vec3) -> SpotLight:
        return replace(self, intensity=rgb)

    def beams(self, points: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        d = (column(self.position) - points)[:, :, None]
        return d, self.worth(points, d)

    def worth(self, points: Floats, d: Floats) -> Floats:
        square = dot(d, d)
        inside = np.maximum(math.radians(self.cutoff) - self._angle(d), 0.0)
        fall = np.minimum(inside / math.radians(self.cutoff - self.begin), 1.0)
        return np.divide(fall, square, out=np.zeros_like(square), where=square > 0)

    def _angle(self, d: Floats) -> Floats:
        """From the axis to ways d (3, n, k) towards the lamp, reversed; to ANGLE eps."""
        axis = np.broadcast_to(column(self.direction)[:, :, None], d.shape)
        across = cross(axis, d)
        return np.asarray(np.arctan2(np.sqrt(dot(across, across)), -dot(axis, d)))

    def doubt(self, d: Floats) -> Floats:
        """What falls off is a difference of angles."""
        inside = math.radians(self.cutoff) - self._angle(d)[:, 0]
        falls = (inside > 0) & (inside < math.radians(self.cutoff - self.begin))
        return np.where(falls, ANGLE * EPS / np.where(falls, inside, 1.0), 0.0)

    def rim_within(self, points: Floats, radius: Floats) -> Bools:
        """Both cones': where the light ends, and where it begins to."""
        d = column(self.position) - points
        room = np.arctan2(radius, np.sqrt(np.maximum(dot(d, d) - radius * radius, 0.0)))
        angle = self._angle(d[:, :, None])[:, 0]
        crossed = [np.abs(angle - math.radians(rim)) <= room for rim in (self.cutoff, self.begin) if rim > 0]
        return np.logical_or.reduce(crossed)

    def without_rim(self) -> SpotLight:
        return replace(self, cutoff=180.0, begin=179.0)

    def at(self, u: float, v: float) -> Floats:
        return column(self.position)

    def plane(self) -> Plane | None:
        """That of its place, if the cone lies before it."""
        return (column(self.direction), column(self.position)) if self.cutoff <= 90 else None

    def anchored(self) -> Floats:
        return column(self.position)

    def moved(self, origin: Floats) -> SpotLight:
        x, y, z = (np.array(self.position) - origin).tolist()
        return replace(self, position=(x, y, z))
