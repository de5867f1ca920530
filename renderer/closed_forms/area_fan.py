"""Irradiance as a sum of positive terms over a fan of triangles, from inputs in double-double.

E = h integral of z / |v|^4 dA over the part of the light above the horizon, h the distance of the light's plane,
z = n . v: taken by `polygon_fan` from that part's point nearest to the shading point. Slow (tens of microseconds a
point) and right where the closed forms in float64 are not: grazing receivers and emitters, slivers above the
horizon, needles, points beside an edge, and any mixture of these. Relative error: 6e-15 measured, plus what
double-double leaves of the heights.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.renderer.vectors import Floats, cross, dot

from . import double_double as dd
from .double_double import Pair
from .polygon_clip import DOUBT, Edge, Patch, ratio
from .polygon_fan import Sectors, integrate, joined

BOUND = 2.0**-46
"""Relative error of the sum, 1.4e-14: quadrature, and the rounding of a hundred operations."""

GOOD = 0.01
"""A bound above which no value is given."""


@dataclass(frozen=True, eq=False)
class _Apex:
    """Where the fan starts: (s, t), v there, its height, and whose edge it lies on (-1: none)."""

    s: Pair
    t: Pair
    v: Floats
    z: Floats
    edge: Floats


def irradiance_by_area(
    points: Floats, normals: Floats, corner: Floats, ab: Floats, ac: Floats
) -> tuple[Floats, Floats]:
    """Value and relative error bound, each (n,), from (3, n) float64 arrays whose sizes lie within 1e-60 .. 1e60.

    Where 106 bits cannot tell whether there is a light above the horizon, or where, the value is 0 and the bound 1.
    """
    patch = Patch.seen(points, corner, ab, ac, [normals])
    volume, doubt = patch.volume()
    top = np.max([corner.heights[0] for corner in patch.outline()], axis=0)
    unsure = DOUBT * np.abs(normals).sum(axis=0) * patch.extent
    value, bound = np.zeros(top.size), np.ones(top.size)
    bound[((volume == 0) & ((doubt == 0) | (doubt > 1e-200))) | (top <= -unsure)] = 0.0
    bound[top == 0] = 0.0
    some = np.flatnonzero((np.abs(volume) > doubt) & (top > unsure))
    if some.size:
        found, rounding = _fan(patch.take(some), volume[some])
        rounding = rounding + ratio(doubt[some], np.abs(volume[some])) + 4 * ratio(unsure[some], top[some])
        sure = rounding < GOOD
        value[some], bound[some] = np.where(sure, found, 0.0), np.where(sure, rounding, 1.0)
    return value, bound


def _fan(patch: Patch, volume: Floats) -> tuple[Floats, Floats]:
    """E, and the relative error of all but h and the heights."""
    edges = patch.clipped()
    normal = dd.value(dd.cross(patch.e1, patch.e2))
    area = np.sqrt(dot(normal, normal))
    apex = _nearest(patch, edges)
    length2 = dot(apex.v, apex.v)
    halves = [(half, k) for k, edge in enumerate(edges) for half in _halves(patch, edge, apex)]
    total, cosine = integrate(joined([_sectors(patch, half, k, apex, normal, area) for half, k in halves]), area.size)
    value = ratio(np.abs(volume), area * length2 * np.sqrt(dot(patch.planes[0], patch.planes[0]))) * total
    sides = np.sqrt(dot(patch.e1[0], patch.e1[0]) * dot(patch.e2[0], patch.e2[0]))
    doubt = DOUBT * (ratio(patch.extent, np.sqrt(length2)) + ratio(sides, area))
    trusted = (cosine > -0.25) & (value > 0) & (length2 > 0)
    return np.maximum(value, 0), np.where(trusted, BOUND + 4 * doubt, np.inf)


def _halves(patch: Patch, edge: Edge, apex: _Apex) -> tuple[Edge, Edge]:
    """An edge cut near its point closest to the apex: heights there are then known to that distance's digits."""
    a, b, there = edge
    ds, dt = dd.subtract(b.s, a.s), dd.subtract(b.t, a.t)
    start = dd.value(patch.span(dd.subtract(a.s, apex.s), dd.subtract(a.t, apex.t)))
    step = dd.value(patch.span(ds, dt))
    share = dd.exact(np.clip(ratio(-dot(start, step), dot(step, step)), 0.0, 1.0))
    middle = patch.corner(dd.add(a.s, dd.multiply(share, ds)), dd.add(a.t, dd.multiply(share, dt)))
    return (a, middle, there & (share[0] > 0)), (middle, b, there & (share[0] < 1))


