"""Outlines of round bodies: arcs of circle cones, and where one crosses another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.renderer.vectors import Floats, Ints, dot

from .cones import Rounds, arc
from .crossings import crossings

EPS = float(np.finfo(np.float64).eps)
ROUNDINGS = 8.0
"""Roundings of a term, in units of eps, counted."""


@dataclass(frozen=True, eq=False)
class CircleArcs:
    """Arcs first <= phi <= last (k,) of circle cones, one each."""

    cone: Rounds
    first: Floats
    last: Floats

    def take(self, index: Ints) -> CircleArcs:
        """Some of the arcs."""
        return CircleArcs(self.cone.take(index), self.first[index], self.last[index])


def meet(circles: Rounds, others: Rounds) -> tuple[Ints, Floats]:
    """Where outlines cross as many others, one each: their numbers (m,), and angles on them."""
    if not (circles.right and others.right):
        return crossings(circles, others)
    p, q, m = circles.on(others.e3[:, None])
    return ends(*arc(p, q, m - others.k3))


def ends(middle: Floats, half: Floats) -> tuple[Ints, Floats]:
    """Both ends of arcs (k, q) that have any: circles (m,) and angles (m,)."""
    row, column = np.nonzero((half > 0) & (half < np.pi))
    middle, half = middle[row, column], half[row, column]
    return np.tile(column, 2), np.concatenate((middle - half, middle + half))


def lambert_circles(arcs: CircleArcs, n: Floats) -> tuple[Floats, Floats]:
    """Twice the share (k,) of irradiance of arcs for unit normals (3, k), the integral of n . (u x du), and its bound.

    On a small circle sin^2 a (n.c) dphi - sin a cos a n.(e1 dsin - e2 dcos). On a general one, with A + B cos(phi) the
    square of v, S = sqrt(A^2 - B^2) and kap = B/(A + S), rho [rho n3 J0 + (k1 n3 - k3 n1) Jc - k3 n2 Js]; J0, Jc, Js
    the integrals of 1, cos and sin over A + B cos(phi), without branches. Each comes with its rounding.
    """
    cone, turn = arcs.cone, arcs.last - arcs.first
    n1, n2, n3 = dot(n, cone.e1), dot(n, cone.e2), dot(n, cone.e3)
    middle, half = (arcs.first + arcs.last) / 2, np.where(turn == 2 * np.pi, 0.0, np.sin(turn / 2))
    sine, cosine = 2 * np.cos(middle) * half, -2 * np.sin(middle) * half  # differences of sin and of cos
    k1, k3, rho = cone.k1, cone.k3, cone.rho
    if cone.right:
        share = rho * (rho * n3 * turn - k3 * (n1 * sine - n2 * cosine))
        open_ = turn != 2 * np.pi  # a whole circle has nothing that cancels
        return np.asarray(share), ROUNDINGS * EPS * rho * (rho + k3 * open_) * turn
    (j0, d0), (jc, dc), (js, ds) = _moments(arcs, cosine, half)
    share = rho * (rho * n3 * j0 + (k1 * n3 - k3 * n1) * jc - k3 * n2 * js)
    k1, k3 = np.abs(k1), np.abs(k3)
    sizes = rho * np.abs(j0) + (k1 + k3) * np.abs(jc) + k3 * np.abs(js)
    return np.asarray(share), rho * (rho * d0 + (k1 + k3) * dc + k3 * ds + ROUNDINGS * EPS * sizes)


def _moments(arcs: CircleArcs, cosine: Floats, half: Floats) -> tuple[tuple[Floats, Floats], ...]:
    """J0, Jc and Js, each with its rounding; ``cosine`` the difference of cos, ``half`` the sine of half the angle."""
    k1, k3, rho = arcs.cone.k1, arcs.cone.k3, arcs.cone.rho
    turn = arcs.last - arcs.first
    a, b = k1 * k1 + k3 * k3 + rho * rho, 2 * rho * k1
    s = np.sqrt(((k1 - rho) ** 2 + k3 * k3) * ((k1 + rho) ** 2 + k3 * k3))
    kappa = b / (a + s)

    def swing(phi: Floats) -> tuple[Floats, Floats]:
        """arctan(kappa sin/(1 + kappa cos)) / kappa."""
        below = 1 + kappa * np.cos(phi)
        z = np.sin(phi) / below
        y = kappa * z
        value = np.where(np.abs(y) < 1e-4, z * (1 - y * y / 3), np.arctan(y) / np.where(kappa == 0, 1, kappa))
        return value, ROUNDINGS * EPS * (np.abs(value) + np.abs(z) / ((1 + y * y) * below))

    (one, d_one), (two, d_two) = swing(arcs.first), swing(arcs.last)
    change, doubt = two - one, d_one + d_two
    nearest = (k1 - rho) ** 2 + k3 * k3  # a - |b|: beside the rim the two cancel
    turned = np.where(b > 0, np.cos(arcs.first / 2), np.sin(arcs.first / 2))
    beginning = nearest + 2 * np.abs(b) * turned**2
    z = cosine / beginning
    y = np.maximum(b * z, -1 + 1e-16)
    j0 = (turn - 2 * kappa * change) / s
    jc = (2 * a / (a + s) * change - kappa * turn) / s
    js = -np.where(np.abs(y) < 1e-8, z * (1 - y / 2), np.log1p(y) / np.where(b == 0, 1, b))
    slip = (half + np.abs(z) * (beginning + a)) / (beginning * (1 + y)) + np.abs(js)
    rounding = ROUNDINGS * EPS * turn
    return (j0, (rounding + 2 * doubt) / s), (jc, (rounding + 2 * doubt) / s), (js, ROUNDINGS * EPS * slip)
