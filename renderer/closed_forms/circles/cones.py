"""Spheres and ellipsoids as points see them: circle cones, one column for each pair of a point and a body.

v(phi) = (k1 + rho cos phi) e1 + rho sin phi e2 + k3 e3, with e1, e2, e3 orthonormal and k1^2 + k3^2 + rho^2 = 1 or so.
A sphere at distance D: e3 towards its centre, k1 = 0, rho = r/D, k3 = sqrt(D^2 - r^2)/D. An ellipsoid |T(y - C)| < 1
has the cone u'Qu >= 0, Q = (T'p)(T'p)' - (|p|^2 - 1) T'T, p = T(C - x), of eigenvalues l > 0 > -b2 >= -b3 with
axes X, Y, Z; like every quadratic cone it has circular sections: e3 ~ al X - be Z, e1 ~ be X + al Z,
al^2 = l + b2, be^2 = b3 - b2, k1 : k3 : rho = al be : b2 : sqrt(l b3).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.renderer.closed_forms import double_double as dd
from nusselt.renderer.vectors import Bools, Floats, Ints, cross, dot, frame

from .pairing import columns

TINY = 1e-300
ALL, NONE = 4.0, -1.0
"""Half widths of an arc that is the whole circle, and of none: not pi and 0, which rounding would blur."""


@dataclass(frozen=True, eq=False)
class Rounds:
    """Circle cones.

    Parameters
    ----------
    point : (q,) int64
        Ascending.
    e1, e2, e3 : (3, q) float64
    k1, k3, rho : (q,) float64
    right : bool
        All are right circular (k1 = 0): spheres.
    """

    point: Ints
    e1: Floats
    e2: Floats
    e3: Floats
    k1: Floats
    k3: Floats
    rho: Floats
    right: bool

    def take(self, index: Ints) -> Rounds:
        """Some of the pairs."""
        e1, e2, e3 = (columns(v, index) for v in (self.e1, self.e2, self.e3))
        return Rounds(self.point[index], e1, e2, e3, self.k1[index], self.k3[index], self.rho[index], self.right)

    def on(self, planes: Floats) -> tuple[Floats, Floats, Floats]:
        """Coefficients of cos, sin and 1 of planes (3, p, q) along the circle."""
        m1, m2, m3 = (dot(planes, e[:, None]) for e in (self.e1, self.e2, self.e3))
        return self.rho * m1, self.rho * m2, self.k1 * m1 + self.k3 * m3

    def spans(self, planes: Floats) -> tuple[Floats, Floats]:
        """Arcs |phi - middle| <= half (p, q) of the circle inside planes (3, p, q)."""
        return arc(*self.on(planes))

    def flattened(self, d: Floats) -> Floats:
        """Directions (3, q) scaled so that the cone is w1^2 + w2^2 <= w3^2."""
        d1, d2, d3 = dot(d, self.e1), dot(d, self.e2), dot(d, self.e3)
        return np.stack((self.k3 * d1 - self.k1 * d3, self.k3 * d2, self.rho * d3))

    def direction(self, phi: Floats) -> Floats:
        """v(phi) (3, q)."""
        return (self.k1 + self.rho * np.cos(phi)) * self.e1 + self.rho * np.sin(phi) * self.e2 + self.k3 * self.e3


def arc(p: Floats, q: Floats, m: Floats) -> tuple[Floats, Floats]:
    """Where p cos(phi) + q sin(phi) + m >= 0, as |phi - middle| <= half."""
    reach = np.sqrt(p * p + q * q)
    s2 = (reach - m) * (reach + m)
    half = np.arctan2(np.sqrt(np.maximum(s2, 0)), -m)
    return np.arctan2(q, p), np.where(s2 > 0, half, np.where(m >= 0, ALL, NONE))


def wrapped(phi: Floats) -> Floats:
    """Into [-pi, pi]."""
    return phi - 2 * np.pi * np.round(phi / (2 * np.pi))


def spheres(points: Floats, point: Ints, center: Floats, radius: Floats) -> Rounds:
    """Cones of spheres, center (3, q) and radius (q,), about the points numbered (q,), all outside them."""
    v = center - columns(points, point)
    distance = np.sqrt(dot(v, v))
    e3 = v / distance
    e1, e2 = frame(e3)
    tangent = _tangent(columns(points, point), center, radius)
    k3 = np.sqrt(np.maximum(tangent, 0.0)) / distance
    return Rounds(point, e1, e2, e3, np.zeros_like(k3), k3, np.minimum(radius / distance, 1.0), True)


def _tangent(points: Floats, center: Floats, radius: Floats) -> Floats:
    """Squared lengths (q,) of tangents from points (3, q) to spheres; negative inside."""
    v = center - points
    square = dot(v, v)
    tangent = np.asarray(square - radius * radius)
    near = np.flatnonzero(np.abs(tangent) < 0.01 * square)
    if near.size:  # beside the contact point: the difference in double-double
        exact = dd.two_sum(center[:, near], -points[:, near])
        size = dd.add(dd.dot(exact, exact), dd.multiply(dd.exact(radius[near]), dd.exact(-radius[near])))
        tangent[near] = dd.value(size)
    return tangent


def outside(points: Floats, center: Floats, radius: float) -> Bools:
    """Which points (3, n) lie outside a sphere about ``center`` (3, 1)."""
    n = points.shape[1]
    return _tangent(points, np.repeat(center, n, axis=1), np.full(n, radius)) > 0


def ellipsoids(points: Floats, point: Ints, center: Floats, inverse: Floats) -> Rounds:
    """Cones of ellipsoids, center (3, q) and T (q, 3, 3), about the points numbered (q,), all outside them."""
    v = center - columns(points, point)
    p = np.einsum("qij,jq->iq", inverse, v)
    g = np.einsum("qji,jq->iq", inverse, p)
    metric = np.einsum("qki,qkj->qij", inverse, inverse)
    beyond = np.maximum(dot(p, p) - 1, 0.0)
    form = np.einsum("iq,jq->qij", g, g) - beyond[:, None, None] * metric
    values, axes = np.linalg.eigh(form)
    b3, b2, l1 = np.maximum(-values[:, 0], 0), np.maximum(-values[:, 1], 0), np.maximum(values[:, 2], TINY)
    x, z = axes[:, :, 2].T, axes[:, :, 0].T
    x = np.where(dot(x, v) < 0, -x, x)
    al, be = np.sqrt(l1 + b2), np.sqrt(np.maximum(b3 - b2, 0))
    size = np.hypot(al, be)
    e3, e1 = (al * x - be * z) / size, (be * x + al * z) / size
    k1, k3, rho = al * be, b2, np.sqrt(l1 * b3)
    scale = 1 / np.maximum(np.sqrt(k1 * k1 + k3 * k3 + rho * rho), TINY)
    return Rounds(point, e1, cross(e3, e1), e3, k1 * scale, k3 * scale, rho * scale, False)
