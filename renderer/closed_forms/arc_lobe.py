"""The lobe's boundary integral over arcs of great circles, for any real exponent, with its error.

phi from the circle's point nearest to w, t = c cos(phi), 1 - t^2 = q^2 + c^2 sin(phi)^2, g the circle's normal:
the integral of (n.g) t+^s + (w.n) q (1 - t+^s)/(1 - t^2) dphi, in three parts.

core       t^s > e^-37 and |phi| < 60 degrees: Gauss-Legendre. The integrand is analytic for |Re phi| < 90 degrees, also
           at t = 1, where azimuth and power are badly known one by one
band       from there to 90 degrees: the azimuth about w minus a power series in cos(phi), for any exponent
elsewhere  the azimuth alone, in closed form

Moving an arc by d changes its share by the integral of (s + 2) t^s n.u over the strip it sweeps and by the form along
the strip's two ends: the bound for what rounding does to its plane, to w and to its ends.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cache

import numpy as np

from nusselt.renderer.vectors import Bools, Floats, Ints, cross, dot

EPS = float(np.finfo(np.float64).eps)
FALL = 37.0
"""e^-37 is below half the rounding of one."""
BAND, TERMS = np.pi / 3, 28
"""Where the series begins, and its terms: 4^-28 is left."""
NODES = (8, 12, 16, 20, 24, 32, 44)
"""Numbers of Gauss-Legendre nodes to choose from; no core asks for more than 44."""
LEFT = 40.0
"""Quadrature leaves e^-LEFT of the integrand's largest size on its ellipse."""
AT_ONCE = 16384
"""Values at once: their arrays fit into the cache."""
LONGER = 9.0
"""Ratio of squares from which the start is much the longer."""
MOVED = 6.0
"""Roundings that move an arc, in units of eps |a| |b - a| / |a x b|, counted."""
ROUNDED = 16.0
"""Roundings of the terms themselves."""


def plane_of(start: Floats, end: Floats) -> tuple[Floats, Floats]:
    """start x end (3, k), and |a| |end - start| (k,), a one of the ends and not much the longer.

    It is taken as a x (end - start), so that a short arc keeps its digits: its error is 2.2 eps of the second.
    """
    step, spare = end - start, np.empty_like(start[0])
    a2, size = dot_into(start, start, spare), dot_into(step, step, spare)
    size *= a2
    normal = np.empty_like(step)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.multiply(start[j], step[k], out=normal[i])
        normal[i] -= np.multiply(start[k], step[j], out=spare)
    far = np.flatnonzero(a2 > LONGER * dot_into(end, end, spare))
    if far.size:
        normal[:, far] = cross(end[:, far], step[:, far])
        size[far] = dot(end[:, far], end[:, far]) * dot(step[:, far], step[:, far])
    return normal, np.sqrt(size, out=size)


def dot_into(a: Floats, b: Floats, spare: Floats) -> Floats:
    """`dot` with no array made but its own: half of what Lambert's arcs cost."""
    out = np.asarray(a[0] * b[0])
    out += np.multiply(a[1], b[1], out=spare)
    out += np.multiply(a[2], b[2], out=spare)
    return out


def no_plane(a: Floats, b: Floats) -> Floats:
    """Bounds (k,) of arcs without a plane, whose share is 0: their ends look one way, or are opposite."""
    longer = np.sqrt(np.maximum(dot(a, a), dot(b, b)))
    step = np.sqrt(dot(b - a, b - a)) / np.where(longer > 0, longer, 1)
    return np.where(dot(a, b) < 0, 4 * np.pi, ROUNDED * EPS * step)


@dataclass(frozen=True, eq=False)
class _Arcs:
    """Arcs first <= phi <= last, each array (k,): turn = last - first with all digits, n_g = n . g, w_n = w . n."""

    q: Floats
    c: Floats
    first: Floats
    last: Floats
    turn: Floats
    n_g: Floats
    w_n: Floats
    s: Floats

    def take(self, index: Ints) -> _Arcs:
        return _Arcs(*(getattr(self, f.name)[index] for f in fields(self)))

    def off(self, phi: Floats) -> Floats:
        """1 - t^2."""
        return np.asarray(self.q * self.q + (self.c * np.sin(phi)) ** 2)


