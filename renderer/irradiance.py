"""Irradiance of a uniform parallelogram, clipped at the receiver's horizon: Lambert's formula (Arvo 1994).

E/L = 1/2 sum over the edges of the visible part of theta_i (n . Gamma_i), theta_i the angle an edge subtends and
Gamma_i the unit normal of its plane through the point. Angles by atan2, which keeps its digits where acos loses
half of them. Relative error eps/omega^(1/2 .. 1) for a light of solid angle omega: the edges' terms are of
order omega^(1/2) and cancel; see `bound`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .vectors import Floats, cross, dot

EPS = 2.0**-52


def _vectors(v: ArrayLike) -> Floats:
    array = np.asarray(v, dtype=np.float64)
    return array.reshape(3, 1) if array.ndim == 1 else array


def _arc(a: Floats, b: Floats, n: Floats) -> Floats:
    """theta (n . Gamma) of the arc from a to b; 0 where it has no length."""
    normal = cross(a, b)
    sine = np.sqrt(dot(normal, normal))
    safe = np.where(sine > 0, sine, 1.0)
    return np.arctan2(sine, dot(a, b)) * dot(n, normal) / safe


def irradiance(points: Floats, normals: Floats, corner: Any, ab: Any, ac: Any) -> tuple[Floats, Floats]:
    """Integral of max(n.w, 0) over the directions of a parallelogram, both of whose sides count.

    Parameters
    ----------
    points, normals : (3, n) float64
        Shading points, and their normals of any length.
    corner, ab, ac : (3,) or (3, n) float64
        The parallelogram corner + u ab + v ac.

    Returns
    -------
    value, bound : (n,) float64
        The integral, in units of radiance, and a bound of its relative error; 0 and 0 below the horizon.
    """
    scale = np.abs(normals).max(axis=0)
    n = normals / scale
    n = n / np.sqrt(dot(n, n))
    p, ab, ac = _vectors(corner) - points, _vectors(ab), _vectors(ac)
    size = np.maximum(np.abs(p).max(axis=0), np.maximum(np.abs(ab).max(axis=0), np.abs(ac).max(axis=0)))
    v = [edge / size for edge in (p, p + ab, p + ab + ac, p + ac)]
    z = [dot(n, vertex) for vertex in v]
    total, terms = np.zeros(points.shape[1]), np.zeros(points.shape[1])
    leaving, entering = np.zeros_like(v[0]), np.zeros_like(v[0])
    for k in range(4):
        a, b, za, zb = v[k], v[(k + 1) % 4], z[k], z[(k + 1) % 4]
        # >= as written: a light that touches the horizon along an edge keeps that edge.
        below_a, below_b = np.maximum(-za, 0), np.maximum(-zb, 0)
        span_a, span_b = below_a + np.maximum(zb, 0), below_b + np.maximum(za, 0)
        ta = np.divide(below_a, span_a, out=np.zeros_like(za), where=(za < 0) & (zb >= 0) & (span_a > 0))
        tb = 1 - np.divide(below_b, span_b, out=np.zeros_like(za), where=(zb < 0) & (za >= 0) & (span_b > 0))
        start, stop = a + (b - a) * ta, a + (b - a) * tb
        term = _arc(start, stop, n) * ((za >= 0) | (zb >= 0))
        total, terms = total + term, terms + np.abs(term)
        leaving = np.where((za >= 0) & (zb < 0), stop, leaving)
        entering = np.where((za < 0) & (zb >= 0), start, entering)
    closing = _arc(leaving, entering, n)
    value = np.abs(total + closing) / 2
    rounding = 32 * EPS * (terms + np.abs(closing))
    bound = np.divide(rounding, value, out=np.zeros_like(value), where=value > 0)
    below = np.all([height < 0 for height in z], axis=0)
    return np.where(below, 0.0, value), np.where(below, 0.0, bound)
