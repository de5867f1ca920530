"""The Phong lobe over a parallelogram on which it varies gently, by Gauss-Legendre over the area: positive terms only.

I = |(e1 x e2) . p| integral of t^s z / |v|^4 du dv, v = p + u e1 + v e2, z = n . v, t = cos(angle from w to v), for a
light wholly above both horizons. Along each side the logarithm of t^s changes by at most 2 (A + B) with a curvature of
at most 2 B; on the ellipse of parameter r, C = (r + 1/r)/2, that leaves K nodes an error below
exp(A (C - 1) + B (C^2/2 + 1)) r^-2K (as in `arc_moments`), which tells how many nodes each side needs.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from nusselt.renderer.vectors import Bools, Floats, cross, distinct, dot

NODES = (4, 6, 8, 11, 15)
"""Numbers of nodes to choose from, a side."""
ELLIPSES = (3.0, 5.0, 8.0, 14.0, 30.0, 80.0)
AT_ONCE = 16384
"""Values at once: their arrays fit into the cache."""
ROUNDINGS = 2.0


class _Light:
    """What the light's corners say, arrays (k,): heights over both horizons, and how fast the lobe varies."""

    def __init__(self, p: Floats, ab: Floats, ac: Floats, n: Floats, w: Floats, s: Floats) -> None:
        self.s = s
        self.centre = p + (ab + ac) / 2
        self.r2 = dot(self.centre, self.centre)
        self.depth = dot(w, self.centre)
        self.deeper = (dot(w, ab) / 2, dot(w, ac) / 2)
        self.least_depth = self.depth - np.abs(self.deeper[0]) - np.abs(self.deeper[1])
        self.z, z1, z2 = dot(n, self.centre), dot(n, ab) / 2, dot(n, ac) / 2
        self.least_z = self.z - np.abs(z1) - np.abs(z2)
        self.sides = (dot(ab, ab) / 4, dot(ac, ac) / 4)
        self.along = (dot(self.centre, ab) / 2, dot(self.centre, ac) / 2)

    def nodes(self, side: int, eps: float) -> Floats:
        """Nodes that the side asks for; infinite where the form does not hold."""
        deep = np.maximum(self.least_depth, 1e-30)
        turn, wide = self.deeper[side] / deep, np.sqrt(self.sides[side] / self.r2)
        other = np.abs(self.deeper[1 - side] / deep) + np.sqrt(self.sides[1 - side] / self.r2)
        slope = self.s * np.abs(self.deeper[side] / self.depth - self.along[side] / self.r2)
        bend = self.s * (turn * turn + wide * wide)
        slope = slope + bend + self.s * (np.abs(turn) + wide) * other
        reach = np.maximum(np.abs(turn), wide)
        best = np.full(self.s.shape, np.inf)
        base = np.log(2 * slope + 1) - np.log(eps / 4)
        for r in ELLIPSES:
            c = (r + 1 / r) / 2
            room = 1 - c * reach
            logarithm = base + slope * (c - 1) + bend * (c * c / 2 + 1) - 4 * np.log(np.maximum(room, 0.4))
            best = np.minimum(best, np.where(room > 0.4, logarithm / (2 * np.log(r)), np.inf))
        return best

    def fits(self, eps: float) -> Bools:
        """Wholly above both horizons, for certain."""
        size = np.sqrt(self.r2) + np.sqrt(self.sides[0]) + np.sqrt(self.sides[1])
        return np.asarray((self.least_z > 16 * eps * size) & (self.least_depth > 0.02 * size))


def small_lobe(p: Floats, ab: Floats, ac: Floats, n: Floats, w: Floats, s: Floats) -> tuple[Floats, Floats]:
    """I and the bound of its absolute error, each (k,); the error is infinite where the lobe varies too much.

    Parameters
    ----------
    p, ab, ac, n, w : (3, k)
        One floating-point type for all; sizes near 1, n and w of unit length.
    s : (k,)
        Exponent, 0 or more.
    """
    eps = float(np.finfo(p.dtype).eps)
    light = _Light(p, ab, ac, n, w, s)
    value, error = np.zeros_like(s), np.full_like(s, np.inf)
    asked = [np.where(light.fits(eps), light.nodes(side, eps), np.inf) for side in (0, 1)]
    kinds = [np.searchsorted(np.array(NODES, dtype=float), need) for need in asked]
    pair = np.where(np.maximum(*kinds) < len(NODES), kinds[0] * len(NODES) + kinds[1], -1)
    far = light.depth * light.depth < light.r2 / 2
    for number in distinct(pair[pair >= 0]):
        nodes = (NODES[number // len(NODES)], NODES[number % len(NODES)])
        for form in (False, True):
            here = np.flatnonzero((pair == number) & (far == form))
            step = AT_ONCE // nodes[1]
            for start in range(0, here.size, step):
                few = here[start : start + step]
                value[few] = _sum([v[..., few] for v in (p, ab, ac, n, w, s)], nodes, form)
    volume = dot(cross(ab, ac), light.centre)
    value *= np.abs(volume)
    # Below that the range of numbers ends: another form must tell.
    some = (pair >= 0) & (value > 1e20 * float(np.finfo(p.dtype).tiny))
    error[some] = value[some] * (eps * ROUNDINGS * _roundings(light, volume)[some])
    return value, error


def _roundings(light: _Light, volume: Floats) -> Floats:
    """Relative error in units of eps."""
    largest = 4 * np.sqrt(light.sides[0] * light.sides[1] * light.r2)
    size = np.sqrt(light.r2)
    far = size + np.sqrt(light.sides[0]) + np.sqrt(light.sides[1])
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        tangent = np.sqrt(np.maximum((far / light.least_depth) ** 2 - 1, 0))
        return np.asarray(4 + largest / np.abs(volume) + size / light.least_z + 2 * light.s * tangent)


def _sum(vectors: list[Floats], nodes: tuple[int, int], far: bool) -> Floats:
    """Mean of t^s z / |v|^4 over the light."""
    p, ab, ac, n, w, s = vectors
    centre = p + (ab + ac) / 2
    quarter = [(x / 2, v / 2) for x, v in map(np.polynomial.legendre.leggauss, nodes)]
    (a, wa), (b, wb) = ((x.astype(p.dtype), v.astype(p.dtype)) for x, v in quarter)
    b, wb = b[:, None], wb[:, None]
    r11, r22, r12 = dot(ab, ab), dot(ac, ac), 2 * dot(ab, ac)
    r, r1, r2 = dot(centre, centre), 2 * dot(centre, ab), 2 * dot(centre, ac)
    x0, x1, x2 = (cross(w, v) for v in (centre, ab, ac))
    z, z1, z2, t, t1, t2 = (dot(h, v) for h in (n, w) for v in (centre, ab, ac))
    half = s / 2
    total: Any = 0.0
    across = [b * x for x in x2]
    for node, weight in zip(a, wa, strict=True):
        square = b * r22
        square += r2 + node * r12
        square *= b
        square += r + node * (r1 + node * r11)
        if far:
            log = b * t2
            log += t + node * t1
            log *= log
            log /= square
            np.log(log, out=log)
        else:
            log = np.zeros_like(square)
            for x, y, step in zip(x0, x1, across, strict=True):
                part = step + (x + node * y)
                part *= part
                log += part
            log /= square
            np.negative(log, out=log)
            np.log1p(log, out=log)
        log *= half
        np.exp(log, out=log)
        height = b * z2
        height += z + node * z1
        log *= height
        square *= square
        log /= square
        log *= weight * wb
        total = total + log.sum(axis=0)
    return np.asarray(total)
