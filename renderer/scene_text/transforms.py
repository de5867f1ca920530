"""Affine maps as a scene file builds them: the command nearest the geometry acts first.

Sums are written out and elementwise, never BLAS: the same vertex under the same map must come out the same
to the last bit whatever else is transformed beside it, or neighbouring triangles would part at their edge.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.errors import InputError
from nusselt.renderer.surfaces import Floats
from nusselt.renderer.validation import Vec3

Row: TypeAlias = tuple[float, float, float, float]
Affine: TypeAlias = tuple[Row, Row, Row]  # x -> the first three columns times x, plus the fourth

IDENTITY: Affine = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0))


def translation(offset: Vec3) -> Affine:
    """x -> x + offset."""
    x, y, z = offset
    return (1.0, 0.0, 0.0, x), (0.0, 1.0, 0.0, y), (0.0, 0.0, 1.0, z)


def scaling(factors: Vec3) -> Affine:
    """Each component times its factor; a negative one mirrors."""
    x, y, z = factors
    return (x, 0.0, 0.0, 0.0), (0.0, y, 0.0, 0.0), (0.0, 0.0, z, 0.0)


def _cos_sin(degrees: float) -> tuple[float, float]:
    """Cosine and sine; exact at right angles, so that a box turned by 90 stays a box."""
    degrees = math.fmod(degrees, 360.0)
    if degrees % 90 == 0:
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[int(degrees // 90) % 4]
    angle = math.radians(degrees)
    return math.cos(angle), math.sin(angle)


def rotation(axis: Vec3, degrees: float) -> Affine:
    """Right-handed turn by ``degrees`` about ``axis`` (any length but zero), by Rodrigues' formula."""
    largest = max(map(abs, axis))  # first: squares of 1e-200 vanish
    if largest == 0:
        raise InputError("rotate axis", axis, "a direction that is not zero")
    x, y, z = (a / largest for a in axis)
    length = math.sqrt(x * x + y * y + z * z)
    x, y, z = x / length, y / length, z / length
    c, s = _cos_sin(degrees)
    k = 1.0 - c
    return (
        (c + k * x * x, k * x * y - s * z, k * x * z + s * y, 0.0),
        (k * y * x + s * z, c + k * y * y, k * y * z - s * x, 0.0),
        (k * z * x - s * y, k * z * y + s * x, c + k * z * z, 0.0),
    )


def compose(outer: Affine, inner: Affine) -> Affine:
    """The map that applies ``inner`` first."""
    (ax, ay, az, at), (bx, by, bz, bt), (cx, cy, cz, ct) = inner
    first, second, third = (
        (
            x * ax + y * bx + z * cx,
            x * ay + y * by + z * cy,
            x * az + y * bz + z * cz,
            x * at + y * bt + z * ct + t,
        )
        for x, y, z, t in outer
    )
    return first, second, third


def is_finite(affine: Affine) -> bool:
    """Whether no entry has overflowed."""
    return all(math.isfinite(entry) for row in affine for entry in row)


def apply(affine: Affine, point: Vec3) -> Vec3:
    """The image of one point."""
    px, py, pz = point
    x, y, z = (a * px + b * py + c * pz + d for a, b, c, d in affine)
    return x, y, z


def apply_each(affines: Floats, which: NDArray[np.intp], points: Floats) -> Floats:
    """Map every point by its own affine.

    Parameters
    ----------
    affines : (m, 3, 4) float64
        The maps.
    which : (n,) int
        For each point, the index of its map.
    points : (3, n) float64

    Returns
    -------
    (3, n) float64
    """
    x, y, z = points
    rows = (affines[which, row].T for row in range(3))
    return np.stack([a * x + b * y + c * z + d for a, b, c, d in rows])