def lobe_arcs(start: Floats, end: Floats, n: Floats, w: Floats, s: Floats) -> tuple[Floats, Floats]:
    """(s + 2) times the share of the lobe integral of great-circle arcs, and its bound, (k,); unit n and w (3, k)."""
    normal, size = plane_of(start, end)
    sine = np.sqrt(dot(normal, normal))
    safe = np.where(sine > 0, sine, 1.0)
    g = normal / safe
    q = dot(w, g)
    nearest = w - q * g
    across = cross(g, nearest)
    turn = np.where(sine > 0, np.arctan2(sine, dot(start, end)), 0.0)
    first = np.arctan2(dot(start, across), dot(start, nearest))
    # Turned so that the middle lies within pi of the nearest point: no arc of up to pi then meets t > 0 twice.
    first = np.where(first + turn / 2 > np.pi, first - 2 * np.pi, first)
    arcs = _Arcs(q, np.sqrt(dot(nearest, nearest)), first, first + turn, turn, dot(n, g), dot(w, n), s)
    doubt = MOVED * EPS * size / safe
    low, high, banded = _parts(arcs)
    outer = _azimuth(arcs, first, low) + _azimuth(arcs, high, arcs.last)
    power, ratio, left = _core(arcs, low, high)
    band, some = _bands(arcs, banded)
    n_size, w_size = np.abs(arcs.n_g), np.abs(arcs.w_n)
    w_q = w_size * np.abs(q)
    share = arcs.w_n * (outer + q * ratio) + arcs.n_g * power + band
    cut = (low < high) & (high - low < turn)
    rounding = n_size * turn + w_q * ratio + w_size * np.abs(outer) + some + cut * (n_size + w_size)
    bound = np.minimum(doubt * _swept(arcs, power, doubt), 4 * np.pi) + ROUNDED * EPS * rounding
    bound += left * (n_size + w_q * (4 + 0.7 * s))
    none = np.flatnonzero(sine == 0)
    bound[none] = no_plane(start[:, none], end[:, none]) * (1 + np.sqrt(s[none]))
    return share, bound


def _parts(arcs: _Arcs) -> tuple[Floats, Floats, Bools]:
    """The core from low to high, and which arcs have bands."""
    first, last = arcs.first, arcs.last
    cosine = np.exp(-FALL / np.maximum(arcs.s, 1e-300)) / np.maximum(arcs.c, 1e-300)
    reach = np.arccos(np.minimum(cosine, 1.0))
    # A core that keeps half its length away from 90 degrees needs no band.
    away = np.pi / 2 - np.maximum(np.abs(first), np.abs(last)) > arcs.turn / 2
    banded = (reach > BAND) & ~away
    reach = np.where(banded, BAND, reach)
    return np.clip(-reach, first, last), np.clip(reach, first, last), banded


def _azimuth(arcs: _Arcs, a: Floats, b: Floats) -> Floats:
    """Integral of q / (1 - t^2) from a to b, less than pi apart: by the tangent of a difference, nothing cancels."""
    out = np.zeros(a.shape)
    k = np.flatnonzero(a < b)
    if k.size:
        q, a, b = arcs.q[k], a[k], b[k]
        span = np.where((a == arcs.first[k]) & (b == arcs.last[k]), arcs.turn[k], b - a)
        turned = np.arctan2(np.abs(q) * np.sin(span), q * q * np.cos(a) * np.cos(b) + np.sin(a) * np.sin(b))
        out[k] = np.copysign(turned, q)
    return out


