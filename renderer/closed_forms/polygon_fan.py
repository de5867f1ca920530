"""An integral over a plane polygon whose every term has the same sign: digits that no cancellation can take.

With the origin at the shading point, v* a point of the polygon's plane (best its nearest to the origin), |v*| = 1 and
c on an edge, the triangle from v* over the edge holds

    J = integral of z |v|^-(4+s) dA,   v = v* + r (c - v*),   z linear and >= 0 in v.

The substitution r = y / (rho (1 - y)), rho = |c - v*|, turns |v|^2 = 1 + 2 B r + rho^2 r^2 into
b(y) / (1-y)^2 with b = 1 - 2 y (1 - y) (1 - B/rho), a number between 1/2 and 1 whatever the size of the triangle.
With l the coordinate along the edge, d its distance from v*, Y = rho / (1 + rho) and y = Y x:

    J = d * integral dl / (1 + rho)^2 * integral_0^1 x [z* (1 - x) + z_c x (1 - Y)] (1 - y)^s b^-(2+s/2) dx

Along the edge the integrand is analytic within max(1, rho, d) of the real axis: in l = m sinh(u), m = max(1, d),
panels of length 1.25 take 14 Gauss-Legendre nodes to 4e-16; over x two panels of 14 leave 1e-16. For an exponent s,
m shrinks to the lobe's width and x stops where t^s is below e^-40.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cache
from typing import Any

import numpy as np

from nusselt.renderer.vectors import Floats, Ints

PANEL = 1.25
"""Largest length of a panel in u."""
ACROSS, ACROSS_LOBE, ALONG = 14, 20, 15
"""Nodes over half of x, the same for a lobe, and over a panel."""
FALL = 40.0
"""e^-40 of the largest value is left out."""
BLOCK = 256
"""Panels at once: their nodes fit into the cache."""
FRACTIONAL = 12.0
"""Below this exponent, unless it is whole, (1-y)^s near y = 1 is no polynomial to Gauss-Legendre: a panel is graded."""
GRADE, GRADED_NODES = 6, 30


@dataclass(frozen=True, eq=False)
class Sectors:
    """Triangles about v*, k of them, lengths in units of |v*|.

    Parameters
    ----------
    owner : (k,) int
        Which point a triangle belongs to.
    start, stop : (k,) float64
        l at the edge's ends.
    length : (k,) float64
        stop - start, without the rounding of a difference.
    distance : (k,) float64
        d, negative for a triangle that is to be taken away.
    z_start, z_stop, z_star : (k,) float64
        Heights at the edge's ends and at v*.
    b_distance, b_along : (k,) float64
        v* . (c - v*) = b_distance |d| + b_along l.
    exponent : (k,) float64
        s >= 0.
    """

    owner: Ints
    start: Floats
    stop: Floats
    length: Floats
    distance: Floats
    z_start: Floats
    z_stop: Floats
    z_star: Floats
    b_distance: Floats
    b_along: Floats
    exponent: Floats

    def take(self, index: Any) -> Sectors:
        """The triangles at ``index``."""
        return Sectors(*(getattr(self, f.name)[index] for f in fields(self)))

    def from_nearer_end(self) -> Sectors:
        """The same with |start| <= |stop|: heights are then exact where most of the integral is."""
        turn = np.abs(self.start) > np.abs(self.stop)
        return replace(
            self,
            start=np.where(turn, -self.stop, self.start),
            stop=np.where(turn, -self.start, self.stop),
            z_start=np.where(turn, self.z_stop, self.z_start),
            z_stop=np.where(turn, self.z_start, self.z_stop),
            b_along=np.where(turn, -self.b_along, self.b_along),
        )


def joined(parts: list[Sectors]) -> Sectors:
    """All triangles of several lists."""
    return Sectors(*(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Sectors)))


def integrate(sectors: Sectors, count: int) -> tuple[Floats, Floats]:
    """Sum of J over the triangles of each of ``count`` points, and the least cosine between v* and c - v*, (count,).

    Relative error 1e-15 for sums of one sign whose least cosine is above -1/4 (0 from the nearest point).
    """
    total, least = np.zeros(count), np.ones(count)
    k = sectors.take(np.flatnonzero((sectors.distance != 0) & (sectors.length > 0))).from_nearer_end()
    k, centre, m = _graded(k)
    first, last = _from_centre(k, centre)
    low = np.arcsinh(first / m)
    reach = _stretch(first / m, last / m, k.length / m)
    pieces = np.maximum(np.ceil(reach / PANEL), 1).astype(np.int64)
    graded = (k.exponent < FRACTIONAL) & (k.exponent != np.floor(k.exponent))
    for grading in (False, True):
        one_sort = graded == grading
        sector = np.repeat(np.flatnonzero(one_sort), pieces[one_sort])
        first = np.cumsum(pieces[one_sort]) - pieces[one_sort]
        number = np.arange(sector.size) - np.repeat(first, pieces[one_sort])
        step = reach[sector] / pieces[sector]
        for begin in range(0, sector.size, BLOCK):
            few = slice(begin, begin + BLOCK)
            index, width = sector[few], step[few]
            part, cosine = _panels(k.take(index), centre[index], m[index], low[index], number[few], width, grading)
            total += np.bincount(k.owner[index], part, minlength=count)
            np.minimum.at(least, k.owner[index], cosine)
    return total, least


def _lobe_width(k: Sectors) -> Floats:
    """The scale on which |v|^-s varies along an edge."""
    steep = np.hypot(k.b_distance, k.b_along)
    return 1 / (1 + np.sqrt(k.exponent / 8) + k.exponent * steep / 8)


def _graded(k: Sectors) -> tuple[Sectors, Floats, Floats]:
    """The triangles, some as two, and for each the l about which its panels grow and on what scale.

    Where an edge turns so that the lobe falls across instead of along the rays from v*, within 1/sqrt(s) of cosine 0,
    the integral over x changes from a Gaussian to an exponential one: panels grow from there too.
    """
    m = np.maximum(np.abs(k.distance), _lobe_width(k))
    nought = np.zeros_like(m)
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        turn = -k.b_distance * np.abs(k.distance) / k.b_along
        scale = np.hypot(turn, k.distance) / (np.abs(k.b_along) * np.sqrt(k.exponent))
        seen = (scale < m) & (np.abs(turn - np.clip(turn, k.start, k.stop)) < 8 * m)
    one, two = np.flatnonzero(~seen), np.flatnonzero(seen)
    if not two.size:
        return k, nought, m
    half = k.take(two)
    middle = np.clip(turn[two] / 2, half.start, half.stop)
    share = np.clip((middle - half.start) / half.length, 0, 1)
    z = half.z_start * (1 - share) + half.z_stop * share
    lower = replace(half, stop=middle, length=half.length * share, z_stop=z)
    upper = replace(half, start=middle, length=half.length * (1 - share), z_start=z)
    near_turn = turn[two] < 0  # the lower part is the one about the turn
    centre = np.concatenate((nought[one], np.where(near_turn, turn[two], 0), np.where(near_turn, 0, turn[two])))
    other = np.minimum(m[two], np.hypot(turn[two], scale[two]) / 2)
    fine = [np.where(near, scale[two], other) for near in (near_turn, ~near_turn)]
    every = joined([k.take(one), lower, upper])
    kept = np.flatnonzero(every.length > 0)
    return every.take(kept), centre[kept], np.concatenate((m[one], *fine))[kept]


def _from_centre(k: Sectors, centre: Floats) -> tuple[Floats, Floats]:
    """Both ends less ``centre``, as far apart as the edge is long: the farther one from the nearer.

    Their own difference is only as good as their distance from 0: of an edge of 1e-6 at 1 it has lost six digits.
    """
    first, last = k.start - centre, k.stop - centre
    near = np.abs(first) <= np.abs(last)
    return np.where(near, first, last - k.length), np.where(near, first + k.length, last)


@cache
def _rule(nodes: int) -> list[tuple[float, float]]:
    """Gauss-Legendre pairs (node, weight) on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(nodes)
    return list(zip(((x + 1) / 2).tolist(), (w / 2).tolist(), strict=True))


