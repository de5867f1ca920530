"""What a light without extent gives: one beam."""

from __future__ import annotations

import numpy as np

from nusselt.renderer.shading import ShadingPoints, reflect
from nusselt.renderer.vectors import Floats, column

from .protocol import Light
from .sampling import one_place

CLOSED = 1e-12
"""Bound of a product of few factors, relative to its value; t^s adds its own."""


def one_beam(light: Light, points: ShadingPoints, glossy: bool) -> tuple[Floats, Floats]:
    """Its `Light.unshadowed`."""
    d, weight = light.beams(points.position, *one_place())
    steep = np.zeros(points.count)
    for kind in points.reflecting(glossy):
        steep = np.maximum(steep, kind.steepness(points))
    return reflect(points, d, weight, glossy) * column(light.colour), CLOSED * (1 + steep / 1000)
