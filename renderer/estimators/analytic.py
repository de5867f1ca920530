"""The lecture's first renderer: closed forms, no visibility, no noise.

Lambert's irradiance of a polygon and the modified Phong lobe over it, clipped at the horizon; the same boundary
integral for the sun's disk; I/R^2 and E cos for the lights without extent.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from nusselt.renderer.needs import Needs, Source
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats

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
    return source.light.unshadowed(points, source.glossy)
