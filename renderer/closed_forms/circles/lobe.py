"""The lobe's boundary integral over arcs of circle cones, for any real exponent, with its error.

v(phi) as in `cones`; about w, t |v| and the two coordinates across are each p cos(phi) + q sin(phi) + m, and so are
n . (v x dv) and w . (v x dv). An arc is cut at the lobe's horizon t = 0, in closed form, and by halving:

below, far   t < 0, or t^s < e^-37 throughout: the azimuth about w, in closed form
core         Gauss-Legendre, on panels of the lobe's width, halved until the Legendre series has fallen off
end          next to the horizon: the azimuth minus the integral of y^s G(y), G a Legendre series (see `panel_rules`)
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from nusselt.renderer.closed_forms.arc_lobe import EPS, FALL
from nusselt.renderer.vectors import Bools, Floats, Ints, distinct, dot, frame

from .circles import CircleArcs
from .cones import ALL, NONE, arc, wrapped
from .pairing import columns
from .panel_rules import NODES, WEIGHTS, gauss, root

HALVINGS, MANY = 40, 50
"""How often a panel is halved, and how many there may be for each arc."""
SMOOTH = 16.0
"""From this exponent on the root at the horizon is smooth to Gauss-Legendre."""
MOVED, ROUNDED = 8.0, 16.0
"""Roundings of a point's place in units of eps over |v|, and of the terms."""
PANEL = 2.5
"""Half length of a panel in units of the lobe's width."""
AT_ONCE = 512
"""Panels at once: their arrays fit into the cache."""


@dataclass(frozen=True, eq=False)
class _Curves:
    """Circle cones about w, one each of k; forms (3, k): coefficients of cos, sin and 1 of phi - middle.

    ``middle`` is where t |v| is largest, ``half`` from there to the horizon; ``flat`` says that there is none.
    ``square`` is |v|^2, at least ``least``, ``size`` what v is made of, ``inside`` whether the cone holds w or -w.
    """

    t: Floats
    x: Floats
    y: Floats
    n_turn: Floats
    w_turn: Floats
    square: Floats
    least: Floats
    rho: Floats
    size: Floats
    half: Floats
    flat: Bools
    inside: Bools
    w_n: Floats
    s: Floats

    @classmethod
    def of(cls, arcs: CircleArcs, n: Floats, w: Floats, s: Floats) -> tuple[_Curves, Floats]:
        """The curves, and the phi (k,) that they are turned by."""
        cone = arcs.cone
        k1, k3, rho = cone.k1, cone.k3, cone.rho
        across = frame(w)
        forms = [np.stack(cone.on(v[:, None])).reshape(3, -1) for v in (w, *across)]
        middle, half = arc(*forms[0])
        for v in (n, w):  # v x dv = rho [(rho + k1 cos) e3 - k3 (cos e1 + sin e2)]
            v1, v2, v3 = dot(v, cone.e1), dot(v, cone.e2), dot(v, cone.e3)
            forms.append(rho * np.stack((k1 * v3 - k3 * v1, -k3 * v2, rho * v3)))
        forms.append(np.stack((2 * rho * k1, np.zeros_like(rho), k1 * k1 + k3 * k3 + rho * rho)))
        t, x, y, n_turn, w_turn, square = (_turned(form, middle) for form in forms)
        flat = (half == ALL) | (half == NONE)
        half = np.where(half == ALL, np.pi, np.maximum(half, 0.0))
        inside = np.abs(forms[4][2]) > np.hypot(forms[4][0], forms[4][1])
        least = np.maximum((np.abs(k1) - rho) ** 2 + k3 * k3, 1e-300)
        size, w_n = np.abs(k1) + k3 + rho, dot(w, n)
        return cls(t, x, y, n_turn, w_turn, square, least, rho, size, half, flat, inside, w_n, s), middle

    def take(self, index: Ints) -> _Curves:
        return _Curves(*(columns(getattr(self, f.name), index) for f in fields(self)))

    def speed(self, x: Floats, width: Floats) -> Floats:
        """The largest angle per angle of phi within x +- width."""
        near = _at(self.square, x) - width * np.hypot(self.square[0], self.square[1])
        return np.asarray(self.rho / np.sqrt(np.maximum(near, self.least)))

    def through_opposite(self) -> Bools:
        """Whether -w may lie on the curve: there the azimuth is not known."""
        p, q, m = self.w_turn
        reach = np.hypot(p, q)
        nearest = np.arctan2(q, p) + np.pi * (m > 0)
        close = np.abs(reach - np.abs(m)) < MOVED * EPS * self.rho * self.size
        return np.asarray(close & (_at(self.t, nearest) < 0))


