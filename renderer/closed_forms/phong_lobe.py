"""The modified Phong lobe over a parallelogram, for any real exponent, at a cost that does not grow with it.

I(s) = integral of max(w.u, 0)^s max(n.u, 0) du over the directions u of the polygon, w the mirror direction. From the
divergence on the sphere of h(t) grad t, t = w.u and (1 - t^2) h = the integral of t^s from t to 1 (the double-axis
moments of Arvo 1995, for a real exponent), over the polygon clipped to n.u >= 0 and w.u >= 0:

    (s + 2) I = sum over edges of (w.n) q J2 + (n.G) J1,
    J1 = integral of t^s dphi,   J2 = integral of (1 - t^s) / (1 - t^2) dphi,   t = c cos(phi),

G the unit normal of the edge's plane, q = w.G, c^2 = 1 - q^2, phi along the edge from its circle's point nearest w.
Where t^s has fallen below rounding only the "1" of J2 is left, whose integral is an azimuth about w. Where the whole
polygon lies outside the lobe those azimuths cancel and are dropped. A light so small that the edges cancel is
integrated over its area instead.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..vectors import Floats, cross, dot, frame, unit

NODES = 32
"""Gauss-Legendre nodes along an edge."""
FALL = 38.0
"""e^-38 is below the rounding of one."""
AREA_NODES = 8
TAIL = 18.0
"""Lobe widths (s (1 - t^2) / 2) outside which the azimuths are dropped."""
EPS = 2.0**-52

Arc = tuple[Floats, Floats, Floats]
"""Start and end (3, n), and 1 or 0 (n,): whether the arc is there."""


def _column(v: ArrayLike) -> Floats:
    array = np.asarray(v, dtype=np.float64)
    return array.reshape(3, 1) if array.ndim == 1 else array


def _clip(arcs: list[Arc], plane: Floats) -> list[Arc]:
    """The arcs' parts where plane.v >= 0, and the arc along the plane that closes them (of a convex polygon)."""
    out: list[Arc] = []
    shape = np.broadcast_shapes(arcs[0][0].shape, plane.shape)
    leaving, entering, cut = np.zeros(shape), np.zeros(shape), np.zeros(shape[1])
    for a, b, there in arcs:
        za, zb = dot(plane, a), dot(plane, b)
        # >= as written: an edge that lies in the plane is kept.
        goes, comes = (za >= 0) & (zb < 0), (za < 0) & (zb >= 0)
        t = np.divide(za, za - zb, out=np.zeros_like(za), where=goes | comes)
        crossing = a + (b - a) * t
        out.append((np.where(comes, crossing, a), np.where(goes, crossing, b), there * ((za >= 0) | (zb >= 0))))
        here = there > 0
        leaving = np.where(goes & here, crossing, leaving)
        entering = np.where(comes & here, crossing, entering)
        cut = np.where(goes & here, 1.0, cut)
    return [*out, (leaving, entering, cut)]


def _azimuth(q: Floats, phi: Floats) -> Floats:
    """Integral of q / (1 - c^2 cos^2 phi) from 0 to phi: the azimuth about w, for |phi| <= pi/2."""
    return np.arctan2(np.sin(phi), np.abs(q) * np.cos(phi)) * np.sign(q)


def _edge(arc: Arc, n: Floats, w: Floats, s: Floats, tail: Floats) -> tuple[Floats, Floats]:
    """(s + 2) times one edge's share of I, and the size of the terms in it."""
    a, b, there = arc
    normal = cross(a, b)
    g = unit(normal)
    q = dot(w, g)
    nearest = w - q * g
    c = np.sqrt(dot(nearest, nearest))
    x = np.where(c > 1e-8, unit(nearest), frame(np.where(g.any(axis=0), g, np.array([[0.0], [0.0], [1.0]])))[0])
    y = cross(g, x)
    start = np.arctan2(dot(a, y), dot(a, x))
    stop = start + np.arctan2(np.sqrt(dot(normal, normal)), dot(a, b))
    # The stretch on which t^s can be told from zero, relative to its largest value on the arc.
    inside = np.clip(0.0, start, stop)
    peak = np.cos(inside) * np.exp(-FALL / np.maximum(s, 1e-300))
    reach = np.arccos(np.clip(peak, 0.0, 1.0))
    low, high = np.clip(-reach, start, stop), np.clip(reach, start, stop)
    middle, half = (low + high) / 2, (high - low) / 2
    n_g, w_n = dot(n, g), dot(w, n)
    total, size = np.zeros(q.shape), np.zeros(q.shape)
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    for node, weight in zip(nodes, weights, strict=True):
        sine = np.sin(middle + half * node)
        z = np.minimum(q * q + c * c * sine * sine, 1.0)  # 1 - t^2, without a difference
        log = np.log1p(-np.minimum(z, 1 - 2.0**-53)) * (s / 2)
        power = np.exp(np.maximum(log, -745.0)) * (z < 1) + (s == 0) * (z >= 1)
        ratio = np.divide(-np.expm1(np.maximum(log, -745.0)), z, out=s / 2 + 0 * z, where=z > 0)
        ratio = np.where(tail, -np.divide(power, z, out=np.zeros_like(z), where=z > 0), ratio)
        one, other = w_n * q * ratio, n_g * power
        total += weight * half * (one + other)
        size += weight * half * (np.abs(one) + np.abs(other))
    outside = (_azimuth(q, low) - _azimuth(q, start)) + (_azimuth(q, stop) - _azimuth(q, high))
    outside = np.where(tail, 0.0, outside * w_n)
    return (total + outside) * there, (size + np.abs(outside)) * there


