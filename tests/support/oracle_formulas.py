"""Irradiance and Phong lobe of a parallelogram in high precision, for the oracles: mpmath alone, nothing of ours.

Irradiance: the polygon clipped at the horizon, then Lambert's formula. Lobe: the boundary form with two integrals an
edge, each by Gauss-Legendre to the digits asked for; and, to check it, polar coordinates about the mirror direction
with incomplete beta functions. Where terms cancel the precision is doubled until 25 digits are left.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

from mpmath import mp, mpf

Vector = list[mpf]
DIGITS = 25
"""Digits that an oracle has."""


class TooFew(Exception):
    """The digits have cancelled."""


def vector(v: list[float]) -> Vector:
    return [mpf(x) for x in v]


def dot(a: Vector, b: Vector) -> mpf:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def plus(a: Vector, b: Vector, k: mpf | int = 1) -> Vector:
    """a + k b."""
    return [x + k * y for x, y in zip(a, b, strict=True)]


def unit(a: Vector) -> Vector:
    length = mp.sqrt(dot(a, a))
    return [x / length for x in a]


def clip(polygon: list[Vector], plane: Vector) -> list[Vector]:
    """The part of a convex polygon where plane . v >= 0 (Sutherland and Hodgman)."""
    out: list[Vector] = []
    for k, b in enumerate(polygon):
        a = polygon[k - 1]
        za, zb = dot(plane, a), dot(plane, b)
        if (za > 0 and zb < 0) or (za < 0 and zb > 0):
            out.append(plus(a, plus(b, a, -1), za / (za - zb)))
        if zb >= 0:
            out.append(b)
    return out


def seen(case: dict) -> list[Vector]:
    """The corners as the point sees them, scaled to size 1; none if the light is seen edge-on."""
    p, e1, e2 = (vector(case[k]) for k in ("P", "e1", "e2"))
    p = plus(p, vector(case["x"]), -1)
    if dot(cross(e1, e2), p) == 0:
        return []
    size = max(abs(x) for v in (p, e1, e2) for x in v)
    p, e1, e2 = ([x / size for x in v] for v in (p, e1, e2))
    return [p, plus(p, e1), plus(plus(p, e1), e2), plus(p, e2)]


def angle(a: Vector, b: Vector) -> mpf:
    normal = cross(a, b)
    return mp.atan2(mp.sqrt(dot(normal, normal)), dot(a, b))


def edges(polygon: list[Vector]) -> list[tuple[Vector, Vector, Vector]]:
    """Pairs of corners, and the unit normal of their plane through the origin."""
    found = []
    for k, b in enumerate(polygon):
        normal = cross(polygon[k - 1], b)
        if dot(normal, normal) > 0:
            found.append((polygon[k - 1], b, unit(normal)))
    return found


def total(terms: list[mpf]) -> mpf:
    """|sum|, if enough digits are left of it."""
    value, largest = abs(mp.fsum(terms)), max((abs(t) for t in terms), default=mpf(0))
    if value <= largest * mpf(10) ** (DIGITS - mp.dps + 10) and largest > 0:
        raise TooFew
    return value


def irradiance(case: dict) -> mpf:
    polygon, n = seen(case), unit(vector(case["n"]))
    polygon = clip(polygon, n) if polygon else []
    if not any(dot(n, v) > 0 for v in polygon):
        return mpf(0)
    return total([angle(a, b) * dot(n, g) / 2 for a, b, g in edges(polygon)])


def lobe_polygon(case: dict) -> tuple[list[Vector], Vector, Vector]:
    n, w = unit(vector(case["n"])), unit(vector(case["w"]))
    polygon = seen(case)
    for plane in (n, w):
        polygon = clip(polygon, plane) if polygon else []
        if not any(dot(plane, v) > 0 for v in polygon):
            return [], n, w
    return polygon, n, w


def lobe(case: dict) -> mpf:
    """(s + 2) I = sum over edges of (w.n) q J2 + (n.G) J1 (Arvo 1995, for a real exponent)."""
    polygon, n, w = lobe_polygon(case)
    s = mpf(case["s"])
    if not polygon:
        return mpf(0)
    arcs = [Arc(a, b, g, w) for a, b, g in edges(polygon)]
    z_peak = min(arc.nearest() for arc in arcs)
    sides = [arc.q > 0 for arc in arcs if arc.q != 0]
    outside = any(sides) and not all(sides)
    terms = []
    for arc in arcs:
        j1, j2 = arc.moments(s, outside and s * z_peak > 40, z_peak)
        terms += [dot(w, n) * j2, dot(n, arc.g) * j1]
    return total(terms) / (s + 2)


class Arc:
    """An edge about w: t = c cos(phi), 1 - t^2 = q^2 + c^2 sin(phi)^2, phi from start to stop."""

    def __init__(self, a: Vector, b: Vector, g: Vector, w: Vector) -> None:
        self.g, self.q = g, dot(w, g)
        near = plus(w, g, -self.q)
        self.c = mp.sqrt(dot(near, near))
        near = near if self.c > mpf(10) ** (-mp.dps // 2) else a
        across = cross(g, near)
        self.start = mp.atan2(dot(a, across), dot(a, near))
        self.stop = self.start + angle(a, b)

    def z(self, phi: mpf) -> mpf:
        return self.q**2 + (self.c * mp.sin(phi)) ** 2

    def nearest(self) -> mpf:
        return self.z(min(max(mpf(0), self.start), self.stop))

    def moments(self, s: mpf, tail: bool, z_peak: mpf) -> tuple[mpf, mpf]:
        """J1 and q J2; in the tail without the 1 of J2, whose sum over the edges is 0."""

        def power(phi: mpf) -> mpf:
            return (self.c * abs(mp.cos(phi))) ** s if s else mpf(1)

        def ratio(phi: mpf) -> mpf:
            z = self.z(phi)
            if tail:
                return -power(phi) / z
            # (1 - t^s) / z loses the digits of 1 - t^s near w.
            return (-mp.expm1(s / 2 * mp.log1p(-z)) / z if z < 1 else 1 / z) if z > 0 else s / 2

        if not s:
            return self.stop - self.start, mpf(0)
        low, high, points = self.panels(s, z_peak)
        j1, j2 = (gauss(f, points) for f in (power, ratio))
        outer = 0 if tail else self.azimuth(self.start, low) + self.azimuth(high, self.stop)
        return j1, self.q * j2 + outer

    def panels(self, s: mpf, z_peak: mpf) -> tuple[mpf, mpf, list[mpf]]:
        """The stretch on which t^s counts, and points that divide it, closer where t^s or 1/z changes faster."""
        fall = mp.log(10) * (mp.dps + 5)
        limit = mp.exp(mp.log1p(-z_peak) / 2 - fall / s) / self.c if self.c > 0 else mpf(1)
        reach = mp.acos(limit) if limit < 1 else mpf(0)
        low, high = (min(max(x, self.start), self.stop) for x in (-reach, reach))
        width = 2 / mp.sqrt(s + 4)
        steps = [k * width for k in range(1, int(reach / width) + 1)]
        near = min(max(mpf(0), low), high)
        rate = s * self.c**2 * abs(mp.sin(near)) / mp.sqrt(1 - self.z(near)) if self.z(near) < 1 else mpf(0)
        steep = [near + sign * k / (rate + mp.sqrt(s)) for k in (3, 9, 20, 40, 70, 110) for sign in (-1, 1)]
        pole = [sign * abs(self.q) * 2**k for k in range(8) for sign in (-1, 1)]
        ends = [x * (1 - mpf(2) ** -k) for x in (low, high) for k in (2, 4, 6, 9, 12, 16, 20, 30, 40)]
        ends = [x for x in ends if abs(abs(x) - mp.pi / 2) < 0.3]
        inner = {x for x in [0, *steps, *(-x for x in steps), *steep, *pole, *ends] if low < x < high}
        return low, high, sorted({low, high, *inner})

    def azimuth(self, a: mpf, b: mpf) -> mpf:
        """Integral of q / (1 - t^2) between two phi."""
        side = abs(self.q)
        turn = [mp.atan2(mp.sin(phi), side * mp.cos(phi)) for phi in (a, b)]
        return mp.sign(self.q) * (turn[1] - turn[0])


def gauss(f: Callable[[mpf], mpf], points: list[mpf]) -> mpf:
    """Integral over all panels, to 10 digits fewer than the working precision."""
    sums = mpf(0)
    for a, b in pairwise(points):
        if b > a:
            sums += panel(f, a, b)
    return sums


def panel(f: Callable[[mpf], mpf], a: mpf, b: mpf, depth: int = 0) -> mpf:
    """One panel with two rules; halved where they differ."""
    coarse, fine = (rule(f, a, b, nodes) for nodes in (mp.dps // 2, mp.dps * 3 // 4))
    if abs(coarse - fine) <= mpf(10) ** (-mp.dps // 2) * abs(fine) or depth > 40:
        return fine
    middle = (a + b) / 2
    return panel(f, a, middle, depth + 1) + panel(f, middle, b, depth + 1)


_rules: dict[tuple[int, int], list[tuple[mpf, mpf]]] = {}


def rule(f: Callable[[mpf], mpf], a: mpf, b: mpf, nodes: int) -> mpf:
    """Gauss-Legendre; nodes by Newton's method."""
    key = (nodes, mp.prec)
    if key not in _rules:
        _rules[key] = legendre(nodes)
    middle, half = (a + b) / 2, (b - a) / 2
    return half * mp.fsum(weight * f(middle + half * x) for x, weight in _rules[key])