def _stretch(a: Floats, b: Floats, b_less_a: Floats) -> Floats:
    """asinh(b) - asinh(a) for b > a, without the difference where both have one sign."""
    one_sign = a * b > 0
    far = np.where(one_sign, np.abs(a) * np.hypot(1, b) + np.abs(b) * np.hypot(1, a), 1.0)
    return np.where(one_sign, np.arcsinh(b_less_a * (np.abs(a + b) / far)), np.arcsinh(b) - np.arcsinh(a))


def _panels(
    k: Sectors, centre: Floats, m: Floats, low: Floats, number: Ints, width: Floats, graded: bool
) -> tuple[Floats, Floats]:
    """One panel's share of J for each of k triangles, and its least cosine."""
    g, w = np.polynomial.legendre.leggauss(ALONG)
    du = width * (number + ((g + 1) / 2)[:, None])
    along = centre + m * np.sinh(low + du)
    step = (w / 2)[:, None] * (width * m) * np.cosh(low + du)
    rho = np.hypot(along, k.distance)
    # (l - start) / length by sinh a - sinh b = 2 cosh((a + b)/2) sinh((a - b)/2): no difference.
    share = np.minimum(2 * m / k.length * np.cosh(low + du / 2) * np.sinh(du / 2), 1.0)
    z_edge = k.z_start * (1 - share) + k.z_stop * share  # both >= 0: nothing cancels
    cosine = (k.b_distance * np.abs(k.distance) + k.b_along * along) / rho
    inner = _across(rho, np.maximum(cosine, -0.5), z_edge, k.z_star, k.exponent, graded)
    return k.distance * (step / (1 + rho) ** 2 * inner).sum(axis=0), cosine.min(axis=0)


