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
    v = np.stack((p, p + ab, p + ab + ac, p + ac), axis=1)  # (3, 4, k)
    after = np.roll(v, -1, axis=1)
    extent = np.sqrt(dot(v, v).max(axis=0))
    if not clip:
        return _result(*_arcs(v, after, n, extent, True))
    za = dot(n[:, None], v)
    zb = np.roll(za, -1, axis=0)
    # >= as written: a light that touches the horizon along an edge keeps that edge.
    goes, comes = (za >= 0) & (zb < 0), (za < 0) & (zb >= 0)
    share = np.divide(za, za - zb, out=np.zeros_like(za), where=goes | comes)
    crossing = v + (after - v) * share
    there = (za >= 0) | (zb >= 0)
    total, error = _arcs(np.where(comes, crossing, v), np.where(goes, crossing, after), n, extent, there)
    leaving, entering = np.zeros_like(p), np.zeros_like(p)
    for k in range(4):
        leaving = np.where(goes[k], crossing[:, k], leaving)
        entering = np.where(comes[k], crossing[:, k], entering)
    last = _arcs(leaving[:, None], entering[:, None], n, extent, goes.any(axis=0))
    return _result(np.vstack((total, last[0])), np.vstack((error, last[1])))


def _arcs(a: Floats, b: Floats, n: Floats, extent: Floats, there: Any) -> tuple[Floats, Floats]:
    """theta (n . Gamma) of arcs from a to b (3, m, k), 0 where one has no length; and their rounding, (m, k)."""
    x = a[1] * b[2] - a[2] * b[1]
    y = a[2] * b[0] - a[0] * b[2]
    z = a[0] * b[1] - a[1] * b[0]
    sine = np.sqrt(x * x + y * y + z * z)
    aa, bb = dot(a, a), dot(b, b)
    turn = np.divide(np.arctan2(sine, dot(a, b)), sine, out=np.zeros_like(sine), where=there & (sine > 0))
    # |a| |b| (1 + e/|a| + e/|b|) <= lengths + e (|a| + |b|) <= 3 e max(|a|, |b|), e the largest corner.
    rounding = turn * (np.sqrt(aa * bb) + 2 * extent * np.sqrt(np.maximum(aa, bb)))
    return turn * (n[0] * x + n[1] * y + n[2] * z), rounding


def _result(terms: Floats, rounding: Floats) -> tuple[Floats, Floats]:
    """|E| and the bound of its absolute error, from arcs (m, k): summed in order."""
    total, error = terms[0], rounding[0]
    for term, more in zip(terms[1:], rounding[1:], strict=True):
        total, error = total + term, error + more
    eps = np.finfo(total.dtype).eps
    return np.abs(total) / 2, ROUNDINGS * eps / 2 * error
