"""How far Mitsuba's float32 and its ray offset may move a ray, in the scene's own units."""

from __future__ import annotations

from nusselt.renderer.ambiguous_pixels import Tolerance
from nusselt.renderer.scene import Scene

from .placement import SIZE, place

ANGLE = 2e-6
"""Radians: sensor rays were found within 5.7e-7 of the formula, hit points within 1e-6 of the scene's size."""
LIFT = 8.940697e-05
"""math::RayEpsilon of Mitsuba up to 3.9: shadow rays start at p + n (1 + max|p|) LIFT."""
SLIDE = 2e-6
"""Error of a hit point along the surface, relative to the scene's half extent."""


def ray_tolerance(scene: Scene) -> Tolerance:
    """Pixels this close to an edge may fall to either side of it in Mitsuba."""
    placement = place(scene)
    if placement.wide:
        return Tolerance(ANGLE, LIFT, SLIDE, unit=placement.near, centre=placement.centre)
    half = placement.half
    return Tolerance(angle=ANGLE, lift=LIFT * (1 + SIZE) / SIZE * half, slide=SLIDE * half)
