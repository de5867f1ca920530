"""The Phong lobe over a parallelogram by its boundary, in working precision, with its own error bound.

I(s) = integral of max(w.u, 0)^s max(n.u, 0) du over the directions u of the polygon, w the mirror direction. From the
divergence on the sphere of h(t) grad t, t = w.u and (1 - t^2) h = the integral of t^s from t to 1 (the double-axis
moments of Arvo 1995, for a real exponent), over the polygon clipped to n.u >= 0 and w.u >= 0:

    (s + 2) I = sum over edges of (w.n) q J2 + (n.G) J1,

G the unit normal of the edge's plane, q = w.G, J1 and J2 of `arc_moments`. Where t^s has fallen below rounding only
the 1 of J2 is left, whose integral is an azimuth about w. The azimuths of all edges add up to 2 pi if w lies inside
the polygon and to 0 if not: there they are dropped, and values down to 1e-290 keep their digits.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from nusselt.renderer.vectors import Bools, Floats, cross, dot

from .arc_lobe import lobe_arcs
from .arc_moments import FAR, FULL, TAIL, Panels, moments

FALL = {np.dtype(np.float64): 36.0, np.dtype(np.float32): 16.0}
"""t^s below e^-FALL of its peak is left out: a quarter of a rounding error."""
OUTSIDE = 2.0
"""-log(t^s) at the peak beyond which the azimuths are dropped; up to there they cost e^2 roundings."""
LOST = {np.dtype(np.float64): -660.0, np.dtype(np.float32): -60.0}
"""log(t^s) below which no value is given."""
LOST_ERROR = {np.dtype(np.float64): -1.0, np.dtype(np.float32): np.inf}
"""What is given for its error: float64 may know more than float32, nothing more than float64."""
ROUNDINGS = 2.0
"""Error of a direction in units of eps, corners by the largest one over their distance; 0.9 measured."""


@dataclass(frozen=True, eq=False)
class Arcs:
    """Edges of one polygon a column: (3, rows, k) ends, and (rows, k) whether an edge is there."""

    a: Floats
    b: Floats
    there: Bools


@dataclass(frozen=True, eq=False)
class _Circles:
    """An edge's great circle about w, each array (rows, k): G, q, c, phi of its ends, and the rounding of G."""

    g: Floats
    q: Floats
    c: Floats
    start: Floats
    stop: Floats
    doubt: Floats


def lobe_by_edges(
    p: Floats, ab: Floats, ac: Floats, n: Floats, w: Floats, s: Floats, clip: bool
) -> tuple[Floats, Floats]:
    """I and the bound of its absolute error, each (k,); the error is -1 where t^s lies below 1e-286 everywhere.

    Bounds above 1e-9 of the value, of slivers left by a horizon, have been seen ten times too small: none stands.

    Parameters
    ----------
    p, ab, ac, n, w : (3, k)
        One floating-point type for all; sizes near 1, n and w of unit length.
    s : (k,)
        Exponent, 0 or more.
    clip : bool
        Whether a horizon may cut the light.
    """
    v = np.stack((p, p + ab, p + ab + ac, p + ac), axis=1)
    sizes = np.sqrt(dot(v, v))
    extent = sizes.max(axis=0)
    arcs = Arcs(v, np.roll(v, -1, axis=1), np.ones(v.shape[1:], dtype=bool))
    if clip:
        arcs = _clip(_clip(arcs, n), w)
    side = np.sign(dot(cross(ab, ac), p))
    total, size = _boundary(_circles(arcs, w, extent), n, w, s, side)
    return total / (s + 2), size / (s + 2)


