"""Shadow rays that start off the surface and stop short of the light, as other renderers' do.

Ours need neither (see `segments`). The rule is here so that an image can be made that is wrong in the same way:
from p + n lift (unit + max|p - centre|), and to (1 - short) of the way to the light.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.renderer.validation import Vec3
from nusselt.renderer.vectors import Floats, column


@dataclass(frozen=True)
class RayOffset:
    """The rule, in the scene's own units.

    Parameters
    ----------
    lift, short : float
        Relative: off the surface along its normal, and of the way to a light at a finite distance.
    unit : float
        The length that is 1 to the other renderer: its offset is absolute near its origin.
    centre : Vec3
        That origin.
    """

    lift: float
    short: float
    unit: float = 1.0
    centre: Vec3 = (0.0, 0.0, 0.0)

    def moved(self, points: Floats, normal: Floats, d: Floats, at_infinity: bool) -> tuple[Floats, Floats]:
        """Where the rays from points (3, n) with unit normals (3, n) start, and how far they go, (3, n, k)."""
        away = np.abs(points - column(self.centre)).max(axis=0, initial=0.0)
        step = normal * (self.lift * (self.unit + away))
        if at_infinity:
            return points + step, d
        return points + step, (d - step[:, :, None]) * (1 - self.short)