def _across(rho: Floats, cosine: Floats, z_edge: Floats, z_star: Floats, s: Floats, graded: bool) -> Floats:
    """The integral over x, for each node along the edge."""
    whole, rest = rho / (1 + rho), 1 / (1 + rho)  # Y, 1 - Y
    lobe = bool((s > 0).any())
    last = _last(whole, cosine, s) if lobe else np.ones_like(rho)
    middle = whole * last / 2

    def term(y: Floats, left: Floats) -> Floats:
        x = y / whole
        b = 1 - 2 * y * left * (1 - cosine)
        value = x * (z_star * np.maximum(1 - x, 0) + z_edge * rest * x) / (b * b)
        if lobe:
            chi = y / left
            value *= np.exp(-s / 2 * np.log1p(chi * (2 * cosine + chi)))  # t^s, without the difference 1 - t
        return value

    rule = _rule(ACROSS_LOBE if lobe else ACROSS)
    total = sum((w * term(middle * x, 1 - middle * x) for x, w in rule), np.zeros_like(rho))
    if not graded:
        return last / 2 * sum((w * term(middle * (1 + x), 1 - middle * (1 + x)) for x, w in rule), total)
    # 1 - y = (1 - middle) zeta^6, zeta from 1 down to 1 - gap: no fractional power of y is left at y = 1.
    end = np.where(last < 1, 1 - 2 * middle, rest)
    log_end = np.where(
        middle < 0.25, np.log1p(-np.minimum(middle, 0.25) / (1 - np.minimum(middle, 0.25))), np.log(end / (1 - middle))
    )
    gap = -np.expm1(log_end / GRADE)
    upper = np.zeros_like(rho)
    for x, w in _rule(GRADED_NODES):
        log_zeta = np.log1p(-gap * (1 - x))
        shrink = np.exp(GRADE * log_zeta)
        jacobian = GRADE * gap * np.exp((GRADE - 1) * log_zeta) * ((1 - middle) / middle)
        upper += w * jacobian * term(middle - (1 - middle) * np.expm1(GRADE * log_zeta), (1 - middle) * shrink)
    return last / 2 * (total + upper)


def _last(whole: Floats, cosine: Floats, s: Floats) -> Floats:
    """Largest x at which t^s is above e^-FALL; 1 if that is beyond the edge."""
    # chi = y/(1-y) there: chi^2 + 2 cosine chi = rise, solved without a difference.
    rise = np.expm1(np.minimum(2 * FALL / np.maximum(s, 1e-30), 600.0))
    root = np.sqrt(cosine * cosine + rise)
    chi = np.where(cosine > 0, rise / (np.maximum(cosine, 0) + root), root - cosine)
    return np.minimum(1.0, chi / (1 + chi) / whole)
