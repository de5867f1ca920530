"""What the camera sees: the nearest surface along rays that share one origin.

With a common origin the edge functions of a triangle (see `watertight`) are the same for all rays and linear
in the direction (Olano & Greer 1997). Every triangle's bounding box in the image plane is found once; the rays
of a tile are sorted into pixels, and only pairs of a ray and a box that holds it are tested.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .geometry import Geometry, Ints
from .pairs import BLOCK, Cells, take
from .shadows import plane_bound
from .vectors import Floats, dot, transform, unit
from .watertight import SLOPE_ULPS, edge_functions, one_norm

DENSE = 32
"""Triangles up to which every ray tests every one."""

BOX_ULPS = 64 * 2.0**-53
"""Rounding of a projected coordinate relative to |row|_1 |v| / depth: a difference, a row of an inverse matrix
and a sum of three products each for the vertex and the ray, and the slack of the edge functions."""


@dataclass(frozen=True)
class Hits:
    """The nearest hits of n rays.

    Parameters
    ----------
    surface : (n,) int64
        Row of the surface tables, -1 where nothing was hit.
    position : (3, n) float64
        On the surface to a few ulps of its own coordinates, however far the camera is.
    normal : (3, n) float64
        Unit geometric normal of the front side.
    distance : (n,) float64
        Ray parameter, in lengths of the direction given; inf where nothing was hit.
    ellipsoid : (n,) int64
        Index of the ellipsoid hit, -1 for triangles and misses.
    """

    surface: Ints
    position: Floats
    normal: Floats
    distance: Floats
    ellipsoid: Ints


@dataclass(frozen=True)
class _Pencil:
    """All triangles about one origin, and their boxes in the plane of three corner directions.

    The origin lies ``height`` (t,) below each plane, times its normal; planes it lies in are not live. A
    direction is depth x (corner + s side + t other side): ``rows`` (3, 3) find depth, s depth and t depth.
    ``boxes`` (4, t) bound s and t: low s, high s, low t, high t.
    """

    geometry: Geometry
    origin: Floats
    rows: Floats | None
    boxes: Floats
    live: NDArray[np.bool_]

    @classmethod
    def about(cls, geometry: Geometry, origin: Floats, corners: Floats | None) -> _Pencil:
        height = dot(geometry.a - origin, geometry.normal)
        live = np.abs(height) > plane_bound(geometry.normal, geometry.a, origin)
        everywhere = np.tile([[-np.inf], [np.inf]], (2, geometry.triangles))
        if corners is None:
            return cls(geometry, origin, None, everywhere, live)
        c, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        size = np.abs(u).max(), np.abs(v).max()
        frame = np.stack((c, u / size[0], v / size[1]), axis=1)  # columns of one size: the inverse keeps its digits
        if np.linalg.cond(frame) > 1e8:
            return cls(geometry, origin, None, everywhere, live)
        inverse = np.linalg.inv(frame)
        rows = inverse / np.array([[1.0], [size[0]], [size[1]]])
        bounds = [_project(rows, corner - origin) for corner in (geometry.a, geometry.b, geometry.c)]
        low = np.minimum(np.minimum(bounds[0][0], bounds[1][0]), bounds[2][0])
        high = np.maximum(np.maximum(bounds[0][1], bounds[1][1]), bounds[2][1])
        boxes = np.stack((low[0], high[0], low[1], high[1]))
        ahead, behind = (np.stack([b[k] for b in bounds]) for k in (2, 3))
        whole = ahead.all(axis=0)
        boxes = np.where(whole, boxes, everywhere)
        return cls(geometry, origin, rows, boxes, live & ~behind.all(axis=0))

    def nearest(self, d: Floats) -> tuple[Floats, Ints, Floats]:
        """Nearest triangle along each direction: distance (n,), triangle, weights (3, n)."""
        found = _Nearest(d.shape[1])
        if self.rows is None:
            self._dense(d, np.flatnonzero(self.live), found)
            return found.distance, found.triangle, found.weight
        low, high, ahead, _ = _project(self.rows, d)
        if not ahead.all():
            self._dense(d, np.flatnonzero(self.live), found)
            return found.distance, found.triangle, found.weight
        s0, s1, t0, t1 = self.boxes
        chosen = np.flatnonzero(
            (s0 <= high[0].max()) & (s1 >= low[0].min()) & (t0 <= high[1].max()) & (t1 >= low[1].min()) & self.live
        )
        cells = Cells.of((low[0] + high[0]) / 2, (low[1] + high[1]) / 2) if chosen.size > DENSE else None
        if cells is None:
            self._dense(d, chosen, found)
        else:
            self._binned(d, chosen, cells, ((high - low) / 2).max(axis=1), found)
        return found.distance, found.triangle, found.weight

    def _dense(self, d: Floats, chosen: Ints, found: _Nearest) -> None:
        step = max(1, BLOCK // max(d.shape[1], 1))
        for start in range(0, chosen.size, step):
            block = chosen[start : start + step]
            t, w = _Sides.of(self.geometry, block, self.origin).meet(d)
            nearest = t.argmin(axis=0)
            where = nearest * d.shape[1] + np.arange(d.shape[1])
            t = take(t.ravel(), where)
            ray = np.flatnonzero(t < found.distance)
            weight = take(w.reshape(3, -1), take(where, ray))
            found.put(ray, take(t, ray), take(block, take(nearest, ray)), weight)

    def _binned(self, d: Floats, chosen: Ints, cells: Cells, pad: Floats, found: _Nearest) -> None:
        s0, s1, t0, t1 = self.boxes[:, chosen]
        for box, ray in cells.in_boxes(s0 - pad[0], s1 + pad[0], t0 - pad[1], t1 + pad[1]):
            if box.size == 0:
                continue
            first = np.flatnonzero(np.diff(box, prepend=-1))  # each box's pairs stand together
            number = np.repeat(np.arange(first.size), np.diff(np.append(first, box.size)))
            triangles = chosen[box[first]]
            sides = _Sides.of(self.geometry, triangles, self.origin)
            inside, w = sides.inside(number, d, ray)
            ray, number = ray[inside], number[inside]
            t = sides.distance(number, d, ray)
            hit = np.flatnonzero(t < np.inf)
            found.take(ray[hit], t[hit], triangles[number[hit]], w[:, hit])


@dataclass(frozen=True)
class _Sides:
    """What a ray meets of triangles: edge functions (3 edges) with slack, plane normals and heights."""

    edges: tuple[Floats, ...]
    slack: tuple[Floats, ...]
    normal: Floats
    height: Floats

    @classmethod
    def of(cls, g: Geometry, k: Ints, origin: Floats) -> _Sides:
        a, b, c, normal = (take(v, k) for v in (g.a, g.b, g.c, g.normal))
        pairs = edge_functions(a, b, c, origin)
        return cls(tuple(edge for edge, _ in pairs), tuple(s for _, s in pairs), normal, dot(a - origin, normal))

    def meet(self, d: Floats) -> tuple[Floats, Floats]:
        """Every ray (3, n) against every triangle: ray parameter (t, n), inf for a miss; edge functions."""
        d, size = d[:, None, :], one_norm(d)
        w = np.stack([dot(edge[:, :, None], d) for edge in self.edges])
        inside = _one_sided(w, [slack[:, None] * size for slack in self.slack])
        slope = dot(self.normal[:, :, None], d)
        return _distance(slope, one_norm(self.normal)[:, None] * size, self.height[:, None], inside), w

    def inside(self, k: Ints, d: Floats, ray: Ints) -> tuple[Ints, Floats]:
        """Of pairs (triangle, ray), each (m,), those on the inside of the edges; and their edge functions."""
        size = take(one_norm(d), ray)
        x, y, z = (take(component, ray) for component in d)
        w = np.stack([take(e[0], k) * x + take(e[1], k) * y + take(e[2], k) * z for e in self.edges])
        kept = np.flatnonzero(_one_sided(w, [take(slack, k) * size for slack in self.slack]))
        return kept, take(w, kept)

    def distance(self, k: Ints, d: Floats, ray: Ints) -> Floats:
        """Ray parameter of pairs, inf where the triangle's plane is not met."""
        d = take(d, ray)
        n = take(self.normal, k)
        return _distance(dot(n, d), one_norm(n) * one_norm(d), take(self.height, k), True)


