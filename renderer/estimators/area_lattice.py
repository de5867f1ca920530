"""Area sampling with a shifted lattice in place of strata: any number of samples, and less noise where it is smooth.

L_r = L A/N sum_k f(w_k, w_o) max(n.w_k, 0) max(n_l.-w_k, 0)/R_k^2 V_k, the x_k on one rank-1 lattice over the light,
moved by a random shift of its own at every shading point. The shift makes it unbiased; a point's samples depend on
each other, pixels do not.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.lights import colour
from nusselt.renderer.lights.sampling import lattice
from nusselt.renderer.needs import Needs, Source
from nusselt.renderer.shading import ShadingPoints, reflect
from nusselt.renderer.vectors import Floats

from .area import Area
from .protocol import BLOCK, Claim


@dataclass(frozen=True, kw_only=True)
class AreaLattice:
    """N points per light; ``stratified`` is accepted and does nothing."""

    samples: int = 1
    stratified: bool = False
    name: ClassVar[str] = "area-lattice"
    summary: ClassVar[str] = "Monte Carlo over the light on a randomly shifted lattice, with shadow rays"
    shares_points: ClassVar[bool] = False

    def __post_init__(self) -> None:
        if self.samples < 1:
            raise InputError("samples", self.samples, "at least 1")

    def claim(self, needs: Needs) -> Claim:
        return "unbiased" if needs.random else "exact"

    def is_random(self, needs: Needs) -> bool:
        return needs.random

    def __call__(self, points: ShadingPoints, source: Source, rng: np.random.Generator) -> Floats:
        light = source.light
        if not light.has_extent:
            return Area()(points, source, rng)
        out = np.empty((3, points.count))
        step = max(1, BLOCK // self.samples)
        for start in range(0, points.count, step):
            some = points.take(np.arange(start, min(start + step, points.count)))
            d, weight = light.beams(some.position, *lattice(rng, some.count, self.samples))
            if not source.blockers.none:
                p, own = some.position, some.ellipsoid
                weight = weight * source.blockers.visible(p, own, d, light.at_infinity, some.normal)
            out[:, start : start + step] = reflect(some, d, weight, source.glossy)
        return out * colour(light)
