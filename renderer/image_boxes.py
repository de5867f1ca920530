"""Which triangle a camera ray meets first, where triangles are many.

Every triangle's bounding box in the image plane is found once; the rays of a tile are sorted into pixels, and
only pairs of a ray and a box that holds it are tested, by the edge functions of `watertight`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .geometry import Geometry, Ints
from .pairs import Cells, take
from .pencil import Pencil
from .shadows import plane_bound
from .vectors import Floats, dot, transform
from .watertight import SLOPE_ULPS, edge_functions, one_norm

DENSE = 32
"""Triangles of a tile up to which every ray tests every one."""

BOX_ULPS = 64 * 2.0**-53
"""Rounding of a projected coordinate relative to |row|_1 |v| / depth: a difference, a row of an inverse matrix
and a sum of three products each for the vertex and the ray, and the slack of the edge functions."""


@dataclass(frozen=True)
class ImageBoxes:
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
    def about(cls, geometry: Geometry, origin: Floats, corners: Floats | None) -> ImageBoxes:
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
        if d.shape[1] == 0:
            return found.distance, found.triangle, found.weight
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
        if chosen.size == 0:
            return
        pencil = Pencil.about(self.geometry, self.origin, chosen)
        near, which = pencil.nearest(d, np.flatnonzero(pencil.live))
        ray = np.flatnonzero(near > 0)
        which = which[ray]
        found.put(ray, 1 / near[ray], chosen[which], pencil.weights(take(d, ray), which))

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


@lru_cache(maxsize=2)
def kept_boxes(geometry: Geometry, origin: bytes, corners: bytes) -> ImageBoxes:
    return ImageBoxes.about(geometry, np.frombuffer(origin).reshape(3, 1), np.frombuffer(corners).reshape(3, 3))