def _one_sided(w: Floats, reach: list[Floats]) -> NDArray[np.bool_]:
    """Whether all three edge functions are at least -reach, or all at most reach."""
    over = (w[0] >= -reach[0]) & (w[1] >= -reach[1]) & (w[2] >= -reach[2])
    return over | ((w[0] <= reach[0]) & (w[1] <= reach[1]) & (w[2] <= reach[2]))


def _distance(slope: Floats, size: Floats, height: Floats, where: NDArray[np.bool_] | bool) -> Floats:
    ahead = where & (np.abs(slope) > SLOPE_ULPS * size) & (slope * height > 0)
    return np.divide(height, slope, out=np.full(slope.shape, np.inf), where=ahead)


class _Nearest:
    """The nearest hits so far; of equal ones the first triangle's."""

    def __init__(self, n: int) -> None:
        self.distance, self.triangle, self.weight = np.full(n, np.inf), np.full(n, -1), np.zeros((3, n))

    def take(self, ray: Ints, t: Floats, triangle: Ints, weight: Floats) -> None:
        """Hits of rising triangle number; a ray may come more than once."""
        before = take(self.distance, ray)
        np.minimum.at(self.distance, ray, t)
        # Backwards: of several writes to one place the last one stays.
        won = np.flatnonzero((t == take(self.distance, ray)) & (t < before))[::-1]
        self.put(ray[won], t[won], triangle[won], weight[:, won])

    def put(self, ray: Ints, t: Floats, triangle: Ints, weight: Floats) -> None:
        """Hits known to be nearer."""
        self.distance[ray] = t
        self.triangle[ray] = triangle
        for mine, new in zip(self.weight, weight, strict=True):
            mine[ray] = new


