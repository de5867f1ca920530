"""The lecture's first renderer: closed forms, no visibility, no noise.

Lambert's irradiance of a polygon and the modified Phong lobe over it, clipped at the horizon; the same boundary
integral for the sun's disk; I/R^2 and E cos for the lights without extent.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from nusselt.renderer.light_points import beams, colour
from nusselt.renderer.lights import QuadLight, SunLight
from nusselt.renderer.needs import Needs, Source
from nusselt.renderer.shading import ShadingPoints, reflect
from nusselt.renderer.unshadowed import quad_light, sun_light
from nusselt.renderer.vectors import Floats, column, dot

from .protocol import Claim


@dataclass(frozen=True, kw_only=True)
class Analytic:
    """Closed form per light; ``samples`` and ``stratified`` are accepted and do nothing."""

    samples: int = 1
    stratified: bool = False
    name: ClassVar[str] = "analytic"
    summary: ClassVar[str] = "closed form per light, diffuse and glossy, no visibility: exact where nothing blocks"
    shares_points: ClassVar[bool] = False

    def claim(self, needs: Needs) -> Claim:
        return "biased" if needs.visibility else "exact"

    def is_random(self, needs: Needs) -> bool:
        return False

    def __call__(self, points: ShadingPoints, source: Source, rng: np.random.Generator) -> Floats:
        return without_shadows(points, source)


def without_shadows(points: ShadingPoints, source: Source) -> Floats:
    """Reflected radiance (3, n) as if nothing blocked, in closed form."""
    return closed_form(points, source)[0]


def closed_form(points: ShadingPoints, source: Source) -> tuple[Floats, Floats]:
    """The same, and a bound (n,) of its relative error."""
    light = source.light
    if isinstance(light, QuadLight):
        return quad_light(points, light, source.glossy)
    if isinstance(light, SunLight):
        return sun_light(points, light, source.glossy), _sun_bound(points, light, source.glossy)
    d, weight, _ = beams(light, points.position, np.random.default_rng(0), 1, False)
    steep = CLOSED * (1 + points.shininess * source.glossy / 1000)
    return reflect(points, d, weight, source.glossy) * colour(light), steep


CLOSED = 1e-12
"""Bound of a product of few factors, relative to its value; t^s adds its own."""
ACROSS = 1e-2
"""Of the lobe of a sun whose disk is cut by a horizon, or large against the lobe."""


def _sun_bound(points: ShadingPoints, light: SunLight, glossy: bool) -> Floats:
    """See `sun_irradiance` and `sun_light`."""
    half, toward = light.half_angle, column(light.direction)
    out = np.full(points.count, max(CLOSED, 1e-15 / half**2))
    lowest = math.sin(half) * 1.001
    whole = (dot(points.normal, toward) > lowest) & (dot(points.mirror, toward) > lowest)
    steep = points.shininess * half**2 > 100
    out[(points.specular.max(axis=0) > 0) & (steep | ~whole) & glossy] = ACROSS
    return out
