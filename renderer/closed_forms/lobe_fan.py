"""The Phong lobe over a parallelogram as a sum of positive terms, from inputs in double-double.

Projected from the shading point onto the plane w . v = 1, w the mirror direction, the light is a polygon again and
I = integral of z |v|^-(4+s) dA with z = n . v: the integral of `polygon_fan`, from the polygon's point nearest to w,
where the lobe peaks. The part below either horizon is cut off in three dimensions first; what then lies on the
lobe's own horizon projects to infinity and is put at 1e25. Slow (a hundred microseconds a point), at a cost that
does not grow with s, and right for lights of any size, lobes that miss them, and values down to 1e-300.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.renderer.vectors import Bools, Floats, dot, frame, unit

from . import double_double as dd
from .double_double import Pair
from .polygon_clip import DOUBT, Corner, Edge, Patch, ratio
from .polygon_fan import Sectors, integrate, joined

BOUND = 2.0**-44
"""Relative error of the sum, 6e-14."""
ANGLE = 2.0**-50
"""Error of a direction in the lobe's plane."""
GOOD = 0.01
"""A bound above which no value is given."""
FAR = 1e-25
"""Depth, over the size of things, of what lies on the lobe's horizon."""
FALL = 46.0


@dataclass(frozen=True, eq=False)
class _Lobe:
    """The plane w . v = 1: two directions (3, n) in it, w's length, n . w per |w|."""

    across: Floats
    up: Floats
    length: Floats
    z_peak: Floats

    @classmethod
    def about(cls, w: Floats, n: Floats) -> _Lobe:
        length = np.sqrt(dot(w, w))
        across, up = frame(unit(w))
        return cls(across, up, length, np.maximum(dd.value(dd.dot(dd.exact(n), dd.exact(w))) / length, 0))

    def flat(self, v: Floats) -> Floats:
        """Components (2, n) in the plane."""
        return np.stack((dot(self.across, v), dot(self.up, v)))


@dataclass(frozen=True, eq=False)
class _Seen:
    """A corner, projected: where it is, how deep (w . v), and its height per depth."""

    corner: Corner
    v: Pair
    deep: Pair
    depth: Floats
    place: Floats
    height: Floats


@dataclass(frozen=True, eq=False)
class _Apex:
    """Where the fan starts: a point of the light (s, t), or w itself where ``edge`` is -1."""

    seen: _Seen
    place: Floats
    height: Floats
    edge: Floats


def lobe_by_area(
    points: Floats, normals: Floats, mirror: Floats, s: Floats, corner: Floats, ab: Floats, ac: Floats
) -> tuple[Floats, Floats]:
    """Value and relative error bound, each (n,), from (3, n) float64 arrays whose sizes lie within 1e-60 .. 1e60.

    Where 106 bits cannot tell whether there is a light above both horizons, or where, the value is 0 and the bound 1.
    """
    whole = Patch.seen(points, corner, ab, ac, [normals, mirror])
    patch = Patch.seen(points, corner, ab, ac, [normals, mirror, _rim(whole, s)])
    volume, doubt = patch.volume()
    value, bound = np.zeros(s.size), np.ones(s.size)
    heights = np.array([corner.heights for corner in patch.outline()])  # corner, plane, point
    tops = heights.max(axis=0)[:2]
    unsure = np.stack([DOUBT * np.abs(plane).sum(axis=0) * patch.extent for plane in patch.planes[:2]])
    bound[((volume == 0) & ((doubt == 0) | (doubt > 1e-200))) | ((tops <= -unsure) | (tops == 0)).any(axis=0)] = 0.0
    some = np.flatnonzero((np.abs(volume) > doubt) & (tops > unsure).all(axis=0))
    if some.size:
        few = patch.take(some)
        found, rounding, dark = _fan(few, volume[some], s[some])
        rounding = rounding + ratio(doubt[some], np.abs(volume[some])) + 4 * ratio(unsure, tops).sum(axis=0)[some]
        sure = rounding < GOOD
        value[some] = np.where(sure, found, 0.0)
        bound[some] = np.where(dark, 0.0, np.where(sure, rounding, 1.0))
    return value, bound


def _rim(patch: Patch, s: Floats) -> Floats:
    """A plane (3, n) just above the lobe's horizon: what lies below it has t^s under e^-FALL of the peak's.

    Without it the light would reach to infinity in the plane w . v = 1, over sixty powers of e.
    """
    w = patch.planes[1]
    length = np.sqrt(dot(w, w))
    deepest, most = np.zeros_like(w), np.zeros_like(s)
    for start, _, there in patch.clipped():
        v = dd.value(patch.place(start.s, start.t))
        size = np.sqrt(dot(v, v))
        t = np.where(there, ratio(start.heights[1], size * length), 0.0)
        deepest, most = np.where(t > most, unit(v), deepest), np.maximum(t, most)
    return np.asarray(w - deepest * (most * length * np.exp(-(FALL + 2 * np.log1p(s)) / (s + 1))))


