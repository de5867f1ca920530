"""Boundary integrals of what is left of a light, each with a bound of its error.

Twice the irradiance, and s + 2 times the lobe integral, for unit radiance: sums over arcs, or positive terms at
quadrature nodes where the light is small and a sum of arcs would cancel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.renderer.closed_forms.circles.boundary_integrals import (
    lambert_arcs,
    lambert_circles,
    lobe_arcs,
    lobe_circles,
)
from nusselt.renderer.closed_forms.circles.circles import CircleArcs
from nusselt.renderer.closed_forms.circles.pairing import columns
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Bools, Floats, Ints, dot

from .rims import Arcs
from .sections import Square
from .strips import Bodies, Trapezoids

_x, _w = np.polynomial.legendre.leggauss(6)
NODES, WEIGHTS = (_x + 1) / 2, _w / 2
"""Gauss-Legendre each way over a part of a small light."""
SMALL = 0.05
"""Half diagonal over distance below which a light is small: arcs cancel to the square of that, and the integrand's
poles are twenty half sides away."""
QUADRATURE = 1e-12
"""Relative error of the nodes' sum over a part of a small light."""


@dataclass(frozen=True)
class Integral:
    """Value and absolute error bound, each (n,)."""

    value: Floats
    error: Floats

    def take(self, index: Ints) -> Integral:
        """At some of the points."""
        return Integral(self.value[index], self.error[index])


def over_arcs(points: ShadingPoints, arcs: Arcs, circles: list[tuple[CircleArcs, Floats]], lobe: bool) -> Integral:
    """The integral (n,) over closed contours."""
    value, error = np.zeros(points.count), np.zeros(points.count)
    p = arcs.point
    n = columns(points.normal, p)
    if lobe:
        share, bound = lobe_arcs(arcs.start, arcs.end, n, columns(points.mirror, p), points.shininess[p])
    else:
        share, bound = lambert_arcs(arcs.start, arcs.end, n)
    value += np.bincount(p, share, points.count)
    error += np.bincount(p, bound, points.count)
    for part, sign in circles:
        p = part.cone.point
        n, w, s = columns(points.normal, p), columns(points.mirror, p), points.shininess[p]
        share, bound = lobe_circles(part, n, w, s) if lobe else lambert_circles(part, n)
        value += np.bincount(p, sign * share, points.count)
        error += np.bincount(p, bound, points.count)
    return Integral(value, error)


def small_lights(points: ShadingPoints, square: Square) -> tuple[Bools, Bools]:
    """Points (n,) to which the light is small, and those of them to whose lobe it is."""
    middle = square.p + 0.5 * (square.ab + square.ac)
    distance = np.sqrt(dot(middle, middle))
    reach = 0.5 * (np.sqrt(dot(square.ab, square.ab)) + np.sqrt(dot(square.ac, square.ac)))
    small = reach < SMALL * distance
    slant = dot(points.mirror, middle) / distance  # t at the middle; it changes by the light's half angle
    spread = reach / distance
    steep = points.shininess * spread / np.maximum(slant - spread, 1e-300)
    return np.asarray(small), np.asarray(small & (slant > 2 * spread) & (steep < 0.5))


def over_nodes(points: ShadingPoints, square: Square, parts: Trapezoids, lobe: bool) -> Integral:
    """The integral over trapezoids between straight lines, as a sum of positive terms."""
    point, total = parts.point, np.zeros(parts.point.size)
    if not point.size:
        return Integral(np.zeros(points.count), np.zeros(points.count))
    n, w, s = columns(points.normal, point), columns(points.mirror, point), points.shininess[point]
    volume = np.abs(dot(np.cross(square.ab, square.ac, axis=0), square.p))[point]
    corner = columns(square.p, point)
    for x, across in zip(NODES, WEIGHTS, strict=True):
        start = corner + (parts.u[0] + x * (parts.u[1] - parts.u[0])) * square.ab
        low, high = (v[0] + x * (v[1] - v[0]) for v in parts.v)
        for y, up in zip(NODES, WEIGHTS, strict=True):
            d = start + (low + y * (high - low)) * square.ac
            square_length = dot(d, d)
            f = np.maximum(dot(n, d), 0.0) / square_length**2
            if lobe:
                f *= (s + 2) * np.maximum(dot(w, d) / np.sqrt(square_length), 0.0) ** s
            total += (across * up) * (high - low) * f
    total *= (parts.u[1] - parts.u[0]) * volume * (1.0 if lobe else 2.0)
    value = np.bincount(point, total, points.count).astype(np.float64)
    return Integral(value, QUADRATURE * value)


def displaced(points: ShadingPoints, bodies: Bodies, lobe: bool) -> Floats:
    """What (n,) curves may take or give that are seen by so much from where they should be, summed.

    That angle times a curve's length as it is seen, times the largest integrand.
    """
    square = bodies.square
    cosine = np.maximum.reduce([dot(points.normal, corner) for corner in square.corners]) / square.nearest
    largest = np.minimum(np.maximum(cosine, 0.0), 1.0) * ((points.shininess + 2) if lobe else 2)
    return np.asarray(bodies.shift() * (np.pi * square.width) * largest)
