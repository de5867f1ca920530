"""Camera rays that slip between the triangles of one surface: the reference's own fault, found without our renderer.

Embree's robust mode holds at edges, not at vertices: of rays aimed at one, 1 in 140 passes through a fine mesh (its
triangles a pixel wide), up to 8 in 10,000 through coarse ones. So a ray is compared with four others, as close to it
as float32 can tell: where two on opposite sides both end nearer, it has passed between triangles. A slit that is
really there, and as narrow, is found too: no renderer in float32 knows what lies behind it.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from nusselt.mitsuba_bridge.tolerance import ANGLE

FARTHER = 50 * ANGLE
"""Relative length by which a ray must outreach its neighbours: in a pit, walls of 89 degrees bring as much."""


def slips_through(scene: Any, ray: Any) -> Any:
    """Whether each ray, in either kind of variant, ends beyond two neighbours with itself between them."""

    def reach(turn: Any) -> Any:
        turned = mi.Ray3f(ray)
        turned.d = ray.d + ANGLE * turn
        return scene.ray_intersect_preliminary(turned, coherent=False).t  # infinite where there is no hit

    # Two pairs: one may lie along a slit.
    pairs = [dr.maximum(reach(turn), reach(-turn)) for turn in mi.coordinate_system(ray.d)]
    return reach(mi.Vector3f(0)) > (1 + FARTHER) * dr.minimum(*pairs)
