"""Boundary integrals of what is left of a light, each with a bound of its error.

2 pi times a lobe's integral, without albedo, for unit radiance: sums over arcs, or positive terms at quadrature nodes
where the light is small and a sum of arcs would cancel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.renderer.closed_forms.circles.circles import CircleArcs
from nusselt.renderer.closed_forms.circles.pairing import columns
from nusselt.renderer.lobes.protocol import Contour
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


@dataclass(frozen=True, eq=False)
class Integral:
    """Value and absolute error bound, each (n,)."""

    value: Floats
    error: Floats

    def take(self, index: Ints) -> Integral:
        """At some of the points."""
        return Integral(self.value[index], self.error[index])


def over_arcs(
    points: ShadingPoints, arcs: Arcs, circles: list[tuple[CircleArcs, Floats]], contour: Contour
) -> Integral:
    """The integral (n,) over closed contours."""
    value, error = np.zeros(points.count), np.zeros(points.count)
    p = arcs.point
    share, bound = contour.arcs(points, p, arcs.start, arcs.end)
    value += np.bincount(p, share, points.count)
    error += np.bincount(p, bound, points.count)
    for part, sign in circles:
        p = part.cone.point
        share, bound = contour.circles(points, part)
        value += np.bincount(p, sign * share, points.count)
        error += np.bincount(p, bound, points.count)
    return Integral(value, error)


def small_lights(points: ShadingPoints, square: Square, contour: Contour) -> Bools:
    """Points (n,) to which, and to whose lobe, the light is small."""
    middle = square.p + 0.5 * (square.ab + square.ac)
    distance = np.sqrt(dot(middle, middle))
    reach = 0.5 * (np.sqrt(dot(square.ab, square.ab)) + np.sqrt(dot(square.ac, square.ac)))
    small = reach < SMALL * distance
    return np.asarray(small & contour.is_smooth(points, middle, distance, reach / distance))


def over_nodes(points: ShadingPoints, square: Square, parts: Trapezoids, contour: Contour) -> Integral:
    """The integral over trapezoids between straight lines, as a sum of positive terms."""
    point, total = parts.point, np.zeros(parts.point.size)
    if not point.size:
        return Integral(np.zeros(points.count), np.zeros(points.count))
    n, density = columns(points.normal, point), contour.density(points, point)
    volume = np.abs(dot(np.cross(square.ab, square.ac, axis=0), square.p))[point]
    corner = columns(square.p, point)
    for x, across in zip(NODES, WEIGHTS, strict=True):
        start = corner + (parts.u[0] + x * (parts.u[1] - parts.u[0])) * square.ab
        low, high = (v[0] + x * (v[1] - v[0]) for v in parts.v)
        for y, up in zip(NODES, WEIGHTS, strict=True):
            d = start + (low + y * (high - low)) * square.ac
            square_length = dot(d, d)
            f = np.maximum(dot(n, d), 0.0) / square_length**2
            f *= density(d, square_length)
            total += (across * up) * (high - low) * f
    total *= (parts.u[1] - parts.u[0]) * volume
    value = np.bincount(point, total, points.count).astype(np.float64)
    return Integral(value, QUADRATURE * value)


def displaced(points: ShadingPoints, bodies: Bodies, contour: Contour) -> Floats:
    """What (n,) curves may take or give that are seen by so much from where they should be, summed.

    That angle times a curve's length as it is seen, times the largest integrand.
    """
    square = bodies.square
    cosine = np.maximum.reduce([dot(points.normal, corner) for corner in square.corners]) / square.nearest
    largest = np.minimum(np.maximum(cosine, 0.0), 1.0) * contour.peak(points)
    return np.asarray(bodies.shift() * (np.pi * square.width) * largest)
