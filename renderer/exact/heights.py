"""On which side of the plane through a point and an edge another corner lies, right where float64 cannot tell.

A sliver seen nearly edge-on has planes that all but coincide; where it touches the light (a light of a neighbour's
edge, a wall that a lamp hangs on) the float64 product is below its own rounding, and one wrong sign leaves out a whole
arc: up to all of the light. The product of three vectors that are given exactly is then taken in double-double.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..closed_forms import double_double as dd
from ..vectors import Floats

ROUNDING = 32 * 2.0**-53
"""Rounding of the product, in products of the vectors' largest components."""


def sharpened(height: Floats, a: Floats, b: Floats, c: Floats, there: NDArray[np.bool_] | None = None) -> Floats:
    """Triple products (a x b) . c, with those that rounding could have turned taken again; in place.

    Parameters
    ----------
    height : (i, j, q) float64
        As float64 has them.
    a, b : (3, i, q) float64
    c : (3, j, q) float64
    there : (i, q) bool, optional
        Which a, b are an edge; the products of others stay as they are.
    """
    size = np.abs(height)
    if there is not None:
        size[np.broadcast_to(~there[:, None], size.shape)] = np.inf
    bound = np.abs(a).max(axis=(0, 1)) * np.abs(b).max(axis=(0, 1)) * np.abs(c).max(axis=(0, 1))
    some = np.flatnonzero(size.min(axis=(0, 1)) <= ROUNDING * bound)
    if some.size:
        height[..., some] = _triple(a[:, :, None, some], b[:, :, None, some], c[:, None, :, some])
    return height


def _triple(a: Floats, b: Floats, c: Floats) -> Floats:
    return dd.value(dd.dot(dd.cross(dd.exact(a), dd.exact(b)), dd.exact(c)))
