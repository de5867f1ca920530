"""Edges at which a surface folds, as one eye sees them: it goes on to both sides, and nothing else touches it there.

What is seen of such an edge are its two faces, or nothing; which of the two changes only where the edge passes behind
one that is no fold, for a surface that hides it goes on beyond its own folds (Appel 1967).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.geometry.ragged import BLOCK, Cells, take
from nusselt.renderer.vectors import Bools, Floats, Ints, cross, dot, unit

from .bodies import bodies, shared_sides
from .faces import Faces, apex
from .projection import Lens

FEW = 200
"""Edges below which looking for folds costs what it saves."""
PAIRS = 1 << 24
"""Pairs of an edge and a triangle that may touch, beyond which no edge is a fold."""
LARGE = 4
"""Times the median size of triangles."""
SLACK = 1e-12
"""How close, relative to the scene, touches."""
ENDS = 1e-6
"""Share of an edge at its ends where all that shares them touches it."""
SEEN = 1e-9
"""Sine of the angle from the plane through eye and edge, below which it cannot be told on which side a face lies."""


@dataclass(frozen=True, eq=False)
class Folds:
    """Some of the outline of `Faces`.

    Parameters
    ----------
    edge : (k,) int64
    face : (2, k) int64
        Faces on the left and on the right in the image, looking from start to end, where y grows downwards.
    hidden : (k,) bool
        Whether neither can be seen there.
    """

    edge: Ints
    face: Ints
    hidden: Bools

    def take(self, index: Ints) -> Folds:
        """The folds ``index`` (m,)."""
        return Folds(self.edge[index], self.face[:, index], self.hidden[index])


@dataclass(frozen=True, eq=False)
class Contacts:
    """Where the triangles of a scene touch each other.

    Parameters
    ----------
    touched : (s,) bool
        Edges that triangles touch other than the two beside them, but at their ends.
    crossed : bool
        Whether some edge may pass through a triangle.
    body : (t,) int64
        The first triangle of each triangle's body; see `bodies`.
    closed : (t,) bool
        Whether the body of that number is closed and touches itself nowhere.
    """

    touched: Bools
    crossed: bool
    body: Ints
    closed: Bools


def folds_of(geometry: Geometry, faces: Faces, lens: Lens, creased: Bools, far: Bools) -> Folds:
    """The folds among the edges of a scene's faces, without those of faces ``creased`` by some plane (p, f).

    ``far`` (t,) are triangles that cannot be seen.
    """
    edge = np.flatnonzero(faces.beside[0] >= 0)
    if edge.size < FEW:
        return Folds(edge[:0], np.zeros((2, 0), dtype=np.int64), np.zeros(0, dtype=bool))
    start, end = faces.start[:, edge] - lens.origin, faces.end[:, edge] - lens.origin
    normal = unit(cross(start, end))
    side = []
    for triangle in faces.beside[:, edge]:
        corner = apex(geometry, triangle, faces.start[:, edge], faces.end[:, edge])
        side.append(dot(normal, unit(corner - lens.origin)))
    face = faces.of_triangle[faces.beside[:, edge]]
    plain: Bools = np.asarray(~creased.any(axis=0))
    folded = (np.abs(side) > SEEN).all(axis=0) & (side[0] * side[1] < 0) & plain[face].all(axis=0)
    folded &= ~contacts(geometry, faces).touched[edge]
    if np.count_nonzero(folded) < FEW:
        folded[:] = False
    turn = np.sign(dot(cross(lens.right, lens.up), lens.look))
    swapped = side[0] * turn > 0
    hidden: Bools = np.asarray(far[faces.beside[:, edge]].all(axis=0))
    return Folds(edge, np.where(swapped, face[::-1], face), hidden).take(np.flatnonzero(folded))


@lru_cache(maxsize=2)
def contacts(geometry: Geometry, faces: Faces) -> Contacts:
    """What touches the edges of a scene's faces."""
    touched, crossed = np.zeros(faces.start.shape[1], dtype=bool), False
    first, second, odd = shared_sides(faces.vertex)
    body, closed = bodies(first, second, geometry.triangles), np.ones(geometry.triangles, dtype=bool)
    closed[body[odd]] = False
    slack = SLACK * max(float(np.abs(v).max(initial=0)) for v in (geometry.a, geometry.b, geometry.c))
    for pairs in _near(geometry, faces, slack):
        if pairs is None:
            return Contacts(np.ones_like(touched), True, body, np.zeros_like(closed))
        edge, triangle = pairs
        other = np.flatnonzero((triangle != faces.beside[0, edge]) & (triangle != faces.beside[1, edge]))
        edge, triangle = edge[other], triangle[other]
        met, through = _touching(geometry, faces, edge, triangle, slack)
        edge, own = edge[met], body[triangle[met]]
        touched[edge] = True
        closed[own[body[faces.beside[0, edge]] == own]] = False
        crossed |= bool(through.any())
    for index in range(geometry.disks):
        normal, centre = geometry.disk_normal[:, [index]], geometry.disk_center[:, [index]]
        height = np.abs([dot(normal, at - centre) for at in (faces.start, faces.end)])
        touched |= height.max(axis=0) <= slack
    return Contacts(touched, crossed, body, closed)