def legendre(nodes: int) -> list[tuple[mpf, mpf]]:
    pairs = []
    for k in range(1, nodes + 1):
        x = mp.cos(mp.pi * (k - mpf(1) / 4) / (nodes + mpf(1) / 2))
        for _ in range(4 + mp.dps.bit_length()):
            p, before = mpf(1), mpf(0)
            for j in range(nodes):
                p, before = ((2 * j + 1) * x * p - j * before) / (j + 1), p
            slope = nodes * (x * p - before) / (x * x - 1)
            step = p / slope
            x -= step
            if abs(step) < mpf(10) ** (-mp.dps + 3):
                break
        pairs.append((x, 2 / ((1 - x * x) * slope * slope)))
    return pairs


def lobe_by_polar_angle(case: dict) -> mpf:
    """The lobe again: about w, u = w cos(g) + e(psi) sin(g), the inner integral a power and an incomplete beta."""
    polygon, n, w = lobe_polygon(case)
    s = mpf(case["s"])
    if not polygon:
        return mpf(0)
    x = unit(cross(w, [mpf(1), mpf(0), mpf(0)] if abs(w[0]) < 0.7 else [mpf(0), mpf(1), mpf(0)]))
    y = cross(w, x)
    w_n = dot(w, n)
    terms = []
    for a, b, g in edges(polygon):
        q, gx, gy = dot(w, g), dot(x, g), dot(y, g)
        if q == 0:
            continue
        first = mp.atan2(dot(a, y), dot(a, x))
        turn = mp.atan2(dot(w, cross(a, b)), dot(plus(a, w, -dot(a, w)), plus(b, w, -dot(b, w))))
        slope = mp.atan2(-gy * mp.sign(q), -gx * mp.sign(q))  # where the edge's circle comes closest

        def ray(psi: mpf, q: mpf = q, gx: mpf = gx, gy: mpf = gy) -> mpf:
            # The edge lies at tan(g) = -q / (e . G); from there outwards, for the sum over edges is over the inside.
            e_g, e_n = gx * mp.cos(psi) + gy * mp.sin(psi), dot(x, n) * mp.cos(psi) + dot(y, n) * mp.sin(psi)
            cos2 = e_g**2 / (e_g**2 + q**2)
            outer = mp.betainc((s + 1) / 2, mpf(3) / 2, 0, cos2) / 2  # of t^s sin^2 from g to pi/2
            return w_n * cos2 ** (s / 2 + 1) / (s + 2) + e_n * outer

        width = 2 / mp.sqrt(s * max(abs(q), mpf(1) / 10) ** 2 + 4)
        cuts = {first, first + turn}
        for k in range(-40, 41):
            for centre in (slope, slope - 2 * mp.pi, slope + 2 * mp.pi):
                at = centre + k * width
                if min(first, first + turn) < at < max(first, first + turn):
                    cuts.add(at)
        points = sorted(cuts)
        terms.append(mp.sign(turn) * -gauss(ray, points))
        terms.append(whole(s, w_n, dot(x, n), dot(y, n), first, turn))
    return total(terms)


def whole(s: mpf, w_n: mpf, x_n: mpf, y_n: mpf, first: mpf, turn: mpf) -> mpf:
    """The sector of the hemisphere about w between two azimuths."""
    swing = x_n * (mp.sin(first + turn) - mp.sin(first)) - y_n * (mp.cos(first + turn) - mp.cos(first))
    return w_n * turn / (s + 2) + swing * mp.beta((s + 1) / 2, mpf(3) / 2) / 2


def precise(form: Callable[[dict], mpf], case: dict, digits: int = 50) -> mpf:
    """A form's value with as many digits as it takes."""
    while True:
        with mp.workdps(digits):
            try:
                return +form(case)
            except TooFew:
                if digits > 1000:
                    raise
                digits = int(digits * 1.6)