def _sectors(patch: Patch, edge: Edge, number: int, apex: _Apex, normal: Floats, area: Floats) -> Sectors:
    """The triangle from the apex over one edge, for each of n points."""
    a, b, there = edge
    sa, ta = dd.subtract(a.s, apex.s), dd.subtract(a.t, apex.t)
    sb, tb = dd.subtract(b.s, apex.s), dd.subtract(b.t, apex.t)
    start = dd.value(patch.span(sa, ta))
    stop = dd.value(patch.span(sb, tb))
    step = dd.value(patch.span(dd.subtract(b.s, a.s), dd.subtract(b.t, a.t)))
    length = np.sqrt(dot(step, step))
    # Twice the triangle's area: in (s, t), where its corners' differences are at hand, times |e1 x e2|.
    twice = dd.value(dd.subtract(dd.multiply(sa, tb), dd.multiply(sb, ta))) * area
    unit = np.sqrt(dot(apex.v, apex.v))
    safe = np.where((length > 0) & (unit > 0), length * unit, 1.0)
    # One end by its own coordinate, the other by the edge's length: the difference keeps its digits.
    low, high, span = dot(start, step) / safe, dot(stop, step) / safe, length * length / safe
    nearer = np.abs(low) <= np.abs(high)
    distance = np.where(there & (length > 0) & (unit > 0) & (apex.edge != number), twice / safe, 0.0)
    outwards = cross(step, normal)
    return Sectors(
        owner=np.arange(length.size),
        start=np.where(nearer, low, high - span),
        stop=np.where(nearer, low + span, high),
        length=span,
        distance=distance,
        z_start=np.maximum(a.heights[0], 0),
        z_stop=np.maximum(b.heights[0], 0),
        z_star=apex.z,
        b_distance=dot(apex.v, outwards) / (safe * np.where(area > 0, area, 1.0)) * np.sign(twice),
        b_along=dot(apex.v, step) / safe,
        exponent=np.zeros(length.size),
    )


def _nearest(patch: Patch, edges: list[Edge]) -> _Apex:
    """The clipped polygon's point nearest to the origin, to 1e-30 of its size; it need not be exact."""
    n = patch.p[0].shape[1]
    best, number = np.full(n, np.inf), np.full(n, -1.0)
    s = t = dd.exact(np.zeros(n))
    foot_s, foot_t = _foot(patch)
    inside = np.ones(n, dtype=bool)
    for k, (a, b, there) in enumerate(edges):
        ds, dt = dd.subtract(b.s, a.s), dd.subtract(b.t, a.t)
        step = dd.value(patch.span(ds, dt))
        at = dd.exact(np.zeros(n))
        for _ in range(2):  # the second time for the digits that the first left
            near = dd.value(patch.place(dd.add(a.s, dd.multiply(at, ds)), dd.add(a.t, dd.multiply(at, dt))))
            at = dd.add(at, dd.exact(ratio(-dot(near, step), dot(step, step))))
        low, high = dd.value(at) <= 0, dd.value(at) >= 1
        s_k = dd.where(low, a.s, dd.where(high, b.s, dd.add(a.s, dd.multiply(at, ds))))
        t_k = dd.where(low, a.t, dd.where(high, b.t, dd.add(a.t, dd.multiply(at, dt))))
        near = dd.value(patch.place(s_k, t_k))
        length2 = dot(near, near)
        better = there & (length2 < best)
        best, number = np.where(better, length2, best), np.where(better, float(k), number)
        s, t = dd.where(better, s_k, s), dd.where(better, t_k, t)
        turn = dd.subtract(dd.multiply(ds, dd.subtract(foot_t, a.t)), dd.multiply(dt, dd.subtract(foot_s, a.s)))
        inside &= ~there | (dd.value(turn) >= 0)
    s, t = dd.where(inside, foot_s, s), dd.where(inside, foot_t, t)
    height = np.maximum(patch.corner(s, t).heights[0], 0)
    return _Apex(s, t, dd.value(patch.place(s, t)), height, np.where(inside, -1.0, number))


def _foot(patch: Patch) -> tuple[Pair, Pair]:
    """Parameters of the foot of the perpendicular: residuals in double-double, corrections in double."""
    e1, e2 = patch.e1[0], patch.e2[0]
    a, b, c = dot(e1, e1), dot(e1, e2), dot(e2, e2)
    normal = cross(e1, e2)
    determinant = dot(normal, normal)
    s = t = dd.exact(np.zeros(a.size))
    for _ in range(3):
        v = patch.place(s, t)
        d, e = dd.value(dd.dot(patch.e1, v)), dd.value(dd.dot(patch.e2, v))
        s = dd.add(s, dd.exact(ratio(b * e - c * d, determinant)))
        t = dd.add(t, dd.exact(ratio(b * d - a * e, determinant)))
    return s, t
