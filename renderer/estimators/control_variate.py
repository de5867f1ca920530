"""The unshadowed closed form minus a Monte Carlo estimate of what is hidden.

L_r = U - L A/N sum_k f(w_k) G(x_k) (1 - V_k): a control variate whose integral is known (Owen & Zhou 2000), with
coefficient one. Unbiased; exact where nothing blocks, and no better than plain sampling where the light is hidden.
Lights that have no closed form for a surface's lobe are sampled plainly.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from nusselt.renderer.lights import colour
from nusselt.renderer.lights.sampling import random_beams
from nusselt.renderer.needs import Needs, Source
from nusselt.renderer.shading import ShadingPoints, reflect
from nusselt.renderer.vectors import Floats

from .analytic import without_shadows
from .area import Area
from .protocol import BLOCK, Claim, square_number


@dataclass(frozen=True, kw_only=True)
class ControlVariate:
    """N points per light, independent or stratified."""

    samples: int = 1
    stratified: bool = False
    name: ClassVar[str] = "control-variate"
    summary: ClassVar[str] = "closed form minus what a Monte Carlo estimate finds hidden: unbiased, exact where lit"
    shares_points: ClassVar[bool] = False

    def __post_init__(self) -> None:
        if self.stratified:
            square_number(self.samples)

    def claim(self, needs: Needs) -> Claim:
        return "unbiased" if self.is_random(needs) else "exact"

    def is_random(self, needs: Needs) -> bool:
        return (needs.random and needs.visibility) or needs.without_form

    def __call__(self, points: ShadingPoints, source: Source, rng: np.random.Generator) -> Floats:
        if source.without_form:
            return Area(samples=self.samples, stratified=self.stratified)(points, source, rng)
        out = without_shadows(points, source)
        if source.blockers.none:
            return out
        samples = self.samples if source.has_extent else 1
        step = max(1, BLOCK // samples)
        for start in range(0, points.count, step):
            some = np.arange(start, min(start + step, points.count))
            out[:, some] -= self._hidden(points.take(some), source, rng, samples)
        return out

    def _hidden(self, points: ShadingPoints, source: Source, rng: np.random.Generator, samples: int) -> Floats:
        light = source.light
        d, weight = random_beams(light, points.position, rng, samples, self.stratified)
        hidden = ~source.blockers.visible(points.position, points.ellipsoid, d, light.at_infinity, points.normal)
        return reflect(points, d, weight * hidden, source.glossy) * colour(light)