def _fan(patch: Patch, volume: Floats, s: Floats) -> tuple[Floats, Floats, Floats]:
    """I, the relative error of all but the heights and the volume, and where nothing is above both horizons."""
    n, w, _ = patch.planes
    lobe = _Lobe.about(w, n)
    edges = patch.clipped()
    dark = ~np.any([there for _, _, there in edges], axis=0)
    apex = _peak(patch, lobe, edges, volume)
    parts = []
    for k, edge in enumerate(edges):
        for half in _halves(patch, lobe, edge, apex):
            parts.append(_sectors(patch, lobe, half, k, apex, volume, s))
    total, cosine = integrate(joined(parts), s.size)
    tangent2 = dot2(apex.place, apex.place)
    value = total / np.sqrt(dot(n, n)) * np.exp(np.maximum(-(1 + s / 2) * np.log1p(tangent2), -800.0))
    # Directions are right to ANGLE: t^s changes by s tan(theta) times that, theta from w to the peak or the lobe's rim.
    steep = s * np.sqrt(tangent2) / (1 + tangent2) + 9 * np.sqrt(s)
    trusted = (cosine > -0.25) & (value > 1e-290)
    return np.maximum(value, 0), np.where(trusted, BOUND + ANGLE * steep, np.inf), dark


def dot2(a: Floats, b: Floats) -> Floats:
    """Dot product in the plane."""
    return a[0] * b[0] + a[1] * b[1]


def _see(patch: Patch, lobe: _Lobe, corner: Corner) -> _Seen:
    v = patch.place(corner.s, corner.t)
    base, along, across = patch.slopes[1]
    deep = dd.add(base, dd.add(dd.multiply(corner.s, along), dd.multiply(corner.t, across)))
    # One and the same least depth for all corners: differences of depths stay those of the corners.
    least = FAR * patch.extent * lobe.length
    deep = dd.where(corner.heights[1] > least, deep, dd.exact(least))
    depth = dd.value(deep) / lobe.length
    return _Seen(corner, v, deep, depth, lobe.flat(dd.value(v)) / depth, np.maximum(corner.heights[0], 0) / depth)


def _step(patch: Patch, lobe: _Lobe, a: _Seen, b: _Seen) -> Floats:
    """Projection of b less that of a, from v_b - v_a: (D (w.a) - a (w.D)) / ((w.a) (w.b)), D = b - a."""
    # In double-double: where a and b lie in almost one direction the two terms cancel.
    ds, dt = dd.subtract(b.corner.s, a.corner.s), dd.subtract(b.corner.t, a.corner.t)
    deeper = dd.subtract(b.deep, a.deep)
    moved = dd.subtract(dd.multiply(a.deep, patch.span(ds, dt)), dd.multiply(deeper, a.v))
    return lobe.flat(dd.value(moved)) / (a.depth * b.depth * lobe.length)


def _closest(patch: Patch, lobe: _Lobe, a: _Seen, b: _Seen, to_a: Floats, to_b: Floats) -> tuple[_Seen, Bools, Bools]:
    """The point from a to b closest to where ``to_a`` and ``to_b`` start, all projected; whether it is a, or b.

    From the nearer end: the other may be 1e20 times as far.
    """
    step = _step(patch, lobe, a, b)
    share, rest = (np.clip(ratio(x, dot2(step, step)), 0.0, 1.0) for x in (-dot2(to_a, step), dot2(to_b, step)))
    near, far = share * a.depth, rest * b.depth
    f, g = (dd.exact(ratio(x, near + far)) for x in (near, far))
    ends = (a.corner.s, b.corner.s), (a.corner.t, b.corner.t)
    s, t = (
        dd.where(
            near <= far, dd.add(u, dd.multiply(f, dd.subtract(v, u))), dd.add(v, dd.multiply(g, dd.subtract(u, v)))
        )
        for u, v in ends
    )
    return _see(patch, lobe, patch.corner(s, t)), share <= 0, rest <= 0


