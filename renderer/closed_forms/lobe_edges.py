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

from .arc_moments import FAR, FULL, TAIL, Panels, moments
from .polygon_clip import Bools
from ..vectors import Floats, cross, dot

FALL = {np.dtype(np.float64): 36.0, np.dtype(np.float32): 16.0}
"""t^s below e^-FALL of its peak is left out: a quarter of a rounding error."""
OUTSIDE = 2.0
"""s (1 - t^2) / 2 at the peak beyond which the azimuths are dropped; up to there they cost e^5 roundings."""
LOST = -660.0
"""log(t^s) below which no value is given."""
ROUNDINGS = 2.0
"""Error of a corner's direction, in units of eps times the largest corner over its distance."""


@dataclass(frozen=True)
class Arcs:
    """Edges of one polygon a column: (3, rows, k) ends, and (rows, k) whether an edge is there."""

    a: Floats
    b: Floats
    there: Bools


@dataclass(frozen=True)
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
    """I and the bound of its absolute error, each (k,); the error is -1 where I lies below the range of numbers.

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
    total, size = _boundary(arcs, _circles(arcs, w, extent), n, w, s, side)
    return total / (s + 2), size / (s + 2)


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
        np.concatenate((there, goes.any(axis=0)[None])),
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


def _boundary(arcs: Arcs, k: _Circles, n: Floats, w: Floats, s: Floats, side: Floats) -> tuple[Floats, Floats]:
    """(s + 2) I and the bound of its error."""
    kind = k.q.dtype
    eps = np.finfo(kind).eps
    there = k.stop > k.start
    turned = np.sin(np.clip(0, k.start, k.stop))
    z = np.where(there, k.q * k.q + (k.c * turned) ** 2, 4)
    far = k.c * np.cos(np.clip(0, k.start, k.stop))
    z_peak = np.minimum(z.min(axis=0), 1)
    t_peak = np.maximum(np.where(there, far, 0).max(axis=0), 1e-30)
    log_peak = s * np.where(z_peak < 0.5, np.log1p(-np.minimum(z_peak, 0.5)) / 2, np.log(t_peak))
    outside = (there & (k.q * side < -16 * eps * k.doubt)).any(axis=0)
    tail = outside & (log_peak < -OUTSIDE)
    lost = tail & (log_peak < LOST)
    # The stretch on which t^s can be told from zero beside its peak.
    reach = np.minimum(np.exp(np.maximum((log_peak - FALL[np.dtype(kind)]) / np.maximum(s, 1e-30), -80.0)) / np.maximum(k.c, 1e-30), 1)
    reach = np.where(s > 0, np.arccos(reach), 4)
    low, high = np.clip(-reach, k.start, k.stop), np.clip(reach, k.start, k.stop)
    n_g, w_n = dot(n[:, None], k.g), dot(n, w)
    weight1 = np.abs(n_g) + eps * k.doubt
    weight2 = np.abs(w_n) * (np.abs(k.q) + eps * k.doubt)
    form = np.where(tail, np.where(z_peak < 0.5, TAIL, FAR), FULL)
    live = np.flatnonzero((there & (high > low) & ~lost).ravel())
    everywhere = np.broadcast_to
    pick = lambda v: np.broadcast_to(v, k.q.shape).ravel()[live]  # noqa: E731
    panels = Panels(
        owner=live,
        middle=np.abs(pick(low + high)) / 2,
        half=pick(high - low) / 2,
        q2=pick(k.q) ** 2,
        c=pick(k.c),
        s=pick(s),
        log_peak=pick(log_peak),
        weight1=pick(weight1),
        weight2=pick(weight2),
        form=pick(form),
    )
    j1, j2, error = (v.reshape(k.q.shape) for v in moments(panels, k.q.size))
    outer = _azimuth(k.q, k.start, low) + _azimuth(k.q, high, k.stop)
    outer = np.where(tail, 0, outer)
    total = (n_g * j1 + w_n * (k.q * j2 + outer)).sum(axis=0) * side
    steep = s * np.sqrt(z_peak) / t_peak + 9 * np.sqrt(s)
    j2 = np.abs(j2)
    rounding = (weight1 + ROUNDINGS * eps * k.doubt) * j1 * (2 + steep)
    rounding += np.abs(w_n) * ((np.abs(k.q) + k.doubt) * j2 * (2 + np.sqrt(s)) + np.abs(outer))
    rounding = (k.doubt * j1 + np.abs(n_g) * j1 * (2 + 2 * steep)).sum(axis=0)
    rounding += np.abs(w_n) * (k.doubt * j2 + np.abs(k.q) * j2 * (2 + np.where(tail, 2 * steep, np.sqrt(s))) + np.abs(outer)).sum(axis=0)
    size = ROUNDINGS * eps * rounding + error.sum(axis=0)
    scale = np.where(tail, np.exp(np.maximum(log_peak, -700)), 1)
    total, size = np.maximum(total, 0) * scale, size * scale
    return np.where(lost, 0, total), np.where(lost, -1, size)


def _azimuth(q: Floats, a: Floats, b: Floats) -> Floats:
    """Integral of q / (1 - t^2) from phi = a to b, by the tangent of a difference."""
    turn = np.arctan2(np.abs(q) * np.sin(b - a), q * q * np.cos(a) * np.cos(b) + np.sin(a) * np.sin(b))
    return np.sign(q) * turn
