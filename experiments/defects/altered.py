"""Area sampling with one step replaced: what a wrong estimator is made of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from nusselt.renderer.estimators import Claim
from nusselt.renderer.lights import Light, colour
from nusselt.renderer.lights.sampling import one_place, unit_square
from nusselt.renderer.needs import Needs, Source
from nusselt.renderer.shading import ShadingPoints, reflect
from nusselt.renderer.vectors import Floats

Lay = Callable[[np.random.Generator, int, int, bool], tuple[Floats, Floats]]
Beam = Callable[[ShadingPoints, Light, Floats, Floats], tuple[Floats, Floats]]
Reflect = Callable[[ShadingPoints, Floats, Floats, bool], Floats]


def _same_beam(points: ShadingPoints, light: Light, d: Floats, weight: Floats) -> tuple[Floats, Floats]:
    return d, weight


def _see(source: Source, points: ShadingPoints, d: Floats, at_infinity: bool) -> Floats:
    return source.blockers.visible(points.position, points.ellipsoid, d, at_infinity).astype(np.float64)


@dataclass(frozen=True, kw_only=True)
class Altered:
    """The steps of `Area`, each of which a defect may replace.

    Parameters
    ----------
    source : callable
        The light and its blockers.
    lay : callable
        Points of the unit square, as `unit_square`.
    beam : callable
        Directions to the light points and what each is worth.
    shadow : callable
        Shadow rays from these directions.
    see : callable
        Their visibility.
    reflect : callable
        As `shading.reflect`.
    finish : callable
        The radiance (3, n) of one light.
    """

    samples: int = 64
    stratified: bool = True
    source: Callable[[Source], Source] = lambda source: source
    lay: Lay = unit_square
    beam: Beam = _same_beam
    shadow: Callable[[Floats], Floats] = lambda d: d
    see: Callable[[Source, ShadingPoints, Floats, bool], Floats] = _see
    reflect: Reflect = reflect
    finish: Callable[[Source, Floats], Floats] = lambda source, radiance: radiance
    name: ClassVar[str] = "area"
    summary: ClassVar[str] = "area sampling with a planted defect"
    shares_points: ClassVar[bool] = False

    def claim(self, needs: Needs) -> Claim:
        return "unbiased" if needs.random else "exact"

    def is_random(self, needs: Needs) -> bool:
        return needs.random

    def __call__(self, points: ShadingPoints, source: Source, rng: np.random.Generator) -> Floats:
        source = self.source(source)
        light = source.light
        u, v = self.lay(rng, points.count, self.samples, self.stratified) if light.has_extent else one_place()
        d, weight = light.beams(points.position, u, v)
        d, weight = self.beam(points, light, d, weight)
        seen = self.see(source, points, self.shadow(d), light.at_infinity)
        radiance = self.reflect(points, d, weight * seen, source.glossy) * colour(light)
        return self.finish(source, radiance)
