"""The lecture's first renderer: closed forms, no visibility, no noise.

Lambert's irradiance of a polygon (Arvo 1994), clipped at the horizon; the same boundary integral for the
sun's disk; I/R^2 and E cos for the lights without extent.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..errors import InputError
from ..irradiance import irradiance
from ..light_points import beams, colour
from ..needs import Needs, Source
from ..scene import QuadLight, SunLight
from ..shading import ShadingPoints, reflect
from ..sun import sun_irradiance
from ..vectors import Floats, column, cross, dot
from .protocol import Claim


@dataclass(frozen=True, kw_only=True)
class Analytic:
    """Closed form per light; ``samples`` and ``stratified`` are accepted and do nothing."""

    samples: int = 1
    stratified: bool = False
    name: ClassVar[str] = "analytic"
    summary: ClassVar[str] = "closed form per light, no visibility: exact where nothing blocks"

    def claim(self, needs: Needs) -> Claim:
        return "biased" if needs.visibility else "exact"

    def is_random(self, needs: Needs) -> bool:
        return False

    def __call__(self, points: ShadingPoints, source: Source, rng: np.random.Generator) -> Floats:
        light = source.light
        if isinstance(light, QuadLight | SunLight) and source.glossy and points.is_glossy:
            raise InputError("estimator", self.name, "a scene whose surfaces are all diffuse (specular 0)")
        if isinstance(light, QuadLight):
            value, _ = irradiance(points.position, points.normal, light.corner, light.ab, light.ac)
            # The closed form sees both sides of the light; it emits on the side of -(ab x ac) only.
            toward = dot(cross(column(light.ab), column(light.ac)), column(light.corner) - points.position)
            return points.diffuse * (value * (toward > 0) / math.pi) * colour(light)
        if isinstance(light, SunLight):
            return points.diffuse * (sun_irradiance(light, points.normal) / math.pi) * colour(light)
        d, weight, _ = beams(light, points.position, rng, 1, False)
        return reflect(points, d, weight, source.glossy) * colour(light)
