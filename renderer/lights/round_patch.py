"""What a light whose outline is a circle reflects where nothing is in the way: boundary integrals, nodes if small."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.closed_forms.circles.circles import EPS, CircleArcs
from nusselt.renderer.closed_forms.circles.cones import ALL, Rounds
from nusselt.renderer.lobes import Lobe
from nusselt.renderer.lobes.protocol import Contour
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats, Ints, dot

from .lobe_sum import contour_of, lobe_sum

Seen = Callable[[ShadingPoints], tuple[Rounds, Floats]]
"""From n points to the light's cone as each sees it, and by how much (n,) rounding moves its rim, times the rim's
length: sr."""


_x, _w = np.polynomial.legendre.leggauss(6)
NODES, WEIGHTS = (_x + 1) / 2, _w / 2
AROUND = 12
SMALL = 0.05
"""Sine of the half angle below which nodes are better than arcs, for a lobe that is smooth over the light."""
QUADRATURE = 1e-12
"""Relative error of the nodes' sum."""
MOVED = 8.0
"""Roundings of a cone's direction, and of its width, in units of eps."""


def round_patch(
    points: ShadingPoints, reached: NDArray[np.bool_], seen: Seen, glossy: bool, kind: str
) -> tuple[Floats, Floats]:
    """Light of unit radiance from all directions within a circle cone.

    Parameters
    ----------
    reached : (n,) bool
        The points that get any.
    seen : callable
    kind : str
        What an error calls the light.

    Returns
    -------
    radiance : (3, n) float64
        Reflected.
    bound : (n,) float64
        Of its relative error; what is below 1e-280 is nothing.

    Raises
    ------
    InputError
        If a lobe has no boundary integrals.
    """

    def share(lobe: type[Lobe], k: Ints) -> tuple[Floats, Floats]:
        value, bound = _integral(points.take(k), lobe, contour_of(lobe, kind), seen)
        return value / (2 * math.pi), bound / (2 * math.pi)

    return lobe_sum(points, reached, glossy, share)


def _integral(points: ShadingPoints, lobe: type[Lobe], contour: Contour, seen: Seen) -> tuple[Floats, Floats]:
    """2 pi times a lobe's integral for unit radiance, and its absolute bound, (n,)."""
    cone, shift = seen(points)
    middle, half = (part[0] for part in cone.spans(points.normal[:, None]))
    whole = half == ALL
    middle, half = np.where(whole, 0.0, middle), np.where(whole, math.pi, np.maximum(half, 0.0))
    value, bound = np.zeros(points.count), np.zeros(points.count)
    small = contour.dear & cone.right & whole & (cone.rho < SMALL)
    small &= contour.is_smooth(points, cone.e3, np.ones(points.count), cone.rho)
    for some, way in ((np.flatnonzero(small), _by_nodes), (np.flatnonzero(~small), _by_arcs)):
        if some.size:
            arcs = CircleArcs(cone.take(some), (middle - half)[some], (middle + half)[some])
            arcs = replace(arcs, cone=replace(arcs.cone, point=np.arange(some.size)))
            value[some], bound[some] = way(points.take(some), arcs, contour)
    # By how much the cone's middle is known, and its width.
    moved = MOVED * EPS * 2 * math.pi * np.minimum(cone.rho, 1.0) ** 2 * (1 + lobe.steepness(points))
    return np.maximum(value, 0.0), bound + (shift + moved) * contour.peak(points)


def _by_nodes(points: ShadingPoints, arcs: CircleArcs, contour: Contour) -> tuple[Floats, Floats]:
    """Gauss-Legendre in the height of the cap, equal steps around: a sum of positive terms, where arcs would cancel."""
    cone, total = arcs.cone, np.zeros(points.count)
    cap = cone.rho * cone.rho / (1 + cone.k3)
    density, square = contour.density(points, np.arange(points.count)), np.ones(points.count)
    for x, share in zip(NODES, WEIGHTS, strict=True):
        height = x * cap
        sine = np.sqrt(height * (2 - height))
        for angle in 2 * math.pi * np.arange(AROUND) / AROUND:
            d = sine * (math.cos(angle) * cone.e1 + math.sin(angle) * cone.e2) + (1 - height) * cone.e3
            total += share / AROUND * np.maximum(dot(points.normal, d), 0.0) * density(d, square)
    total *= 2 * math.pi * cap
    return total, QUADRATURE * total


def _by_arcs(points: ShadingPoints, arcs: CircleArcs, contour: Contour) -> tuple[Floats, Floats]:
    """The outline, and the horizon where it is cut."""
    half = (arcs.last - arcs.first) / 2
    value, bound = contour.circles(points, arcs)
    cut = np.flatnonzero((half < math.pi) & (half > 0))
    if cut.size:
        part = arcs.take(cut)
        start, end = part.cone.direction(part.last), part.cone.direction(part.first)
        share, doubt = contour.arcs(points, cut, start, end)
        value[cut] += share
        bound[cut] += doubt
    return value, bound
