"""What a flat convex polygon reflects where nothing is in the way, for lobes with boundary integrals.

Great-circle arcs along its edges, cut at the horizon, and along the horizon; or, where they would cancel because it is
small and the lobe smooth over it, positive terms at nodes.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.closed_forms.arc_lobe import EPS
from nusselt.renderer.lobes import Lobe
from nusselt.renderer.lobes.protocol import Contour
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats, Ints, cross, dot

from .lobe_sum import contour_of, lobe_sum

_x, _w = np.polynomial.legendre.leggauss(6)
NODES, WEIGHTS = (_x + 1) / 2, _w / 2
"""Gauss-Legendre each way over a triangle's square."""
SMALL = 0.05
"""Radius over distance below which nodes are better than arcs."""
QUADRATURE = 1e-12
"""Relative error of the nodes' sum."""
MOVED = 8.0
"""Roundings of a corner's direction, in units of eps."""


def polygon_patch(
    points: ShadingPoints, facing: NDArray[np.bool_], corners: Floats, glossy: bool, kind: str
) -> tuple[Floats, Floats]:
    """Light of a polygon of unit radiance.

    Parameters
    ----------
    facing : (n,) bool
        The points that it shines on.
    corners : (3, m) float64
        Counter-clockwise seen from the side that shines.
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
    heights = dot(points.normal[:, None], corners[:, :, None] - points.position[:, None])
    reached = facing & (heights.max(axis=0) > 0)

    def share(lobe: type[Lobe], k: Ints) -> tuple[Floats, Floats]:
        value, bound = _integral(points.take(k), corners, contour_of(lobe, kind))
        return value / (2 * math.pi), bound / (2 * math.pi)

    return lobe_sum(points, reached, glossy, share)


def _integral(points: ShadingPoints, corners: Floats, contour: Contour) -> tuple[Floats, Floats]:
    """2 pi times a lobe's integral, and its absolute bound, (n,)."""
    rays = corners[:, :, None] - points.position[:, None]
    middle = rays.mean(axis=1)
    distance = np.sqrt(dot(middle, middle))
    away = rays - middle[:, None]
    reach = np.sqrt(dot(away, away).max(axis=0))
    small = (reach < SMALL * distance) & (dot(points.normal[:, None], rays).min(axis=0) > 0)
    small &= contour.is_smooth(points, middle, distance, reach / np.maximum(distance, 1e-300))
    value, bound = np.zeros(points.count), np.zeros(points.count)
    for some, way in ((np.flatnonzero(small), _by_nodes), (np.flatnonzero(~small), _by_arcs)):
        if some.size:
            value[some], bound[some] = way(points.take(some), rays[:, :, some], corners, contour)
    return np.maximum(value, 0.0), bound


def _by_nodes(points: ShadingPoints, rays: Floats, corners: Floats, contour: Contour) -> tuple[Floats, Floats]:
    """Over the triangles of the fan from the first corner: corner + x (1 - y) e + x y f."""
    total, density = np.zeros(points.count), contour.density(points, np.arange(points.count))
    p, edges = rays[:, 0], corners - corners[:, :1]  # of the corners: their rays' differences have lost digits
    for k in range(1, corners.shape[1] - 1):
        e, f = edges[:, [k]], edges[:, [k + 1]]
        volume = np.abs(dot(cross(e, f), p))
        for x, across in zip(NODES, WEIGHTS, strict=True):
            for y, up in zip(NODES, WEIGHTS, strict=True):
                d = p + x * ((1 - y) * e + y * f)
                square = dot(d, d)
                total += (x * across * up) * volume * dot(points.normal, d) / square**2 * density(d, square)
    return total, QUADRATURE * total


def _by_arcs(points: ShadingPoints, rays: Floats, corners: Floats, contour: Contour) -> tuple[Floats, Floats]:
    """Along the edges, clockwise as points see them, and from where one sinks below the horizon to where one rises."""
    value, bound = np.zeros(points.count), np.zeros(points.count)
    length = np.sqrt(dot(rays, rays))
    rays = rays / np.where(length > 0, length, 1.0)
    height = dot(points.normal[:, None], rays)
    height = np.where(np.abs(height) <= 2 * EPS, 0.0, height)
    sinks, rises = np.zeros_like(points.normal), np.zeros_like(points.normal)
    around = np.zeros(points.count)

    def add(k: Ints, start: Floats, end: Floats) -> None:
        share, doubt = contour.arcs(points, k, start, end)
        normal = cross(start, end)
        value[k] += share
        bound[k] += doubt
        around[k] += np.arctan2(np.sqrt(dot(normal, normal)), dot(start, end))

    m = rays.shape[1]
    for k in range(m):
        start, end = rays[:, (k + 1) % m], rays[:, k]
        low, high = height[(k + 1) % m], height[k]
        up, down = (low < 0) & (high > 0), (low > 0) & (high < 0)
        cut = start * np.abs(high) + end * np.abs(low)
        rises, sinks = np.where(up, cut, rises), np.where(down, cut, sinks)
        touch_up, touch_down = (low == 0) & (high > 0), (low > 0) & (high == 0)
        rises, sinks = np.where(touch_up, start, rises), np.where(touch_down, end, sinks)
        shown = np.flatnonzero((low > 0) | (high > 0))
        if shown.size:
            start, end = np.where(up, cut, start), np.where(down, cut, end)
            add(shown, start[:, shown], end[:, shown])
    along = np.flatnonzero((rises != 0).any(axis=0) & (sinks != 0).any(axis=0))
    if along.size:
        add(along, sinks[:, along], rises[:, along])
    # A corner that is moved takes its edges along: times the integrand there, at most.
    largest = np.clip(height.max(axis=0) + MOVED * EPS, 0.0, 1.0) * contour.peak(points)
    return value, bound + MOVED * EPS * around * largest