def _project(rows: Floats, v: Floats) -> tuple[Floats, Floats, NDArray[np.bool_], NDArray[np.bool_]]:
    """Bounds (2, n) of s and t with their rounding, and whether v is surely ahead, or surely behind."""
    size = BOX_ULPS * np.abs(v).max(axis=0)
    depth, *across = transform(rows, v)
    reach = np.abs(rows).sum(axis=1)
    slack = reach[0] * size
    ahead, behind = depth > 4 * slack, depth < -4 * slack
    safe = np.where(ahead, depth, 1.0)
    at = np.stack([value / safe for value in across])
    pad = (reach[1:, None] + np.abs(at) * reach[0]) * (size / safe)
    return at - 2 * pad, at + 2 * pad, ahead, behind


def _on_triangles(geometry: Geometry, triangle: Ints, weight: Floats) -> tuple[Floats, Floats, Ints]:
    """Position, normal and surface of hits on triangles (n,), with zeros and -1 where there is none (-1)."""
    n = triangle.size
    on = np.flatnonzero(triangle >= 0)
    everywhere = on.size == n
    if on.size == 0:
        return np.zeros((3, n)), np.zeros((3, n)), np.full(n, -1)
    k, w = (triangle, weight) if everywhere else (triangle[on], take(weight, on))
    # From the corners, not from origin + t d: off the plane by ulps of the corners alone.
    w = w / (w[0] + w[1] + w[2])
    at = w[0] * take(geometry.a, k)
    at += w[1] * take(geometry.b, k)
    at += w[2] * take(geometry.c, k)
    up = unit(take(geometry.normal, k))
    rows = take(geometry.triangle_surface, k)
    if everywhere:
        return at, up, rows
    position, normal, surface = np.zeros((3, n)), np.zeros((3, n)), np.full(n, -1)
    position[:, on], normal[:, on], surface[on] = at, up, rows
    return position, normal, surface


@lru_cache(maxsize=2)
def _kept(geometry: Geometry, origin: bytes, corners: bytes) -> _Pencil:
    return _Pencil.about(geometry, np.frombuffer(origin).reshape(3, 1), np.frombuffer(corners).reshape(3, 3))


def _ellipsoid_distance(o: Floats, d: Floats) -> Floats:
    """First positive crossing of the unit sphere from o (3, 1) along d (3, n); inf where there is none.

    The discriminant is taken from the closest approach, 1 - |o - (o.d)d|^2, which keeps its digits for
    spheres far away (Haines et al. 2019); the nearer root avoids the difference of two close numbers.
    """
    length2 = dot(d, d)
    b = dot(np.broadcast_to(o, d.shape), d)
    closest = o - d * (b / length2)
    discriminant = length2 * (1 - dot(closest, closest))
    c = dot(o, o) - 1
    root = np.sqrt(np.maximum(discriminant, 0))
    q = -(b + np.copysign(root, b))
    with np.errstate(divide="ignore", invalid="ignore"):
        t0, t1 = q / length2, c / q
    near, far = np.minimum(t0, t1), np.maximum(t0, t1)
    t = np.where(near > 0, near, far)
    return np.where((discriminant >= 0) & (t > 0), t, np.inf)


def first_hits(geometry: Geometry, origin: Floats, d: Floats, corners: Floats | None = None) -> Hits:
    """Nearest hit of each ray.

    Parameters
    ----------
    origin : (3, 1) float64
        Common origin.
    d : (3, n) float64
        Directions, of any length.
    corners : (3, 3) float64, optional
        Directions c, c + u and c + v through three corners of a pixel, so that d is a multiple of
        c + x u + y v: what is found about the image plane is kept for further calls. None: every ray tests
        every triangle.
    """
    if corners is None:
        pencil = _Pencil.about(geometry, origin, None)
    else:
        pencil = _kept(geometry, origin.astype(float).tobytes(), corners.astype(float).tobytes())
    distance, triangle, weight = pencil.nearest(d)
    n = d.shape[1]
    ellipsoid = np.full(n, -1)
    for index in range(geometry.ellipsoids):
        inverse = geometry.inverse[index]
        t = _ellipsoid_distance(transform(inverse, origin - geometry.center[:, [index]]), transform(inverse, d))
        nearer = t < distance
        distance = np.where(nearer, t, distance)
        ellipsoid[nearer] = index
    position, normal, surface = _on_triangles(geometry, np.where(ellipsoid < 0, triangle, -1), weight)
    for index in range(geometry.ellipsoids):
        mine = np.flatnonzero(ellipsoid == index)
        inverse, center = geometry.inverse[index], geometry.center[:, [index]]
        local = unit(transform(inverse, origin - center) + transform(inverse, d[:, mine]) * distance[mine])
        position[:, mine] = center + transform(geometry.axes[index], local)
        normal[:, mine] = unit(transform(inverse.T, local))
        surface[mine] = geometry.ellipsoid_surface[index]
    return Hits(surface, position, normal, distance, ellipsoid)