def lobe_by_arcs(p: Floats, ab: Floats, ac: Floats, n: Floats, w: Floats, s: Floats) -> tuple[Floats, Floats]:
    """I and the bound of its absolute error, each (k,), arc by arc with each arc's own bound (see `arc_lobe`).

    For wide lights about whose bound the sums above know nothing; arguments as for `lobe_by_edges`, in float64.
    """
    v = np.stack((p, p + ab, p + ab + ac, p + ac), axis=1)
    arcs = _clip(Arcs(v, np.roll(v, -1, axis=1), np.ones(v.shape[1:], dtype=bool)), n)
    edge, k = np.nonzero(arcs.there)
    start, end = arcs.a[:, edge, k], arcs.b[:, edge, k]
    share, bound = lobe_arcs(start, end, n[:, k], w[:, k], s[k])
    extent = np.sqrt(dot(v, v).max(axis=0))[k]
    nearest = np.sqrt(np.minimum(dot(start, start), dot(end, end)))
    moved = 8 * np.finfo(np.float64).eps * extent / np.maximum(nearest, 1e-300)  # the ends', as directions
    bound = bound + moved * (s[k] / 2 + 2)
    side = np.sign(dot(cross(ab, ac), p))
    total = side * np.bincount(k, share, s.size) / (s + 2)
    return np.maximum(total, 0.0), np.bincount(k, bound, s.size) / (s + 2)


def _clip(arcs: Arcs, plane: Floats) -> Arcs:
    """The arcs' parts where plane.v >= 0, and the arc along the plane that closes them (of a convex polygon)."""
    za, zb = dot(plane[:, None], arcs.a), dot(plane[:, None], arcs.b)
    # >= as written: an edge that lies in the plane is kept.
    goes, comes = arcs.there & (za >= 0) & (zb < 0), arcs.there & (za < 0) & (zb >= 0)
    share = np.divide(za, za - zb, out=np.zeros_like(za), where=goes | comes)
    crossing = arcs.a + (arcs.b - arcs.a) * share
    leaving, entering = (crossing * goes).sum(axis=1), (crossing * comes).sum(axis=1)
    a, b = np.where(comes, crossing, arcs.a), np.where(goes, crossing, arcs.b)
    there = arcs.there & ((za >= 0) | (zb >= 0))
    return Arcs(
        np.concatenate((a, leaving[:, None]), axis=1),
        np.concatenate((b, entering[:, None]), axis=1),
        np.concatenate((there, np.any(goes, axis=0, keepdims=True))),
    )


def _circles(arcs: Arcs, w: Floats, extent: Floats) -> _Circles:
    a, b, w = arcs.a, arcs.b, w[:, None]
    normal = cross(a, b)
    sine = np.sqrt(dot(normal, normal))
    there = arcs.there & (sine > 0)
    g = normal / np.where(there, sine, 1)
    q = np.where(there, dot(w, g), 0)
    nearest = w - q * g
    c = np.sqrt(dot(nearest, nearest))
    # On the lobe's own horizon no point is nearest: phi is measured from the arc's middle.
    nearest = np.where(c > 1e-6, nearest, a + b)
    across = cross(g, nearest)
    start = np.arctan2(dot(a, across), dot(a, nearest))
    turn = np.where(there, np.arctan2(sine, dot(a, b)), 0)
    ra, rb = np.sqrt(dot(a, a)), np.sqrt(dot(b, b))
    doubt = (ra * rb + extent * (ra + rb)) / np.where(there, sine, 1)
    return _Circles(g, q, c, start, start + turn, doubt * there)


@dataclass(frozen=True, eq=False)
class _Peak:
    """The polygon's point nearest to w, (k,): log(t^s) there, how fast t^s falls, and which form that asks for."""

    log: Floats
    steep: Floats
    form: Any
    tail: Bools
    lost: Bools

    @classmethod
    def of(cls, k: _Circles, s: Floats, side: Floats) -> _Peak:
        eps = np.finfo(k.q.dtype).eps
        there = k.stop > k.start
        closest = np.clip(0, k.start, k.stop)
        z = np.where(there, k.q * k.q + (k.c * np.sin(closest)) ** 2, 1).min(axis=0)
        t = np.maximum(np.where(there, k.c * np.cos(closest), 0).max(axis=0), 1e-30)
        near = z < 0.5  # there 1 - t^2 has the digits, elsewhere t
        log = s * np.where(near, np.log1p(-np.minimum(z, 0.5)) / 2, np.log(t))
        outside = (there & (k.q * side < -16 * eps * k.doubt)).any(axis=0)
        tail = outside & (log < -OUTSIDE)
        form = np.where(tail, np.where(near, TAIL, FAR), FULL)
        return cls(log, s * np.sqrt(z) / t + 9 * np.sqrt(s), form, tail, tail & (log < LOST[k.q.dtype]))


