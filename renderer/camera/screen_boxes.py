"""Which triangle a camera ray meets first, where triangles are many.

Every triangle's bounding box in the image plane is found once; the rays of a tile are sorted into pixels, and
only pairs of a ray and a box that holds it are tested, by the edge functions of `watertight`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.geometry.ragged import MAX_CELLS, Cells, any_within, take
from nusselt.renderer.vectors import Floats, Ints, transform
from nusselt.renderer.watertight import edge_functions

from .edge_functions import Pencil
from .nearest import Nearest, Planes, precedence, standing_before

DENSE = 32
"""Triangles of a tile up to which every ray tests every one."""

BOX_ULPS = 64 * 2.0**-53
"""Rounding of a projected coordinate relative to |row|_1 |v| / depth: a difference, a row of an inverse matrix
and a sum of three products each for the vertex and the ray, and the slack of the edge functions."""


@dataclass(frozen=True, eq=False)
class ImageBoxes:
    """All triangles about one origin, and their boxes in the plane of three corner directions.

    A direction is depth x (corner + s side + t other side): ``rows`` (3, 3) find depth, s depth and t depth.
    ``boxes`` (4, t) bound s and t: low s, high s, low t, high t. Planes the origin lies in are not ``live`` (t,);
    ``order`` (t,) is the triangles' precedence where they tie.
    """

    geometry: Geometry
    origin: Floats
    rows: Floats | None
    boxes: Floats
    live: NDArray[np.bool_]
    order: Ints

    @classmethod
    def about(cls, geometry: Geometry, origin: Floats, corners: Floats | None) -> ImageBoxes:
        planes = Planes.about(geometry.normal, geometry.a, origin)
        live, order = planes.live, precedence(geometry, planes.back)
        everywhere = np.tile([[-np.inf], [np.inf]], (2, geometry.triangles))
        if corners is None:
            return cls(geometry, origin, None, everywhere, live, order)
        c, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        size = np.abs(u).max(), np.abs(v).max()
        frame = np.stack((c, u / size[0], v / size[1]), axis=1)  # columns of one size: the inverse keeps its digits
        if np.linalg.cond(frame) > 1e8:
            return cls(geometry, origin, None, everywhere, live, order)
        inverse = np.linalg.inv(frame)
        rows = inverse / np.array([[1.0], [size[0]], [size[1]]])
        bounds = [_project(rows, corner - origin) for corner in (geometry.a, geometry.b, geometry.c)]
        low = np.minimum(np.minimum(bounds[0][0], bounds[1][0]), bounds[2][0])
        high = np.maximum(np.maximum(bounds[0][1], bounds[1][1]), bounds[2][1])
        boxes = np.stack((low[0], high[0], low[1], high[1]))
        ahead, behind = (np.stack([b[k] for b in bounds]) for k in (2, 3))
        whole = ahead.all(axis=0)
        boxes = np.where(whole, boxes, everywhere)
        return cls(geometry, origin, rows, boxes, live & ~behind.all(axis=0), order)

    def nearest(self, d: Floats, frames: int = 1) -> tuple[Floats, Ints, Floats]:
        """What is seen along each direction: distance (n,), triangle, its edge functions (3, n).

        Directions may come in so many ``frames``, each through the same pixels in turn and at one place in all.
        """
        if self.rows is None or d.shape[1] == 0:
            return self._dense(d, np.flatnonzero(self.live))
        low, high, ahead, _ = _project(self.rows, d)
        if not ahead.all():
            return self._dense(d, np.flatnonzero(self.live))
        s0, s1, t0, t1 = self.boxes
        chosen: Ints = np.flatnonzero(
            (s0 <= high[0].max()) & (s1 >= low[0].min()) & (t0 <= high[1].max()) & (t1 >= low[1].min()) & self.live
        )
        middle, pad = (low + high) / 2, ((high - low) / 2).max(axis=1)
        if frames > 1:
            chosen = self._around(chosen, middle[:, : d.shape[1] // frames])
        if chosen.size <= DENSE:
            return self._dense(d, chosen)
        fine = 1 if frames > 1 else _subdivision(middle)
        cells = Cells.of(*(fine * middle[:, : d.shape[1] // frames]))
        if cells is None:
            return self._dense(d, chosen)
        found = Nearest(d)
        bounds = [fine * v for v in self._padded(chosen, pad)]
        if frames > 1:
            sides = _Sides.of(self.geometry, chosen, self.origin)
            for box, ray in cells.in_frames(middle.reshape(2, frames, -1), *bounds):
                inside, w = sides.inside(box, d, ray, found.size)
                found.meet(sides.planes, take(box, inside), take(ray, inside), chosen, *w)
        else:
            self._binned(found, chosen, cells.in_boxes(*bounds))
        near, triangle, weight = found.seen(self.order, standing_before(self.geometry, self.origin))
        return _distance(near), triangle, np.stack(weight) if weight else np.zeros(d.shape)

    def _around(self, chosen: Ints, at: Floats) -> Ints:
        """Which of the chosen boxes touch a pixel of those that places (2, n) lie in; all, where that is not told."""
        low = np.floor(at.min(axis=1))
        wide, high = (np.floor(at.max(axis=1)) - low + 1).astype(np.int64)
        if wide * high > MAX_CELLS:
            return chosen
        column, row = np.floor(at - low[:, None]).astype(np.int64)
        count = np.bincount(row * wide + column, minlength=wide * high).reshape(high, wide)
        # One pixel more on every side: places were rounded.
        s0, s1, t0, t1 = (
            np.clip(np.floor(bound - corner) + step, 0, most).astype(np.int64)
            for bound, corner, step, most in zip(
                self.boxes[:, chosen], np.repeat(low, 2), (-1, 2, -1, 2), np.repeat((wide, high), 2), strict=True
            )
        )
        return chosen[any_within(count, s0, s1, t0, t1)]

    def _padded(self, chosen: Ints, pad: Floats) -> list[Floats]:
        s0, s1, t0, t1 = self.boxes[:, chosen]
        return [s0 - pad[0], s1 + pad[0], t0 - pad[1], t1 + pad[1]]

    def _dense(self, d: Floats, chosen: Ints) -> tuple[Floats, Ints, Floats]:
        if chosen.size == 0:
            return np.full(d.shape[1], np.inf), np.full(d.shape[1], -1), np.zeros(d.shape)
        pencil = Pencil.about(self.geometry, self.origin, chosen)
        near, which = pencil.nearest(d, np.arange(chosen.size))
        return _distance(near), np.where(which < 0, -1, take(chosen, which)), pencil.weights(d, which)

    def _binned(self, found: Nearest, chosen: Ints, pairs: Iterator[tuple[Ints, Ints]]) -> None:
        for box, ray in pairs:
            if box.size == 0:
                continue
            first = np.flatnonzero(np.diff(box, prepend=-1))  # each box's pairs stand together
            number = np.repeat(np.arange(first.size), np.diff(np.append(first, box.size)))
            triangles = chosen[box[first]]
            sides = _Sides.of(self.geometry, triangles, self.origin)
            inside, w = sides.inside(number, found.d, ray, found.size)
            found.meet(sides.planes, take(number, inside), take(ray, inside), triangles, *w)


@dataclass(frozen=True, eq=False)
class _Sides:
    """What a ray meets of triangles: edge functions (3 edges) with slack, and planes."""

    edges: tuple[Floats, ...]
    slack: tuple[Floats, ...]
    planes: Planes

    @classmethod
    def of(cls, g: Geometry, k: Ints, origin: Floats) -> _Sides:
        a, b, c, normal = (take(v, k) for v in (g.a, g.b, g.c, g.normal))
        pairs = edge_functions(a, b, c, origin)
        return cls(tuple(edge for edge, _ in pairs), tuple(s for _, s in pairs), Planes.about(normal, a, origin))

    def inside(self, k: Ints, d: Floats, ray: Ints, sizes: Floats) -> tuple[Ints, Floats]:
        """Of pairs (triangle, ray), each (m,), those on the inside of the edges; and their edge functions."""
        size = take(sizes, ray)
        x, y, z = (take(component, ray) for component in d)
        w = np.stack([take(e[0], k) * x + take(e[1], k) * y + take(e[2], k) * z for e in self.edges])
        kept = np.flatnonzero(_one_sided(w, [take(slack, k) * size for slack in self.slack]))
        return kept, take(w, kept)


def _one_sided(w: Floats, reach: list[Floats]) -> NDArray[np.bool_]:
    """Whether all three edge functions are at least -reach, or all at most reach."""
    over = (w[0] >= -reach[0]) & (w[1] >= -reach[1]) & (w[2] >= -reach[2])
    return over | ((w[0] <= reach[0]) & (w[1] <= reach[1]) & (w[2] <= reach[2]))


def _subdivision(at: Floats) -> int:
    """Cells along a pixel's side for rays at (2, n): about one a ray, as far as there is room."""
    low = np.floor(at.min(axis=1))
    wide, high = np.floor(at.max(axis=1)) - low + 1
    row, column = np.floor(at[1] - low[1]), np.floor(at[0] - low[0])
    if not wide * high <= MAX_CELLS:
        return 1
    pixels = np.count_nonzero(np.bincount((row * wide + column).astype(np.int64)))
    return max(1, int(np.sqrt(min(at.shape[1] / pixels, MAX_CELLS / (wide * high)))))


def _distance(near: Floats) -> Floats:
    return np.divide(1.0, near, out=np.full(near.shape, np.inf), where=near > 0)


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
    """The boxes of a camera's last images, by the bytes of its place and corners."""
    return ImageBoxes.about(geometry, np.frombuffer(origin).reshape(3, 1), np.frombuffer(corners).reshape(3, 3))
