"""Noise from visibility alone: everything else at the centre of each stratum (lecture, slide 27).

L_r = L A/N sum_k f(c_k) G(c_k) V(x_k), c_k the centre of stratum k and x_k a random point in it. Where nothing
blocks there is no noise, but the midpoint rule's error, O(1/N), is there for every light near by.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from nusselt.renderer.lights import colour
from nusselt.renderer.lights.sampling import random_beams, stratum_centres
from nusselt.renderer.needs import Needs, Source
from nusselt.renderer.shading import ShadingPoints, reflect
from nusselt.renderer.vectors import Floats

from .protocol import BLOCK, Claim, square_number


@dataclass(frozen=True, kw_only=True)
class VisibilityCentre:
    """N strata per light; ``samples`` must be a square, and the points are always stratified."""

    samples: int = 1
    stratified: bool = True
    name: ClassVar[str] = "visibility-centre"
    summary: ClassVar[str] = "random visibility, all else at the centre of each stratum: no noise where nothing blocks"
    shares_points: ClassVar[bool] = False

    def __post_init__(self) -> None:
        square_number(self.samples)

    def claim(self, needs: Needs) -> Claim:
        return "consistent" if needs.random else "exact"

    def is_random(self, needs: Needs) -> bool:
        return needs.random and needs.visibility

    def __call__(self, points: ShadingPoints, source: Source, rng: np.random.Generator) -> Floats:
        out = np.empty((3, points.count))
        step = max(1, BLOCK // self.samples)
        for start in range(0, points.count, step):
            some = np.arange(start, min(start + step, points.count))
            out[:, some] = self._block(points.take(some), source, rng)
        return out * colour(source.light)

    def _block(self, points: ShadingPoints, source: Source, rng: np.random.Generator) -> Floats:
        light = source.light
        d, weight = light.beams(points.position, *stratum_centres(self.samples))
        towards, _ = random_beams(light, points.position, rng, self.samples, True)
        if not source.blockers.none:
            weight = weight * source.blockers.visible(
                points.position, points.ellipsoid, towards, light.at_infinity, points.normal
            )
        return reflect(points, d, weight, source.glossy)