def _over_area(p: Floats, ab: Floats, ac: Floats, n: Floats, w: Floats, s: Floats) -> Floats:
    """I by Gauss-Legendre over the light's area: all terms positive, for small lights wholly above both horizons."""
    nodes, weights = np.polynomial.legendre.leggauss(AREA_NODES)
    twice = np.abs(dot(cross(ab, ac), p)) / 4
    total = np.zeros(p.shape[1])
    for u, wu in zip(nodes, weights, strict=True):
        for v, wv in zip(nodes, weights, strict=True):
            d = p + ab * ((1 + u) / 2) + ac * ((1 + v) / 2)
            length2 = dot(d, d)
            across = cross(w, d)
            z = np.minimum(dot(across, across) / length2, 1 - 2.0**-53)  # sin^2 of the angle to w
            power = np.exp(np.maximum(np.log1p(-z) * (s / 2), -745.0))
            total += wu * wv * power * np.maximum(dot(n, d), 0) / length2**2 * (dot(w, d) > 0)
    return total * twice


def phong_lobe(
    points: Floats, normals: Floats, mirror: Floats, exponent: ArrayLike, corner: Any, ab: Any, ac: Any
) -> tuple[Floats, Floats]:
    """Integral of max(w.u, 0)^s max(n.u, 0) over the directions of a parallelogram, both of whose sides count.

    Parameters
    ----------
    points, normals, mirror : (3, n) float64
        Shading points; normals and mirror directions of any length.
    exponent : float or (n,) float64
        s, at least 0. At 0 the lobe is 1 where w.u > 0.
    corner, ab, ac : (3,) or (3, n) float64
        The parallelogram corner + u ab + v ac.

    Returns
    -------
    value, bound : (n,) float64
        The integral and a bound of its relative error from the rounding of its terms.
    """
    n, w = unit(normals), unit(mirror)
    s = np.broadcast_to(np.asarray(exponent, dtype=np.float64), points.shape[1:])
    p, ab, ac = _column(corner) - points, _column(ab), _column(ac)
    size = np.maximum(np.abs(p).max(axis=0), np.maximum(np.abs(ab).max(axis=0), np.abs(ac).max(axis=0)))
    size = np.where(size > 0, size, 1.0)
    p, ab, ac = p / size, ab / size, ac / size
    v = [p, p + ab, p + ab + ac, p + ac]
    total, terms = _over_edges(v, n, w, s, np.sign(dot(cross(ab, ac), p)))
    small = _is_small(v, n, w, s)
    value = np.maximum(total, 0.0)
    value[small] = _over_area(p[:, small], ab[:, small], ac[:, small], n[:, small], w[:, small], s[small]) * 1.0
    rounding = np.where(small, 64 * EPS * value, 64 * EPS * terms)
    return value, np.divide(rounding, value, out=np.zeros_like(value), where=value > 0)


def _is_small(v: list[Floats], n: Floats, w: Floats, s: Floats) -> Any:
    """Lights over which the lobe changes so little that eight nodes a side are exact, above both horizons."""
    length = [np.sqrt(dot(x, x)) for x in v]
    nearest = np.minimum.reduce(length)
    across = np.maximum(np.sqrt(dot(v[2] - v[0], v[2] - v[0])), np.sqrt(dot(v[3] - v[1], v[3] - v[1])))
    extent = across / np.maximum(nearest, 1e-300)
    centre = unit(v[0] + v[2])
    slope = np.sqrt(np.maximum(1 - dot(w, centre) ** 2, 0.0)) / np.maximum(np.abs(dot(w, centre)), 1e-3)
    gentle = (extent < 0.1) & (s * extent * slope < 1) & (s * extent**2 < 1)
    above = np.all([(dot(n, x) > 0) & (dot(w, x) > 0) for x in v], axis=0)
    return gentle & above


def _over_edges(v: list[Floats], n: Floats, w: Floats, s: Floats, side: Floats) -> tuple[Floats, Floats]:
    """I by its boundary, and the size of the terms over (s + 2)."""
    there = np.ones(v[0].shape[1])
    arcs = _clip(_clip([(v[k], v[(k + 1) % 4], there) for k in range(4)], n), w)
    tail = _outside_lobe(v, w, s)
    total, size = np.zeros(there.shape), np.zeros(there.shape)
    for arc in arcs:
        one, terms = _edge(arc, n, w, s, tail)
        total, size = total + one, size + terms
    return total * side / (s + 2), size / (s + 2)


def _outside_lobe(v: list[Floats], w: Floats, s: Floats) -> Any:
    """Whether w lies outside the polygon by so many lobe widths on every edge that its azimuths cancel exactly."""
    turns = [dot(w, cross(v[k], v[(k + 1) % 4])) for k in range(4)]
    inside = np.all([t >= 0 for t in turns], axis=0) | np.all([t <= 0 for t in turns], axis=0)
    closest = np.zeros(s.shape)
    for k in range(4):
        a, b = unit(v[k]), unit(v[(k + 1) % 4])
        step = b - a
        t = np.clip(dot(w - a, step) / np.maximum(dot(step, step), 1e-300), 0, 1)
        closest = np.maximum(closest, dot(w, unit(a + step * t)))
    width = s * (1 - np.minimum(closest, 1.0) ** 2) / 2
    return ~inside & (width > TAIL)
