"""Lambert's formula for a parallelogram cut at the horizon, in working precision, with its own rounding bound.

E = 1/2 sum over the visible part's edges of theta_i (n . Gamma_i), theta_i the angle an edge subtends and Gamma_i
the unit normal of its plane through the shading point (Arvo 1994, eq. 2). Angles by atan2, which keeps the digits
that acos loses near 0 and pi (Kahan). The terms are of order sqrt(omega) and cancel to order omega: right for
lights that fill a good part of the sky, and the bound tells where it is not.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from nusselt.renderer.vectors import Floats, dot

ROUNDINGS = 3.0
"""Rounding errors of one term, in units of eps theta/sin(theta) (1 + |v|max/|a| + |v|max/|b|); 0.9 measured."""


def lambert(p: Floats, ab: Floats, ac: Floats, n: Floats, clip: bool) -> tuple[Floats, Floats]:
    """Irradiance of p + u ab + v ac for a normal ``n`` of unit length, and the bound of its absolute error, (k,).

    Parameters
    ----------
    p, ab, ac, n : (3, k)
        One floating-point type for all; sizes near 1.
    clip : bool
        Whether the horizon may cut the light.
    """
    v = [p, p + ab, p + ab + ac, p + ac]
    z = [dot(n, corner) for corner in v]
    sums = _Sums(p.shape[1], n, np.sqrt(np.max([dot(corner, corner) for corner in v], axis=0)))
    if not clip:
        for k in range(4):
            sums.arc(v[k], v[(k + 1) % 4])
        return sums.result()
    leaving, entering = np.zeros_like(p), np.zeros_like(p)
    cut = np.zeros(p.shape[1], dtype=bool)
    for k in range(4):
        a, b, za, zb = v[k], v[(k + 1) % 4], z[k], z[(k + 1) % 4]
        # >= as written: a light that touches the horizon along an edge keeps that edge.
        goes, comes = (za >= 0) & (zb < 0), (za < 0) & (zb >= 0)
        share = np.divide(za, za - zb, out=np.zeros_like(za), where=goes | comes)
        crossing = a + (b - a) * share
        sums.arc(np.where(comes, crossing, a), np.where(goes, crossing, b), (za >= 0) | (zb >= 0))
        leaving, entering = np.where(goes, crossing, leaving), np.where(comes, crossing, entering)
        cut |= goes
    sums.arc(leaving, entering, cut)
    return sums.result()


class _Sums:
    """The running sum of arcs, and of their rounding errors."""

    def __init__(self, count: int, n: Floats, extent: Floats) -> None:
        self.n, self.extent = n, extent
        self.total, self.error = np.zeros(count, n.dtype), np.zeros(count, n.dtype)

    def arc(self, a: Floats, b: Floats, there: Any = True) -> None:
        """Add theta (n . Gamma) of the arc from a to b; 0 where it has no length."""
        x = a[1] * b[2] - a[2] * b[1]
        y = a[2] * b[0] - a[0] * b[2]
        z = a[0] * b[1] - a[1] * b[0]
        sine = np.sqrt(x * x + y * y + z * z)
        lengths = np.sqrt(dot(a, a) * dot(b, b))
        some = there & (sine > 0)
        turn = np.divide(np.arctan2(sine, dot(a, b)), sine, out=np.zeros_like(sine), where=some)
        self.total += turn * (self.n[0] * x + self.n[1] * y + self.n[2] * z)
        # |a| |b| (1 + e/|a| + e/|b|) <= lengths + e (|a| + |b|) <= 3 e max(|a|, |b|), e the largest corner.
        longer = np.sqrt(np.maximum(dot(a, a), dot(b, b)))
        self.error += turn * (lengths + 2 * self.extent * longer)

    def result(self) -> tuple[Floats, Floats]:
        """|E| and the bound of its absolute error."""
        eps = np.finfo(self.total.dtype).eps
        return np.abs(self.total) / 2, ROUNDINGS * eps / 2 * self.error
