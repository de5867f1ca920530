"""Where a scene leaves the range in which Mitsuba is right: said in plain sentences, not hidden.

Up to version 3.9 a shadow ray ends at 1 - 8.94e-4 of its way to the light. A blocker beyond is not seen: 45 % of
the full light was found to come through one.
"""

from __future__ import annotations

import numpy as np

from nusselt.renderer.geometry.arrays import build_geometry
from nusselt.renderer.scene import Scene

from .lights import clearance

CLOSE = 1e-3
"""Blockers closer to a light than this share of the shadow ray's length are ignored by Mitsuba 3.9."""


def close_blockers(scene: Scene, half: float) -> list[str]:
    """A sentence for every light with a surface so close before it that Mitsuba 3.9 may look past it.

    Parameters
    ----------
    half : float
        Half extent of the scene; no shadow ray is longer than its diagonal, 2 sqrt(3) half.
    """
    geometry = build_geometry(scene)
    owner = geometry.light[geometry.triangle_surface]
    reach = CLOSE * 2 * 3**0.5 * half
    notes = []
    for number, light in enumerate(scene.lights):
        distance = clearance(light, geometry, np.flatnonzero(owner != number))
        if distance < reach:
            where = f"lies {distance:.2g} before" if distance > 1e-9 * half else "touches"
            notes.append(
                f"a surface {where} light {number + 1}: Mitsuba up to 3.9 looks past what is closer to a light "
                f"than a thousandth of the way (here up to {reach:.2g})"
            )
    return notes
