"""Noise from visibility alone: everything else in closed form over each stratum (lecture, slide 27).

L_r = sum over strata of U_k V(x_k), U_k the stratum's unshadowed radiance and x_k a random point in it. Exact where
nothing blocks. Within a stratum V is averaged by area and not by the integrand: a bias that vanishes as the strata
shrink. Never the whole light's U times the mean of V: that bias stays, 4 to 6 % in penumbrae.

Lights that are no parallelogram, or that have no closed form for a surface's lobe, are taken at the centres of their
strata.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from nusselt.renderer.lights import QuadLight, colour
from nusselt.renderer.lights.quad_patch import quad_patch
from nusselt.renderer.lights.sampling import random_beams, stratum_centres
from nusselt.renderer.needs import Needs, Source
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats, column

from .analytic import without_shadows
from .protocol import BLOCK, Claim, square_number
from .visibility_centre import VisibilityCentre


@dataclass(frozen=True, kw_only=True)
class VisibilityAnalytic:
    """N strata per light; ``samples`` must be a square, and the points are always stratified."""

    samples: int = 1
    stratified: bool = True
    name: ClassVar[str] = "visibility-analytic"
    summary: ClassVar[str] = "random visibility, all else in closed form per stratum: exact where nothing blocks"
    shares_points: ClassVar[bool] = False

    def __post_init__(self) -> None:
        square_number(self.samples)

    def claim(self, needs: Needs) -> Claim:
        return "consistent" if (needs.random and needs.visibility) or needs.without_form else "exact"

    def is_random(self, needs: Needs) -> bool:
        return needs.random and needs.visibility

    def __call__(self, points: ShadingPoints, source: Source, rng: np.random.Generator) -> Floats:
        if not source.has_extent:
            return VisibilityCentre()(points, source, rng)
        quad = source.light.parallelogram()
        if source.blockers.none and not source.without_form:
            return without_shadows(points, source)
        if quad is None or source.without_form:
            return VisibilityCentre(samples=self.samples)(points, source, rng)
        out = np.empty((3, points.count))
        step = max(1, BLOCK // self.samples)
        for start in range(0, points.count, step):
            some = np.arange(start, min(start + step, points.count))
            out[:, some] = self._block(points.take(some), source, quad, rng)
        return out

    def _block(self, points: ShadingPoints, source: Source, light: QuadLight, rng: np.random.Generator) -> Floats:
        d, _ = random_beams(light, points.position, rng, self.samples, True)
        seen = source.blockers.visible(points.position, points.ellipsoid, d, False, points.normal)
        out = np.zeros((3, points.count))
        whole = np.flatnonzero(seen.all(axis=1))
        if whole.size:  # the strata's closed forms add up to the light's
            out[:, whole] = without_shadows(points.take(whole), source)
        part = np.flatnonzero(seen.any(axis=1) & ~seen.all(axis=1))
        if part.size:
            strata = self._strata(points.take(part), light, source.glossy)
            out[:, part] = (strata * seen[part]).sum(axis=2) * colour(light)
        return out

    def _strata(self, points: ShadingPoints, light: QuadLight, glossy: bool) -> Floats:
        """Unshadowed radiance (3, n, N) of each stratum for unit radiance."""
        n, side = points.count, math.isqrt(self.samples)
        ab, ac = column(light.ab) / side, column(light.ac) / side
        u, v = (centre - 0.5 / side for centre in stratum_centres(self.samples))
        corners = column(light.corner) + column(light.ab) * u + column(light.ac) * v  # (3, N)
        radiance, _ = quad_patch(points.repeated(self.samples), np.tile(corners, (1, n)), ab, ac, glossy)
        return radiance.reshape(3, n, self.samples)
