"""Normals of triangles, needles included.

The plain cross product of two long edges errs by eps times the product of their lengths, however small the triangle
is: a facet a thousandth as wide as it is long is then tilted by a thousand roundings, and places on it lie behind it.
Here differences and products are taken without rounding (Knuth; Dekker 1971): what is left is relative to the normal.
"""

from __future__ import annotations

import numpy as np

from nusselt.renderer.closed_forms.double_double import two_product, two_sum
from nusselt.renderer.vectors import Floats, cross


def triangle_normals(a: Floats, b: Floats, c: Floats) -> Floats:
    """(b - a) x (c - a) of corners (3, n), within 2^-52 of its length.

    Measured against rational numbers: 0.95 x 2^-53 at most where edges are up to 1e12 times as long as the triangle is
    high; the plain product errs by 10 of these at well-shaped ones, 9e6 at edges 1e6 times as long. Where products
    overflow, beyond 1e150, it is the plain one. Exchanged corners give exactly the opposite.
    """
    (e, e_low), (f, f_low) = two_sum(b, -a), two_sum(c, -a)
    out = np.empty_like(e)
    with np.errstate(over="ignore", invalid="ignore"):
        for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
            (plus, plus_low), (minus, minus_low) = two_product(e[i], f[j]), two_product(e[j], f[i])
            high, low = two_sum(plus, -minus)
            low += plus_low - minus_low
            low += (e[i] * f_low[j] + e_low[i] * f[j]) - (e[j] * f_low[i] + e_low[j] * f[i])
            out[k] = high + low
    return np.where(np.isfinite(out).all(axis=0), out, cross(b - a, c - a))