def _near(g: Geometry, faces: Faces, slack: float) -> Iterator[tuple[Ints, Ints] | None]:
    """Pairs of an edge and a triangle whose boxes meet, block by block; None where there are too many.

    Small triangles are looked up by their middles in two of the three dimensions, large ones one by one.
    """
    corners = np.stack((g.a, g.b, g.c))
    low, high = corners.min(axis=0) - slack, corners.max(axis=0) + slack
    first, last = np.minimum(faces.start, faces.end), np.maximum(faces.start, faces.end)
    size = (high - low).max(axis=0)
    is_small = size <= LARGE * np.median(size)
    order = np.argsort(np.ptp(corners, axis=(0, 2)), kind="stable")[::-1]  # along which they spread most

    def meeting(edge: Ints, triangle: Ints) -> tuple[Ints, Ints]:
        for axis in order[::-1]:
            apart = take(low[axis], triangle) > take(last[axis], edge)
            apart |= take(high[axis], triangle) < take(first[axis], edge)
            edge, triangle = edge[~apart], triangle[~apart]
        return edge, triangle

    small, large = np.flatnonzero(is_small), np.flatnonzero(~is_small)
    edges, step = faces.start.shape[1], max(1, BLOCK // max(faces.start.shape[1], 1))
    pairs = large.size * edges
    for begin in range(0, large.size if pairs <= PAIRS else 0, step):
        some = large[begin : begin + step]
        yield meeting(np.tile(np.arange(edges), some.size), np.repeat(some, edges))
    middle, reach = (low + high)[:, small] / 2, float(size[small].max()) / 2
    x, y, _ = order
    cells = Cells.of(middle[x] / reach, middle[y] / reach)
    if cells is None or pairs > PAIRS:
        yield None
        return
    bounds = (v / reach for v in (first[x] - reach, last[x] + reach, first[y] - reach, last[y] + reach))
    for edge, which in cells.in_boxes(*bounds):
        pairs += edge.size
        yield meeting(edge, small[which]) if pairs <= PAIRS else None


def _touching(g: Geometry, faces: Faces, edge: Ints, triangle: Ints, slack: float) -> tuple[Ints, Bools]:
    """Which of those pairs touch (m,), and whether the edge does not lie in the triangle's plane."""
    start, end = take(faces.start, edge), take(faces.end, edge)
    normal, a = unit(take(g.normal, triangle)), take(g.a, triangle)
    height, rise = dot(normal, start - a), dot(normal, end - start)
    low, high = np.full(edge.size, ENDS), np.full(edge.size, 1 - ENDS)
    for sign in (1, -1):
        low, high = clipped(low, high, slack + sign * height, sign * rise)
    k = np.flatnonzero(low <= high)
    low, high, start, end, normal, triangle = low[k], high[k], start[:, k], end[:, k], normal[:, k], triangle[k]
    corners = [take(v, triangle) for v in (g.a, g.b, g.c)]
    for corner, after in zip(corners, (*corners[1:], corners[0]), strict=True):
        inwards = unit(cross(normal, after - corner))
        low, high = clipped(low, high, slack + dot(inwards, start - corner), dot(inwards, end - start))
    k = k[low <= high]
    return k, (np.abs(height[k]) > slack) | (np.abs(height[k] + rise[k]) > slack)


def clipped(low: Floats, high: Floats, value: Floats, slope: Floats) -> tuple[Floats, Floats]:
    """The part of [low, high] where value + t slope is not below 0; high < low where there is none."""
    root = -value / np.where(slope == 0, 1.0, slope)
    low = np.where(slope > 0, np.maximum(low, root), low)
    high = np.where(slope < 0, np.minimum(high, root), high)
    return low, np.where((slope == 0) & (value < 0), -1.0, high)
