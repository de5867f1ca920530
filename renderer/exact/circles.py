"""Outlines of round bodies inside the light's cone and outside every other occluder.

A circle is cut wherever anything crosses it; each piece then lies inside or outside of everything as a whole, and its
middle tells. A cut too many costs nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry import Ints
from ..vectors import Floats, dot
from .crossings import crossings
from .fans import Fan
from .light_cone import Bools, LightCone
from .lines import joined
from .rounds import Rounds, arc, on_arc, wrapped

EPS = float(np.finfo(np.float64).eps)
ROUNDINGS = 8.0
"""Roundings of a term, in units of eps, counted."""


@dataclass(frozen=True)
class CircleArcs:
    """Arcs first <= phi <= last (k,) of circle cones, one each; all count -1."""

    cone: Rounds
    first: Floats
    last: Floats

    def take(self, index: Ints) -> CircleArcs:
        """Some of the arcs."""
        return CircleArcs(self.cone.take(index), self.first[index], self.last[index])


@dataclass(frozen=True)
class _Against:
    """Circles against other occluders: pairs (circle, occluder) ascending in the circle.

    A pair hides what lies on all its arcs |phi - middle| <= half (k, c), or in its ``cone``.
    """

    circle: Ints
    middle: Floats
    half: Floats
    cone: Rounds | None
    cuts: tuple[Ints, Floats]

    def hides(self, circle: Ints, phi: Floats, circles: Rounds) -> Bools:
        """Whether any pair hides the points phi (k,) of circles (k,)."""
        count = np.bincount(self.circle, minlength=circles.point.size)
        i, j = joined(circle, np.cumsum(count) - count, count)
        if self.cone is None:
            hit = np.asarray(on_arc(phi[i], self.middle[:, j], self.half[:, j]).all(axis=0))
        else:
            hit = self.cone.take(j).contains(circles.take(circle[i]).direction(phi[i]))
        return np.asarray(np.bincount(i[hit], minlength=phi.size) > 0)


def circle_arcs(light: LightCone, rounds: Rounds, own: int, others: list[Fan | Rounds], exact: Bools) -> CircleArcs:
    """The visible outlines of one group of round bodies; ``own`` is its place among the ``others``."""
    p, q, m = rounds.on(light.planes[..., rounds.point])
    reaches = (np.sqrt(p * p + q * q) >= -m).all(axis=0) & exact[rounds.point]
    some = np.flatnonzero(reaches)
    circles = rounds.take(some)
    middle, half = arc(p[:, some], q[:, some], m[:, some])
    some_cut = np.flatnonzero((half > 0) & (half < np.pi))
    at = some_cut % max(some.size, 1)
    cuts: list[tuple[Ints, Floats]] = [
        (at, middle.ravel()[some_cut] - half.ravel()[some_cut]),
        (at, middle.ravel()[some_cut] + half.ravel()[some_cut]),
    ]
    against: list[_Against] = []
    for place, other in enumerate(others):
        count = np.bincount(other.point, minlength=exact.size)
        i, j = joined(circles.point, np.cumsum(count) - count, count)
        apart = np.flatnonzero(some[i] != j) if place == own else np.arange(i.size)
        if apart.size:
            against.append(_meet(circles.take(i[apart]), i[apart], other.take(j[apart])))
            cuts.append(against[-1].cuts)
    number = np.concatenate([c[0] for c in cuts])
    circle, first, last = _pieces(some.size, number, wrapped(np.concatenate([c[1] for c in cuts])))
    phi = (first + last) / 2
    seen = np.asarray(on_arc(phi, middle[:, circle], half[:, circle]).all(axis=0))
    for group in against:
        seen[seen] = ~group.hides(circle[seen], phi[seen], circles)
    return CircleArcs(circles.take(circle[seen]), first[seen], last[seen])


def _meet(circles: Rounds, number: Ints, other: Fan | Rounds) -> _Against:
    """Circles against as many occluders, one each."""
    if isinstance(other, Fan) or (circles.right and other.right):
        if isinstance(other, Fan):
            middle, half = circles.spans(other.planes)
        else:
            p, q, m = circles.on(other.e3[:, None])
            middle, half = arc(p, q, m - other.k3)
        k, c = np.nonzero((half > 0) & (half < np.pi))
        ends = np.concatenate((middle[k, c] - half[k, c], middle[k, c] + half[k, c]))
        return _Against(number, middle, half, None, (np.r_[number[c], number[c]], ends))
    pair, phi = crossings(circles, other)
    empty = np.empty((0, number.size))
    return _Against(number, empty, empty, other, (number[pair], phi))


def _pieces(count: int, circle: Ints, phi: Floats) -> tuple[Ints, Floats, Floats]:
    """The pieces of ``count`` circles between cuts at phi (k,) of circles (k,), and at +-pi."""
    many = np.bincount(circle, minlength=count)
    order = np.argsort(circle, kind="stable")
    slot = np.empty(circle.size, dtype=np.int64)
    slot[order] = np.arange(circle.size) - (np.cumsum(many) - many)[circle[order]]
    out = []
    least, most = 0, 2
    while least <= many.max(initial=0):
        chosen = np.flatnonzero((many >= least) & (many <= most))
        if chosen.size:
            place = np.full(count, -1)
            place[chosen] = np.arange(chosen.size)
            mine = np.flatnonzero(place[circle] >= 0)
            cuts = np.full((chosen.size, most + 2), np.pi)
            cuts[:, -1] = -np.pi
            cuts[place[circle[mine]], slot[mine]] = phi[mine]
            cuts.sort(axis=1)
            k, row = np.nonzero(cuts[:, :-1] < cuts[:, 1:])
            out.append((chosen[k], cuts[k, row], cuts[k, row + 1]))
        least, most = most + 1, most * 2
    if not out:
        return np.empty(0, dtype=np.int64), np.empty(0), np.empty(0)
    return np.concatenate([o[0] for o in out]), np.concatenate([o[1] for o in out]), np.concatenate([o[2] for o in out])


def lambert_circles(arcs: CircleArcs, n: Floats) -> tuple[Floats, Floats]:
    """Twice the share (k,) of irradiance of arcs for unit normals (3, k), the integral of n . (u x du), and its bound.

    On a small circle sin^2 a (n.c) dphi - sin a cos a n.(e1 dsin - e2 dcos). On a general one, with A + B cos(phi) the
    square of v, S = sqrt(A^2 - B^2) and kap = B/(A + S), rho [rho n3 J0 + (k1 n3 - k3 n1) Jc - k3 n2 Js]; J0, Jc, Js
    the integrals of 1, cos and sin over A + B cos(phi), without branches. Each comes with its rounding.
    """
    cone, turn = arcs.cone, arcs.last - arcs.first
    n1, n2, n3 = dot(n, cone.e1), dot(n, cone.e2), dot(n, cone.e3)
    middle, half = (arcs.first + arcs.last) / 2, np.sin(turn / 2)
    sine, cosine = 2 * np.cos(middle) * half, -2 * np.sin(middle) * half  # differences of sin and of cos
    k1, k3, rho = cone.k1, cone.k3, cone.rho
    if cone.right:
        share = rho * (rho * n3 * turn - k3 * (n1 * sine - n2 * cosine))
        return np.asarray(share), ROUNDINGS * EPS * rho * (rho + k3) * turn
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
    beginning = a + b * np.cos(arcs.first)
    z = cosine / beginning
    y = np.maximum(b * z, -1 + 1e-16)
    j0 = (turn - 2 * kappa * change) / s
    jc = (2 * a / (a + s) * change - kappa * turn) / s
    js = -np.where(np.abs(y) < 1e-8, z * (1 - y / 2), np.log1p(y) / np.where(b == 0, 1, b))
    slip = (half + np.abs(z) * (beginning + a)) / (beginning * (1 + y)) + np.abs(js)
    rounding = ROUNDINGS * EPS * turn
    return (j0, (rounding + 2 * doubt) / s), (jc, (rounding + 2 * doubt) / s), (js, ROUNDINGS * EPS * slip)
