"""Monte Carlo over the light's area: the lecture's general direct lighting.

L_r = L A/N sum_k f(w_k, w_o) max(n.w_k, 0) max(n_l.-w_k, 0)/R_k^2 V_k, points x_k uniform in area,
independent or one in each of N equal strata (Ramamoorthi, CSE 168, lecture 6). All lights are summed, none
is chosen. Near a light the integrand has no bound: the variance grows as 1/distance^2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.lights import Light, colour
from nusselt.renderer.lights.sampling import random_beams
from nusselt.renderer.needs import Needs, Source
from nusselt.renderer.shading import ShadingPoints, reflect
from nusselt.renderer.vectors import Floats, dot

from .protocol import BLOCK, Claim, square_number


@dataclass(frozen=True, kw_only=True)
class Area:
    """N points per light, uniform in area; point and directional lights take one."""

    samples: int = 1
    stratified: bool = False
    name: ClassVar[str] = "area"
    summary: ClassVar[str] = "Monte Carlo over the light, random or stratified, with shadow rays"
    shares_points: ClassVar[bool] = False

    def __post_init__(self) -> None:
        if self.samples < 1:
            raise InputError("samples", self.samples, "at least 1")
        if self.stratified:
            square_number(self.samples)

    def claim(self, needs: Needs) -> Claim:
        return "unbiased" if needs.random else "exact"

    def is_random(self, needs: Needs) -> bool:
        return needs.random

    def __call__(self, points: ShadingPoints, source: Source, rng: np.random.Generator) -> Floats:
        out = np.empty((3, points.count))
        samples = self.samples if source.has_extent else 1
        step = max(1, BLOCK // samples)
        for start in range(0, points.count, step):
            some = np.arange(start, min(start + step, points.count))
            out[:, some] = self._block(points.take(some), source, rng, samples)
        return out * colour(source.light)

    def _draw(self, light: Light, points: Floats, rng: np.random.Generator, samples: int) -> tuple[Floats, Floats]:
        """Random beams (see `Light.beams`) from points (3, n)."""
        return random_beams(light, points, rng, samples, self.stratified)

    def _block(self, points: ShadingPoints, source: Source, rng: np.random.Generator, samples: int) -> Floats:
        light = source.light
        d, weight = self._draw(light, points.position, rng, samples)
        if not source.blockers.none:
            reaches = (weight > 0) & (dot(points.normal[:, :, None], d) > 0)
            lit = np.flatnonzero(reaches.any(axis=1))  # the others have nothing to lose to a shadow
            p, own = points.position[:, lit], points.ellipsoid[lit]
            weight[lit] *= source.blockers.visible(p, own, d[:, lit], light.at_infinity, points.normal[:, lit])
        return reflect(points, d, weight, source.glossy)
