"""What a flat one-sided light shows to points: whether its front, and how much of their sky."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.vectors import Floats, cross, dot
from nusselt.renderer.watertight import PLANE_ULPS, largest, one_norm


def faced_by(corner: Floats, ab: Floats, ac: Floats, points: Floats) -> NDArray[np.bool_]:
    """Which points (3, n) the parallelogram corner + u ab + v ac shines on: before it by more than rounding.

    A surface in the light's own plane sees it edge-on, and gets nothing. By how little rounding lifts a point of it off
    that plane does not matter to the light: to a point right before it, it fills half the sky. So points within the
    rounding of the plane's equation count as on it, as for shadow rays (see `segments`); the edges' product is known to
    rounding of its own, which tells where they are nearly parallel.

    Parameters
    ----------
    corner, ab, ac : (3, 1) or (3, n) float64
        Emits on the side of -(ab x ac).
    """
    normal, way = cross(ab, ac), corner - points
    bound = one_norm(normal) * (largest(corner) + largest(points)) + largest(ab) * largest(ac) * largest(way)
    return np.asarray(dot(normal, way) > PLANE_ULPS * bound)


def solid_angle(inwards: Floats, d: Floats) -> Floats:
    """Solid angle (n, k) that an area stands for along ways d (3, n, k) to it: A cos(theta_l) / R^2, 0 at its back.

    A cos(theta_l) R = a . d with a, (3, 1) or one for each way, as long as the area and pointing out at the back: no
    unit normal is needed.
    """
    length2 = dot(d, d)
    facing = np.maximum(dot(inwards if inwards.ndim == 3 else inwards[:, :, None], d), 0)
    # A point that lies on the light itself sees it edge-on: nothing, not 0/0.
    return np.divide(facing, length2 * np.sqrt(length2), out=np.zeros_like(facing), where=length2 > 0)
