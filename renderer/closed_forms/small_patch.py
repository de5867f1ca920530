"""Gauss-Legendre over the area of a parallelogram that is small against its distance, wholly above the horizon.

E = |h| integral of z / |v|^4 du dv, v = p + u e1 + v e2, h = (e1 x e2) . p, z = n . v. Every term is positive, so
nothing cancels at any solid angle; h and z carry what the inputs' rounding leaves of them. With k nodes a side the
quadrature's error is below FACTOR (|e| / REACH R)^2k of the light's area over R^2: 0.76 of it at most over 570,000
lights, needles and grazing ones among them.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np

from nusselt.renderer.vectors import Floats, cross, dot

NODES = ((0.04, 4), (0.13, 6), (0.36, 9))
"""Up to which longer side over distance of the centre how many nodes a side leave 2e-16."""
LARGEST = NODES[-1][0]
ROUNDINGS = 4.0
FACTOR, REACH = 3.0, 2.6


def size_over_distance(p: Floats, ab: Floats, ac: Floats) -> Floats:
    """Longer side over the centre's distance, (k,)."""
    centre = p + (ab + ac) / 2
    with np.errstate(divide="ignore"):
        return np.sqrt(np.maximum(dot(ab, ab), dot(ac, ac)) / dot(centre, centre))


def nodes_for(size: float, dtype: np.dtype[Any]) -> int:
    """Nodes a side for a light of that size over distance."""
    enough = next(nodes for limit, nodes in NODES if size <= limit)
    return enough if dtype == np.float64 else (enough + 2) // 2


def fewest_nodes(error: float) -> int:
    """Nodes a side for lights up to the largest size, if their area over R^2 may be missed by that much of itself."""
    wanted = math.log(FACTOR / error) / (2 * math.log(REACH / LARGEST))
    return min(max(1, math.ceil(wanted)), NODES[-1][1])


def quadrature_error(size: Floats, nodes: int) -> Floats:
    """What so many nodes a side leave, at most, of lights of these sizes over distance (k,): of their area over R^2."""
    return FACTOR * (size / REACH) ** (2 * nodes)


def small_irradiance(
    p: Floats, ab: Floats, ac: Floats, n: Floats, nodes: int, in_order: bool = True
) -> tuple[Floats, Floats]:
    """Irradiance for a unit normal and the bound of its absolute error, each (k,). Arguments (3, k).

    Without the quadrature's own error. ``in_order`` the bits do not depend on what else is asked; else it is faster.
    """
    eps = np.finfo(p.dtype).eps
    centre = p + (ab + ac) / 2
    h, zc, z1, z2 = dot(cross(ab, ac), centre), dot(n, centre), dot(n, ab), dot(n, ac)
    r, r1, r2 = dot(centre, centre), 2 * dot(centre, ab), 2 * dot(centre, ac)
    r11, r22, r12 = dot(ab, ab), dot(ac, ac), 2 * dot(ab, ac)
    x, w = (v.astype(p.dtype) for v in _rule(nodes))
    if in_order:
        total = np.zeros_like(r)
        for a, wa in zip(x, w, strict=True):
            base, slope, height = r + a * (r1 + a * r11), r2 + a * r12, zc + a * z1
            for b, wb in zip(x, w, strict=True):
                square = base + b * (slope + b * r22)
                total += (wa * wb) * ((height + b * z2) / (square * square))
    else:
        a, b = np.repeat(x, nodes), np.tile(x, nodes)
        one = np.ones_like(a)
        square = np.stack((one, a, b, a * a, a * b, b * b), axis=1) @ np.stack((r, r1, r2, r11, r12, r22))
        total = np.outer(w, w).ravel() @ (np.stack((one, a, b), axis=1) @ np.stack((zc, z1, z2)) / (square * square))
    value = np.abs(h) * total
    volume = np.sqrt(r11 * r22 * r)  # |h| at its largest
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = ROUNDINGS * eps * (4 + volume / np.abs(h) + np.sqrt(r) / zc)
    return value, np.where(relative < 1, relative, 1) * value


@cache
def _rule(nodes: int) -> tuple[Floats, Floats]:
    """Gauss-Legendre nodes and weights over [-1/2, 1/2]."""
    x, w = np.polynomial.legendre.leggauss(nodes)
    return x / 2, w / 2
