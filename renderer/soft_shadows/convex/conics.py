"""Round bodies in a light's square: what each hides along the lines u = constant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.renderer.closed_forms.circles.circles import ends
from nusselt.renderer.closed_forms.circles.cones import Rounds
from nusselt.renderer.closed_forms.circles.pairing import columns
from nusselt.renderer.vectors import Bools, Floats, Ints, cross, dot

from .sections import Square


@dataclass(frozen=True, eq=False)
class Conics:
    """Circle cones cut by the light's plane, one for each pair of a point and a body.

    With w = (k3 d1 - k1 d3, k3 d2, rho d3) the cone is w1^2 + w2^2 <= w3^2, w3 > 0, and w is linear in u and v. The
    line at u meets it where its plane through the point, p cos(phi) + q sin(phi) + m = 0 on the circle, cuts the
    circle; p, q and m are linear in u.

    Parameters
    ----------
    cone : Rounds
    w0, wu, wv : (3, q) float64
        w = w0 + u wu + v wv.
    on0, onu : (3, q) float64
        (p, q, m) = on0 + u onu.
    """

    cone: Rounds
    w0: Floats
    wu: Floats
    wv: Floats
    on0: Floats
    onu: Floats

    @classmethod
    def seen(cls, cone: Rounds, square: Square) -> Conics:
        """Of cones about the square's points."""
        p = columns(square.p, cone.point)
        planes = np.stack((cross(p, square.ac), np.broadcast_to(cross(square.ab, square.ac), p.shape)), axis=1)
        on = np.stack(cone.on(planes))
        w0, wu, wv = (cone.flattened(v) for v in (p, square.ab, square.ac))
        return cls(cone, w0, wu, wv, on[:, 0], on[:, 1])

    @property
    def point(self) -> Ints:
        return self.cone.point

    def take(self, index: Ints) -> Conics:
        """Some of the pairs."""
        forms = (columns(v, index) for v in (self.w0, self.wu, self.wv, self.on0, self.onu))
        return Conics(self.cone.take(index), *forms)

    def tangents(self) -> tuple[Floats, Floats, Floats]:
        """u (2, q) of the two lines that touch, nan if there are none; and between which places (q,) lines may cut."""
        a, b, c = _form(self.onu, self.onu), _form(self.on0, self.onu), _form(self.on0, self.on0)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            root = -(b + np.copysign(np.sqrt(np.maximum(b * b - a * c, 0)), b))
            u = np.stack((root / a, c / root))
        between = a < 0  # it is met between them, else outside
        low = np.where(between, np.maximum(u.min(axis=0), 0.0), 0.0)
        high = np.where(between, np.minimum(u.max(axis=0), 1.0), 1.0)
        return np.where((u > 0) & (u < 1), u, np.nan), low, high

    def interval(self, pair: Ints, u: Floats, meets: bool = False) -> tuple[Floats, Floats]:
        """What bodies (m,) hide at u (m,), from v = lo to hi; lo > hi where they hide nothing.

        But of lines that are known to ``meets`` their cones, where rounding has them apart, the place between.
        """
        on = columns(self.on0, pair) + u * columns(self.onu, pair)
        reach = np.sqrt(on[0] * on[0] + on[1] * on[1])
        square = (reach - on[2]) * (reach + on[2])
        a, g = columns(self.w0, pair) + u * columns(self.wu, pair), columns(self.wv, pair)
        c, b = a[0] * a[0] + a[1] * a[1] - a[2] * a[2], a[0] * g[0] + a[1] * g[1] - a[2] * g[2]
        h = np.sqrt(g[0] * g[0] + g[1] * g[1])
        lead = (h - g[2]) * (h + g[2])
        k3 = self.cone.k3[pair]
        root = -(b + np.copysign(k3 * np.sqrt(np.maximum(square, 0)), b))
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            one = np.where(lead == 0, -np.copysign(1e300, root), root / lead)
            two = np.where((root == 0) | (square <= 0), one, c / root)
            low, high = np.minimum(one, two), np.maximum(one, two)
            both = lead > 0  # both crossings on one nappe
            up = np.where(both, a[2] + g[2] * np.clip(low, -1e200, 1e200), g[2]) > 0
        lo = np.where(both, low, np.where(up, high, -np.inf))
        hi = np.where(both, high, np.where(up, np.inf, low))
        if meets:
            return lo, hi
        there = np.where(both, (square > 0) & up, g[2] != 0) & ((square > 0) | (k3 == 0))
        return np.where(there, lo, 2.0), np.where(there, hi, -1.0)

    def crossed(self, pair: Ints, planes: Floats) -> tuple[Ints, Floats]:
        """Pairs (m,) and angles where outlines (k,) are crossed by planes (3, k)."""
        of, phi = ends(*self.cone.take(pair).spans(planes[:, None]))
        return pair[of], phi


def _form(one: Floats, two: Floats) -> Floats:
    return np.asarray(one[0] * two[0] + one[1] * two[1] - one[2] * two[2])


def may_meet(cone: Rounds, square: Square) -> Bools:
    """Which cones (q,) may meet the light above the horizon."""
    p, q, m = cone.on(columns(square.cone(), cone.point))
    return np.asarray((np.sqrt(p * p + q * q) >= -m).all(axis=0))


def angle(cone: Rounds, d: Floats) -> Floats:
    """The angle phi (q,) of the circle's point nearest to directions (3, q)."""
    if cone.right:
        return np.asarray(np.arctan2(dot(d, cone.e2), dot(d, cone.e1)))
    w = cone.flattened(d)
    return np.asarray(np.arctan2(w[1], w[0]))