def _turned(form: Floats, middle: Floats) -> Floats:
    """A form of phi as one of phi - middle."""
    cosine, sine = np.cos(middle), np.sin(middle)
    return np.stack((form[0] * cosine + form[1] * sine, form[1] * cosine - form[0] * sine, form[2]))


def _at(form: Floats, x: Floats) -> Floats:
    return np.asarray(form[0] * np.cos(x) + form[1] * np.sin(x) + form[2])


@dataclass(frozen=True, eq=False)
class _Panels:
    """Stretches a <= y <= b of the curves numbered ``curve``, each array (k,); x = phi - middle = side (half - y).

    ``sign`` is -1 for those that are taken away.
    """

    curve: Ints
    side: Floats
    sign: Floats
    a: Floats
    b: Floats

    def take(self, index: Ints | Bools) -> _Panels:
        return _Panels(*(getattr(self, f.name)[index] for f in fields(self)))

    def halves(self) -> list[_Panels]:
        """The part next to the horizon and the other."""
        middle = (self.a + self.b) / 2
        return [replace(self, b=middle), replace(self, a=middle)]


def _joined(parts: list[_Panels]) -> _Panels:
    return _Panels(*(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(_Panels)))


def lobe_circles(arcs: CircleArcs, n: Floats, w: Floats, s: Floats) -> tuple[Floats, Floats]:
    """(s + 2) times the share of the lobe integral of arcs of circle cones, and its bound, (k,); unit n, w (3, k)."""
    curves, middle = _Curves.of(arcs, n, w, s)
    turn = arcs.last - arcs.first
    first = wrapped((arcs.first + arcs.last) / 2 - middle) - turn / 2
    some = turn > 0
    sums = _Sums(curves, np.zeros(s.shape), some * _doubt(curves))
    sums.below(first, first + turn)
    core, ends = _above(curves, first, first + turn)
    sums.core(_joined([core, *sums.ends(ends)]))
    return sums.share, sums.bound


def _doubt(curves: _Curves) -> Floats:
    """What it may cost that t is only known to rounding, and with it the horizon, where an exponent of 0 has a step."""
    amplitude, length = np.maximum(curves.t[0], 1e-300), np.sqrt(curves.least)
    slip = MOVED * EPS * (curves.size + np.abs(curves.t[2])) / amplitude
    touches = np.abs(np.abs(curves.t[2]) - amplitude) <= slip * amplitude
    crossing = np.minimum(slip / np.maximum(np.sin(curves.half), 1e-300), np.sqrt(2 * slip))
    crossing = np.where(curves.flat, touches * np.sqrt(2 * slip), crossing)
    power, speed = np.minimum(curves.s, 1.0), curves.rho / length
    doubt = slip * amplitude / length
    moved = crossing * np.minimum(doubt, 1.0) ** power + doubt
    # Up to an exponent of 1 a root that is moved changes by as much as it is moved.
    root = 4 * np.minimum(slip, 4.0) * np.minimum(2 * amplitude / length, 1.0) ** power
    moved += np.where(curves.s < 1, root, 0.0)
    return np.asarray(4 * (1 + np.abs(curves.w_n)) * speed * moved)


def _above(curves: _Curves, first: Floats, last: Floats) -> tuple[_Panels, _Panels]:
    """Stretches with t > 0 apart from the horizon, and those that start at it."""
    core, ends = [], []
    for centre in (-2 * np.pi, 0.0, 2 * np.pi):
        for side in (1.0, -1.0):
            low, high = (first, last) if side > 0 else (-last, -first)
            low, high = np.maximum(low - side * centre, 0.0), np.minimum(high - side * centre, curves.half)
            k = np.flatnonzero(low < high)
            half, one = curves.half[k], np.ones(k.size)
            a, b = half - high[k], half - low[k]
            reach = np.minimum(half, np.pi - half) / 2
            rooted = ~curves.flat[k] & (curves.s[k] < SMOOTH) & (a < reach / 8)
            start = np.where(rooted, np.minimum(b, reach), a)
            ends.append(_Panels(k, side * one, one, 0 * one, start).take(rooted))
            ends.append(_Panels(k, side * one, -one, 0 * one, a).take(rooted & (a > 0)))
            core.append(_Panels(k, side * one, one, start, b).take(start < b))
    return _joined(core), _joined(ends)


