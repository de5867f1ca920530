"""Boundary integrals over arcs: irradiance, and the modified Phong lobe for any real exponent.

Irradiance: 1/2 the integral of n . (u x du) over the contour, on a great circle half its angle times n . Gamma
(Lambert 1760; Arvo 1994, eq. 2). Lobe: (s + 2) I = the integral of {t+^s n + (w.n) (1 - t+^s)/(1 - t^2) w} . (u x du),
t = w . u (the double-axis moments of Arvo 1995, for a real exponent). With t+ = max(t, 0) the form has no
singularity but at -w, which lies below every receiver's horizon: no arc has to be cut at the lobe's own horizon.
"""

from __future__ import annotations

import numpy as np

from ..vectors import Floats, cross, dot, frame, unit

NODES = 32
"""Gauss-Legendre nodes along an arc."""
FALL = 38.0
"""e^-38 is below the rounding of one."""


def lambert_arcs(start: Floats, end: Floats, n: Floats) -> Floats:
    """Twice the share (k,) of irradiance of great-circle arcs (3, k), n (3, k)."""
    x = start[1] * end[2] - start[2] * end[1]
    y = start[2] * end[0] - start[0] * end[2]
    z = start[0] * end[1] - start[1] * end[0]
    sine = np.sqrt(x * x + y * y + z * z)
    turn = np.arctan2(sine, dot(start, end)) / (sine + (sine == 0))
    return np.asarray(turn * (n[0] * x + n[1] * y + n[2] * z))


def powers(z: Floats, s: Floats) -> tuple[Floats, Floats]:
    """t^s and (1 - t^s)/(1 - t^2) for t > 0, from z = 1 - t^2 without a difference."""
    log = np.log1p(-np.minimum(z, 1 - 2.0**-53)) * (s / 2)
    log = np.maximum(log, -745.0)
    return np.exp(log), np.divide(-np.expm1(log), z, out=s / 2 + 0 * z, where=z > 1e-290)


def lobe_arcs(start: Floats, end: Floats, n: Floats, w: Floats, s: Floats) -> Floats:
    """(s + 2) times the share (k,) of the lobe integral of great-circle arcs; n and w unit vectors (3, k).

    t = c cos(phi), phi from the arc's point nearest to w. Where t^s has fallen below rounding, or t < 0, only the
    azimuth about w is left, in closed form.
    """
    normal = cross(start, end)
    g = unit(normal)
    q = dot(w, g)
    nearest = w - q * g
    c = np.sqrt(dot(nearest, nearest))
    safe = np.where(g.any(axis=0), g, np.array([[0.0], [0.0], [1.0]]))
    x = np.where(c > 1e-8, unit(nearest), frame(safe)[0])
    y = cross(g, x)
    first = np.arctan2(dot(start, y), dot(start, x))
    last = first + np.arctan2(np.sqrt(dot(normal, normal)), dot(start, end))
    # The stretch on which t^s can be told from zero, relative to its largest value on the arc.
    peak = np.cos(np.clip(0.0, first, last)) * np.exp(-FALL / np.maximum(s, 1e-300))
    reach = np.arccos(np.clip(peak, 0.0, 1.0))
    low, high = np.clip(-reach, first, last), np.clip(reach, first, last)
    total = _azimuth(q, low) - _azimuth(q, first) + _azimuth(q, last) - _azimuth(q, high)
    w_n, n_g = dot(w, n), dot(n, g)
    total *= w_n
    some = np.flatnonzero(low < high)
    if some.size:
        middle, half = ((low + high) / 2)[some], ((high - low) / 2)[some]
        total[some] += _core(q[some], c[some], (w_n * q)[some], n_g[some], s[some], middle, half)
    return total


def _core(q: Floats, c: Floats, w_n_q: Floats, n_g: Floats, s: Floats, middle: Floats, half: Floats) -> Floats:
    """The lobe form by Gauss-Legendre over middle +- half, within a right angle of the point nearest to w."""
    total = np.zeros(q.shape)
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    q2, c2 = q * q, c * c
    for node, weight in zip(nodes, weights, strict=True):
        sine = np.sin(middle + half * node)
        power, ratio = powers(q2 + c2 * (sine * sine), s)
        total += weight * (w_n_q * ratio + n_g * power)
    return total * half


def _azimuth(q: Floats, phi: Floats) -> Floats:
    """Integral of q / (1 - c^2 cos^2 phi) from 0 to phi, |phi| <= 2 pi: the azimuth about w."""
    turns = np.round(phi / (2 * np.pi))
    phi = phi - 2 * np.pi * turns
    return (np.arctan2(np.sin(phi), np.abs(q) * np.cos(phi)) + 2 * np.pi * turns) * np.sign(q)