def _boundary(k: _Circles, n: Floats, w: Floats, s: Floats, side: Floats) -> tuple[Floats, Floats]:
    """(s + 2) I and the bound of its error."""
    eps = np.finfo(k.q.dtype).eps
    peak = _Peak.of(k, s, side)
    low, high = _core(k, s, peak)
    n_g, w_n = dot(n[:, None], k.g), dot(n, w)
    weights = np.abs(n_g) + eps * k.doubt, np.abs(w_n) * (np.abs(k.q) + eps * k.doubt)
    panels = _panels(k, low, high, s, peak, weights)
    j1, j2, quadrature = (v.reshape(k.q.shape) for v in moments(panels, k.q.size))
    azimuth = np.where(peak.tail, 0, _azimuth(k.q, k.start, low) + _azimuth(k.q, high, k.stop))
    total = (n_g * j1 + w_n * (k.q * j2 + azimuth)).sum(axis=0) * side
    # An edge's plane is known to eps doubt; where it lies, t^s to steep eps, and 1 - t^s over its scale to sqrt(s) eps.
    j2, moved = np.abs(j2), 2 + np.where(peak.tail, 2 * peak.steep, np.sqrt(s))
    rounding = k.doubt * j1 + np.abs(n_g) * j1 * (2 + 2 * peak.steep)
    rounding += np.abs(w_n) * (k.doubt * j2 + np.abs(k.q) * j2 * moved + np.abs(azimuth))
    size = (ROUNDINGS * eps * rounding + quadrature).sum(axis=0)
    scale = np.where(peak.tail, np.exp(np.maximum(peak.log, -700)), 1)
    return np.where(peak.lost, 0, np.maximum(total, 0) * scale), np.where(
        peak.lost, LOST_ERROR[k.q.dtype], size * scale
    )


def _core(k: _Circles, s: Floats, peak: _Peak) -> tuple[Floats, Floats]:
    """The stretch of each edge on which t^s can be told from zero beside its peak."""
    fall = (peak.log - FALL[k.q.dtype]) / np.maximum(s, 1e-30)
    cosine = np.minimum(np.exp(np.maximum(fall, -80.0)) / np.maximum(k.c, 1e-30), 1)
    reach = np.where(s > 0, np.arccos(cosine), 4)
    return np.clip(-reach, k.start, k.stop), np.clip(reach, k.start, k.stop)


def _panels(k: _Circles, low: Floats, high: Floats, s: Floats, peak: _Peak, weights: tuple[Floats, Floats]) -> Panels:
    """The cores that are there, one panel each."""
    live = np.flatnonzero((high > low) & ~peak.lost)

    def of(v: Any) -> Any:
        return np.broadcast_to(v, k.q.shape).ravel()[live]

    return Panels(
        owner=live,
        middle=np.abs(of(low + high)) / 2,
        half=of(high - low) / 2,
        q2=of(k.q) ** 2,
        c=of(k.c),
        s=of(s),
        log_peak=of(peak.log),
        weight1=of(weights[0]),
        weight2=of(weights[1]),
        form=of(peak.form),
    )


def _azimuth(q: Floats, a: Floats, b: Floats) -> Floats:
    """Integral of q / (1 - t^2) from phi = a to b, by the tangent of a difference."""
    turn = np.arctan2(np.abs(q) * np.sin(b - a), q * q * np.cos(a) * np.cos(b) + np.sin(a) * np.sin(b))
    return np.sign(q) * turn
