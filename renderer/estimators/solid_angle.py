"""Monte Carlo over the solid angle under which a point sees the light: its distance no longer counts.

L_r = L Omega/N sum_k f(w_k, w_o) max(n.w_k, 0) V_k, directions w_k of density 1/Omega over the light's whole outline,
independent or one in each of N equal strata; what lies below the horizon brings nothing. Near a light the integrand
stays bounded where that over the area does not: 5 cm over a floor, a lamp of 1 m and 16 strata, the variance is 3,000
times smaller (20 times at the median pixel). For a light that is small for its distance the two are alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from nusselt.renderer.lights import Light
from nusselt.renderer.lights.sampling import unit_square
from nusselt.renderer.vectors import Floats

from .area import Area


@dataclass(frozen=True, kw_only=True)
class SolidAngle(Area):
    """N directions per light: to quads and triangles by `lights/spherical_fan.py`, to the other kinds as `Area`.

    To rectangles, where they are not small, by `lights/spherical_rectangle.py`, whose strata are quieter.

    Balls, skies and suns are sampled in solid angle there too.
    """

    name: ClassVar[str] = "solid-angle"
    summary: ClassVar[str] = "Monte Carlo over the solid angle of quads and triangles, with shadow rays"

    def _draw(self, light: Light, points: Floats, rng: np.random.Generator, samples: int) -> tuple[Floats, Floats]:
        if not light.has_extent:
            return super()._draw(light, points, rng, samples)
        return light.solid_beams(points, *unit_square(rng, points.shape[1], samples, self.stratified))