@dataclass(frozen=True, eq=False)
class _Sums:
    """Shares and bounds (k,) of curves, added up panel by panel."""

    curves: _Curves
    share: Floats
    bound: Floats

    def add(self, curve: Ints, share: Floats, bound: Floats) -> None:
        self.share[:] += np.bincount(curve, share, self.share.size)
        self.bound[:] += np.bincount(curve, bound, self.share.size)

    def azimuth(self, curve: Ints, a: Floats, b: Floats, sign: Floats | float = 1.0) -> None:
        """Add w.n times the azimuth about w from x = a to b, at most 90 degrees apart."""
        c = self.curves.take(curve)
        xa, ya, xb, yb = _at(c.x, a), _at(c.y, a), _at(c.x, b), _at(c.y, b)
        turn = np.arctan2(xa * yb - ya * xb, xa * xb + ya * yb)
        # Seen from inside, a convex curve turns one way, and by more than pi only beside the point.
        way = np.sign(c.w_turn[2])
        turn = np.where(c.inside & (turn * way < -1e-9), turn + 2 * np.pi * way, turn)
        near = sum(1 / np.sqrt(np.maximum(x * x + y * y, 1e-300)) for x, y in ((xa, ya), (xb, yb)))
        bound = np.minimum(MOVED * EPS * c.size * near, 4 * np.pi) + ROUNDED * EPS * np.abs(turn)
        self.add(curve, sign * c.w_n * turn, np.abs(c.w_n) * bound)

    def below(self, first: Floats, last: Floats) -> None:
        """Add the stretches with t < 0."""
        half, beside = self.curves.half, self.curves.through_opposite()
        for turns in (-1, 0):
            low = np.maximum(first, 2 * np.pi * turns + half)
            high = np.minimum(last, 2 * np.pi * (turns + 1) - half)
            k = np.flatnonzero(low < high)
            few = np.ceil((high - low)[k] / (np.pi / 2)).astype(np.int64)
            for parts in distinct(few).tolist():
                some = k[few == parts]
                step = (high - low)[some] / parts
                for part in range(parts):
                    self.azimuth(some, low[some] + part * step, low[some] + (part + 1) * step)
            self.add(k, np.zeros(k.size), beside[k] * (2 * np.pi) * np.abs(self.curves.w_n[k]))

    def too_many(self, number: int, panels: _Panels) -> bool:
        """Whether these are the last to be tried: whatever is left of them is told by the bound."""
        return number == HALVINGS - 1 or panels.curve.size > MANY * (self.share.size + 100)

    def panels_azimuth(self, panels: _Panels) -> None:
        half = self.curves.half[panels.curve]
        near, far = half - panels.a, half - panels.b
        right = panels.side > 0
        self.azimuth(panels.curve, np.where(right, far, -near), np.where(right, near, -far), panels.sign)

    def ends(self, panels: _Panels) -> list[_Panels]:
        """Add panels from the horizon to y = b, or as much of them as can be; the rest."""
        rest: list[_Panels] = []
        for number in range(HALVINGS):
            again, last = [], self.too_many(number, panels)
            for begin in range(0, panels.curve.size, AT_ONCE):
                few = panels.take(slice(begin, begin + AT_ONCE))  # type: ignore[arg-type]
                c = self.curves.take(few.curve)
                y = few.b * NODES
                at = _Nodes.of(c, few.side, y, True)
                log = c.s * np.log(np.maximum(at.t / NODES, 1e-300))
                form = (at.n_turn - c.w_n * at.w_turn / at.z) / at.square
                slope = at.speed * (4 + np.abs(c.w_n) * 4)
                noise = MOVED * c.size * slope / np.sqrt(at.square) + ROUNDED * np.abs(form)
                share, left, stands = root(np.exp(log) * form, EPS * noise.max(axis=0), c.s)
                stands |= last
                doubt = EPS * few.b * noise.max(axis=0)
                k = np.flatnonzero(stands)
                done = few.take(k)
                self.add(done.curve, (done.sign * done.b) * share[k], done.b * left[k] + doubt[k])
                self.panels_azimuth(done)
                near, far = few.take(~stands).halves()
                again.append(near)
                rest.append(far)
            if not again:
                break
            panels = _joined(again)
        return rest

    def core(self, panels: _Panels) -> None:
        """Add panels with t > 0."""
        for number in range(HALVINGS):
            if not panels.curve.size:
                break
            c = self.curves.take(panels.curve)
            width = (panels.b - panels.a) / 2
            x = panels.side * (c.half - (panels.a + panels.b) / 2)
            length = width * c.speed(x, width)
            apart = np.sqrt((_at(c.x, x) ** 2 + _at(c.y, x) ** 2) / np.maximum(_at(c.square, x), c.least))
            far = (c.s / 2 * np.maximum(apart - length, 0.0) ** 2 > FALL) & (width < np.pi / 4)
            self.panels_azimuth(panels.take(far))
            last = self.too_many(number, panels)
            near = ~far & ((length <= PANEL / np.sqrt(c.s + 1)) | last)
            again = panels.take(~far & ~near).halves()
            fine = panels.take(near)
            for begin in range(0, fine.curve.size, AT_ONCE):
                few = fine.take(slice(begin, begin + AT_ONCE))  # type: ignore[arg-type]
                again += few.take(~self._gauss(few, last)).halves()
            panels = _joined(again)

    def _gauss(self, panels: _Panels, last: bool) -> Bools:
        """Add those panels whose series has fallen off, or all; which ones."""
        c, span = self.curves.take(panels.curve), panels.b - panels.a
        at = _Nodes.of(c, panels.side, panels.a + span * NODES, False)
        log = np.log1p(-np.minimum(at.z, 0.5)) / 2
        low = at.z > 0.5
        log[low] = np.log(np.maximum(at.t[low], 1e-300))
        fall = np.expm1(c.s * log)
        power, ratio = 1 + fall, -fall / at.z
        one, two = at.n_turn * power / at.square, c.w_n * at.w_turn * ratio / at.square
        slope = 3 + 2 * c.s * power * np.sqrt(at.z) + np.abs(c.w_n) * np.minimum(c.s, 2 / at.z)
        noise = MOVED * c.size * at.speed * slope / np.sqrt(at.square) + ROUNDED * (np.abs(one) + np.abs(two))
        share, left, stands = gauss(one + two, EPS * noise.max(axis=0))
        stands |= last
        bound = span * (left + EPS * (WEIGHTS * noise).sum(axis=0))
        k = np.flatnonzero(stands)
        self.add(panels.curve[k], (panels.sign * span * share)[k], bound[k])
        return stands


@dataclass(frozen=True, eq=False)
class _Nodes:
    """Values at nodes, each array (COUNT, k): |v|^2, t > 0, 1 - t^2, the forms of n and w, and the curve's speed."""

    square: Floats
    t: Floats
    z: Floats
    n_turn: Floats
    w_turn: Floats
    speed: Floats

    @classmethod
    def of(cls, c: _Curves, side: Floats, y: Floats, rooted: bool) -> _Nodes:
        x = side * (c.half - y)
        cosine, sine = np.cos(x), np.sin(x)

        def at(form: Floats) -> Floats:
            out = np.asarray(form[0] * cosine)
            out += form[1] * sine
            out += form[2]
            return out

        square = np.maximum(at(c.square), c.least)
        # Beside the horizon t as a product keeps its digits.
        height = 2 * c.t[0] * np.sin(y / 2) * np.sin(c.half - y / 2) if rooted else at(c.t)
        length = np.sqrt(square)
        one, two = at(c.x), at(c.y)
        z = np.clip((one * one + two * two) / square, 1e-290, 1.0)
        return cls(square, height / length, z, at(c.n_turn), at(c.w_turn), c.rho / length)