def _peak(patch: Patch, lobe: _Lobe, edges: list[Edge], volume: Floats) -> _Apex:
    """The clipped polygon's point nearest to w; it need not be exact."""
    best, number = np.full(volume.size, np.inf), np.full(volume.size, -1.0)
    found: _Seen | None = None
    inside = np.ones(volume.size, dtype=bool)
    for k, (start, stop, there) in enumerate(edges):
        a, b = _see(patch, lobe, start), _see(patch, lobe, stop)
        near, _, _ = _closest(patch, lobe, a, b, a.place, b.place)
        distance = dot2(near.place, near.place)
        better = there & (distance < best)
        found = near if found is None else _choose(better, near, found)
        best, number = np.where(better, distance, best), np.where(better, float(k), number)
        inside &= ~there | (_turn_about_peak(patch, lobe, start, stop) * np.sign(volume) >= 0)
    if found is None:
        raise ValueError("a polygon without edges")
    place = np.where(inside, 0.0, found.place)
    return _Apex(found, place, np.where(inside, lobe.z_peak, found.height), np.where(inside, -1.0, number))


def _choose(mask: Bools, a: _Seen, b: _Seen) -> _Seen:
    return _Seen(
        a.corner.where(mask, b.corner),
        dd.where(mask, a.v, b.v),
        dd.where(mask, a.deep, b.deep),
        np.where(mask, a.depth, b.depth),
        np.where(mask, a.place, b.place),
        np.where(mask, a.height, b.height),
    )


def _turn_about_peak(patch: Patch, lobe: _Lobe, a: Corner, b: Corner) -> Floats:
    """w . (v_a x v_b) / |w|."""
    step = patch.span(dd.subtract(b.s, a.s), dd.subtract(b.t, a.t))
    return dd.value(dd.dot(dd.exact(patch.planes[1]), dd.cross(patch.place(a.s, a.t), step))) / lobe.length


def _offset(patch: Patch, lobe: _Lobe, apex: _Apex, a: _Seen) -> Floats:
    """Projection of a corner less that of the apex."""
    return np.where(apex.edge < 0, a.place, _step(patch, lobe, apex.seen, a))


def _halves(patch: Patch, lobe: _Lobe, edge: Edge, apex: _Apex) -> list[Edge]:
    """An edge cut near its projection's point closest to the apex."""
    start, stop, there = edge
    a, b = _see(patch, lobe, start), _see(patch, lobe, stop)
    to_a, to_b = (_offset(patch, lobe, apex, v) for v in (a, b))
    middle, first, last = _closest(patch, lobe, a, b, to_a, to_b)
    return [(start, middle.corner, there & ~first), (middle.corner, stop, there & ~last)]


def _sectors(patch: Patch, lobe: _Lobe, edge: Edge, number: int, apex: _Apex, volume: Floats, s: Floats) -> Sectors:
    """The triangle from the apex over one edge's projection, for each of n points."""
    a, b = _see(patch, lobe, edge[0]), _see(patch, lobe, edge[1])
    step = _step(patch, lobe, a, b)
    length = np.sqrt(dot2(step, step))
    unit_length = np.sqrt(1 + dot2(apex.place, apex.place))
    safe = np.where(length > 0, length * unit_length, 1.0)
    twice = _twice(patch, lobe, a, b, apex, volume)
    there = edge[2] & (length > 0) & (apex.edge != number)
    low, high = (dot2(_offset(patch, lobe, apex, v), step) / safe for v in (a, b))
    span, nearer = length * length / safe, np.abs(low) <= np.abs(high)
    sign = np.sign(volume)  # the projection's turning sense
    outwards = np.stack((step[1], -step[0])) * sign
    return Sectors(
        owner=np.arange(s.size),
        start=np.where(nearer, low, high - span),
        stop=np.where(nearer, low + span, high),
        length=span,
        distance=np.where(there, twice / safe, 0.0),
        z_start=a.height,
        z_stop=b.height,
        z_star=apex.height,
        b_distance=dot2(apex.place, outwards) / safe * np.sign(twice),
        b_along=dot2(apex.place, step) / safe,
        exponent=s,
    )


def _twice(patch: Patch, lobe: _Lobe, a: _Seen, b: _Seen, apex: _Apex, volume: Floats) -> Floats:
    """Twice the projected triangle's area: a determinant of three directions over their depths."""
    sa, ta = _differences(a.corner.s, a.corner.t, apex)
    sb, tb = _differences(b.corner.s, b.corner.t, apex)
    turn = dd.value(dd.subtract(dd.multiply(sa, tb), dd.multiply(sb, ta)))
    from_edge = turn * np.abs(volume) / apex.seen.depth
    from_peak = _turn_about_peak(patch, lobe, a.corner, b.corner) * np.sign(volume)
    return np.where(apex.edge < 0, from_peak, from_edge) / (a.depth * b.depth)


def _differences(s: Pair, t: Pair, apex: _Apex) -> tuple[Pair, Pair]:
    return dd.subtract(s, apex.seen.corner.s), dd.subtract(t, apex.seen.corner.t)
