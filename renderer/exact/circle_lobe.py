"""The lobe's boundary integral over arcs of circle cones."""

from __future__ import annotations

import numpy as np

from ..vectors import Floats, cross, dot
from .circles import CircleArcs
from .rounds import wrapped

NODES = 32
FALL = 38.0
PANELS = 8


def powers(z: Floats, s: Floats) -> tuple[Floats, Floats]:
    """t^s and (1 - t^s)/(1 - t^2) for t > 0, from z = 1 - t^2 without a difference."""
    log = np.log1p(-np.minimum(z, 1 - 2.0**-53)) * (s / 2)
    log = np.maximum(log, -745.0)
    return np.exp(log), np.divide(-np.expm1(log), z, out=s / 2 + 0 * z, where=z > 1e-290)


def lobe_circles(arcs: CircleArcs, n: Floats, w: Floats, s: Floats) -> tuple[Floats, Floats]:
    share = _old(arcs, n, w, s)
    return share, np.full(share.shape, 1e-3)


def _old(arcs: CircleArcs, n: Floats, w: Floats, s: Floats) -> Floats:
    """The same of arcs of circle cones.

    Spheres: psi from the circle's point nearest to w, g the angle from w to the centre. 1 - t^2 = X^2 + Y^2 with
    X = sin(g - a) + 2 sin(a) cos(g) sin^2(psi/2) and Y = sin(a) sin(psi), no differences; the azimuth about w is
    atan2(Y, X), from the opposite side where w lies inside the circle.
    """
    if not arcs.cone.right:
        return _lobe_general(arcs, n, w, s)
    cone = arcs.cone
    sin_a, cos_a, cos_g = cone.rho, cone.k3, dot(w, cone.e3)
    w1, w2 = dot(w, cone.e1), dot(w, cone.e2)
    sin_g = np.sqrt(w1 * w1 + w2 * w2)
    toward = np.arctan2(w2, w1)
    out, w_n = np.zeros(s.shape), dot(w, n)
    # An arc that passes psi = pi goes on from -pi.
    middle = wrapped((arcs.first + arcs.last) / 2 - toward)
    half = (arcs.last - arcs.first) / 2
    lows = middle - half, np.maximum(middle - half - 2 * np.pi, -np.pi), np.maximum(middle - half + 2 * np.pi, -np.pi)
    highs = middle + half, np.minimum(middle + half - 2 * np.pi, np.pi), np.minimum(middle + half + 2 * np.pi, np.pi)
    safe = np.where(sin_g > 0, sin_g, 1.0)
    c1, c2 = np.where(sin_g > 0, w1, 1.0) / safe, w2 / safe
    n1, n2, n3 = dot(n, cone.e1), dot(n, cone.e2), dot(n, cone.e3)
    across = n1 * c1 + n2 * c2, n2 * c1 - n1 * c2, n3
    for low, high in zip(lows, highs, strict=True):
        first, last = np.maximum(low, -np.pi), np.minimum(high, np.pi)
        k = np.flatnonzero(first < last)
        if k.size:
            some = [v[k] for v in (sin_a, cos_a, sin_g, cos_g, first, last, s, *across, w_n)]
            out[k] += _small_circle(*some)
    return out


def _small_circle(
    sin_a: Floats,
    cos_a: Floats,
    sin_g: Floats,
    cos_g: Floats,
    first: Floats,
    last: Floats,
    s: Floats,
    m1: Floats,
    m2: Floats,
    m3: Floats,
    w_n: Floats,
) -> Floats:
    """Arcs first <= psi <= last within [-pi, pi]; m the normal in the circle's frame."""
    base = sin_g * cos_a - cos_g * sin_a
    mean, swing = cos_a * cos_g, sin_a * sin_g  # t = mean + swing cos(psi)
    top = mean + swing * np.cos(np.clip(0.0, first, last))
    floor = np.maximum(top, 0.0) * np.exp(-FALL / np.maximum(s, 1e-300)) - mean
    reach = np.where(swing > 0, np.arccos(np.clip(floor / np.where(swing > 0, swing, 1), -1, 1)), np.pi)
    reach = np.where(top > 0, reach, 0.0)
    low, high = np.clip(-reach, first, last), np.clip(reach, first, last)
    side = np.where(base < 0, -1.0, 1.0)

    def azimuth(psi: Floats) -> Floats:
        x = base + 2 * sin_a * cos_g * np.sin(psi / 2) ** 2
        return np.arctan2(-side * sin_a * np.sin(psi), side * x)

    total = w_n * (azimuth(last) - azimuth(high) + azimuth(low) - azimuth(first))
    middle, half = (low + high) / 2, (high - low) / 2
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    core = np.zeros(s.shape)
    for node, weight in zip(nodes, weights, strict=True):
        psi = middle + half * node
        cosine, sine = np.cos(psi), np.sin(psi)
        x = base + 2 * sin_a * cos_g * np.sin(psi / 2) ** 2
        power, ratio = powers(np.minimum(x * x + (sin_a * sine) ** 2, 1.0), s)
        turn = sin_a * cos_g - cos_a * sin_g * cosine
        core += weight * (power * (sin_a * m3 - cos_a * (m1 * cosine + m2 * sine)) + w_n * ratio * turn)
    return np.asarray(total + sin_a * core * half)


def _lobe_general(arcs: CircleArcs, n: Floats, w: Floats, s: Floats) -> Floats:
    """Composite Gauss-Legendre over the whole arc."""
    cone, total = arcs.cone, np.zeros(s.shape)
    w_n, half = dot(w, n), (arcs.last - arcs.first) / 2 / PANELS
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    for panel in range(PANELS):
        for node, weight in zip(nodes, weights, strict=True):
            phi = arcs.first + (2 * panel + 1 + node) * half
            v = cone.direction(phi)
            step = cone.rho * (np.cos(phi) * cone.e2 - np.sin(phi) * cone.e1)
            length2, turn = dot(v, v), cross(v, step)
            away = cross(w, v)
            power, ratio = powers(np.minimum(dot(away, away) / length2, 1.0), s)
            front = dot(w, v) > 0
            ratio = np.where(front, ratio, length2 / np.maximum(dot(away, away), 1e-300))
            total += weight * half * (power * front * dot(n, turn) + w_n * ratio * dot(w, turn)) / length2
    return total