def _core(arcs: _Arcs, low: Floats, high: Floats) -> tuple[Floats, Floats, Floats]:
    """Integrals of t^s and of (1 - t^s)/(1 - t^2) from low to high, and what quadrature leaves of both, relatively."""
    power, ratio, left = np.zeros((3, low.size))
    live = np.flatnonzero(low < high)
    if not live.size:
        return power, ratio, left
    few, low, high = arcs.take(live), low[live], high[live]
    middle = (low + high) / 2
    half = np.where((low == few.first) & (high == few.last), few.turn, high - low) / 2
    left[live] = 5.2 * np.exp(-LEFT) * half
    asked = np.searchsorted(np.array(NODES[:-1]), _nodes_needed(middle, half, few.s))
    # Where t^2 < 1/2 throughout it is taken as it is, where not from 1 - t^2: neither loses digits.
    far = few.c * np.cos(np.clip(0.0, low, high)) < np.sqrt(0.5)
    for number, nodes in enumerate(NODES):
        for apart in (False, True):
            here = np.flatnonzero((asked == number) & (far == apart))
            for begin in range(0, here.size, AT_ONCE // nodes):
                k = here[begin : begin + AT_ONCE // nodes]
                sums = _sums(few.c[k], few.q[k], few.s[k], middle[k], half[k], nodes, apart)
                power[live[k]], ratio[live[k]] = sums
    return power, ratio, left


def _nodes_needed(middle: Floats, half: Floats, s: Floats) -> Floats:
    """Nodes that leave e^-LEFT of the largest value on the Bernstein ellipse middle + half (C cos + i S sin).

    |cos(x + iy)|^2 <= 1 + sinh(y)^2, so that |t^s| <= T = exp(s/2 sinh(half S)^2); |1 - t^s|/|1 - t^2| <= T max(4,
    0.7 s), from |1 - e^x| <= |x| max(1, |e^x|) where |1 - t^2| < 1/2. K nodes err by at most 64/15 half M r^-2K /
    (1 - r^-2), log r = asinh(S) (Trefethen, Approximation Theory and Practice, theorem 19.3).
    """
    c = np.minimum((np.pi / 2 - np.abs(middle)) / half, 100.0)
    size = np.sqrt(np.minimum(60 / (s * half * half + 1), c * c - 1))
    return np.asarray((LEFT + s / 2 * np.sinh(half * size) ** 2) / (2 * np.arcsinh(size)))


@cache
def _rule(nodes: int) -> tuple[Floats, Floats]:
    x, w = np.polynomial.legendre.leggauss(nodes)
    return x[:, None], w[:, None]


def _sums(
    c: Floats, q: Floats, s: Floats, middle: Floats, half: Floats, nodes: int, far: bool
) -> tuple[Floats, Floats]:
    """Integrals of t^s and of (1 - t^s)/(1 - t^2) over middle +- half."""
    x, weight = _rule(nodes)
    phi = half * x
    phi += middle
    if far:
        t2 = np.cos(phi, out=phi)
        t2 *= c
        t2 *= t2
        np.maximum(t2, 1e-300, out=t2)
        z, log = 1 - t2, np.log(t2)
    else:
        z = np.sin(phi, out=phi)
        z *= z
        z *= c * c
        z += q * q
        np.maximum(z, 1e-290, out=z)
        log = np.log1p(-z)
    log *= s / 2
    fall = np.expm1(log, out=log)
    fall *= weight
    power = half * (2 + fall.sum(axis=0))
    fall /= z
    return power, -half * fall.sum(axis=0)


def _bands(arcs: _Arcs, banded: Bools) -> tuple[Floats, Floats]:
    """Integral of t^s (n.g - (w.n) q/(1 - t^2)) over 60 to 90 degrees on both sides, and the size of its terms."""
    band, size = np.zeros((2, banded.size))
    for side in (1, -1):
        near, far = (arcs.first, arcs.last) if side > 0 else (-arcs.last, -arcs.first)
        k = np.flatnonzero(banded & (far > BAND) & (near < np.pi / 2))
        if k.size:
            few = arcs.take(k)
            x0, x1 = np.cos(np.maximum(near[k], BAND)), np.cos(np.minimum(far[k], np.pi / 2))
            part, terms = _series(few, x0, x1)
            band[k] += part
            size[k] += terms
    return band, size


def _series(arcs: _Arcs, x0: Floats, x1: Floats) -> tuple[Floats, Floats]:
    """From x = cos(phi) = x1 to x0 <= 1/2, by c^s x^(s+1) sum of (n.g a_k - (w.n) q e_k) x^2k / (s + 2k + 1).

    a_k the coefficients of (1 - x^2)^-1/2 and e_k of (1 - x^2)^-1/2 (1 - c^2 x^2)^-1, all positive.
    """
    c2, w_q, order = arcs.c * arcs.c, arcs.w_n * arcs.q, arcs.s + 1
    p0, p1 = (x * np.exp(arcs.s * np.log(np.maximum(arcs.c * x, 1e-300))) for x in (x0, x1))
    size = 1.6 * (np.abs(arcs.n_g) + np.abs(w_q)) * p0 / order
    x0, x1 = x0 * x0, x1 * x1
    a, e, total = 1.0, np.ones(c2.shape), np.zeros(c2.shape)
    for k in range(TERMS):
        total += (arcs.n_g * a - w_q * e) * (p0 - p1) / (order + 2 * k)
        a *= (2 * k + 1) / (2 * k + 2)
        e *= c2
        e += a
        p0 *= x0
        p1 *= x1
    return total, size


def _swept(arcs: _Arcs, power: Floats, doubt: Floats) -> Floats:
    """By how much a share changes where its arc is moved, in units of the displacement.

    The form is at most t^s + |w.n| (1 - t^s)/sqrt(1 - t^2), and that is below 0.46 sqrt(s). A short arc that moves as
    a whole within t > 0 changes by its length times the form's slope.
    """
    s_plus = arcs.s + 2
    ends = s_plus * power + 4
    root, w_size = 0.46 * np.sqrt(arcs.s), np.abs(arcs.w_n)
    for phi in (arcs.first, arcs.last):
        apart = 1 / np.sqrt(np.maximum(arcs.off(phi), 1e-300))
        ends += w_size * np.where(np.abs(phi) < np.pi / 2, np.minimum(root, apart), apart)
    farthest = np.maximum(np.abs(arcs.first), np.abs(arcs.last))
    least = np.where(arcs.s < 1, np.maximum(arcs.c * np.cos(farthest), 1e-300), 1.0)  # t^(s - 1) is below 1/t
    inside = farthest < np.pi / 2
    ends = np.where(inside, np.minimum(ends, 2 * s_plus * arcs.turn / least), ends)
    # Beside -w the azimuth jumps by 2 pi.
    beside = (farthest > np.pi) & (np.abs(arcs.q) < 4 * doubt)
    return np.asarray(ends + beside * (2 * np.pi * w_size / np.maximum(doubt, 1e-300)))
