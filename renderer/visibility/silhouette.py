"""Which points a closed surface hides from one point of a light, from its silhouette alone.

Seen from a point y, the silhouette (edges between a face turned to y and one turned away) bounds the faces
turned to y. Its winding number around a direction is how many of those the ray along it meets: zero, and
nothing is in the way. A few thousand edges stand for 100,000 triangles.

The winding number is found once at the centre of each cell of a grid over the silhouette; a receiver differs
from its cell's centre by the edges between the two, so that one in a cell without edges costs a look-up.

It counts what lies behind the receiver too. Where the surface's bounding box lies wholly before the receiver
that is nothing; any other receiver with a winding number above zero is left to a search along its ray.

Edges are projected vertex by vertex, so that they meet exactly; a receiver within rounding (1e-15 of the
silhouette's size) of an edge may fall on either side.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.geometry.closed_surfaces import Surface, closed_surface
from nusselt.renderer.geometry.ragged import expand, take
from nusselt.renderer.vectors import Floats, Ints, column, cross, dot, frame, unit

CELLS = 256
"""Cells along a side of the grid, at most."""


@dataclass(frozen=True, eq=False)
class Outline:
    """The edges of a surface that may be on its silhouette, seen from somewhere on a light.

    Parameters
    ----------
    axes : (3, 3) float64
        Rows: two across, and the direction from the light to the surface.
    start, end : (3, e) float64
        Ends of each edge, in the direction of the left face's winding.
    plane : (4, f) float64
        Planes of the faces beside them: n and n . a, the front where n . y > n . a.
    left, right : (e,) int64
        The faces on both sides, among those.
    """

    axes: Floats
    start: Floats
    end: Floats
    plane: Floats
    left: Ints
    right: Ints


@lru_cache(maxsize=4)
def surface_of(geometry: Geometry, triangles: bytes) -> tuple[Surface | None, str]:
    """The closed surface of some triangles of a scene (int64 as bytes), or why it is not one."""
    k = np.frombuffer(triangles, dtype=np.int64)
    return closed_surface(*(take(v, k) for v in (geometry.a, geometry.b, geometry.c)))


def outline(surface: Surface, light: Floats, at_infinity: bool) -> Outline | None:
    """What can be a silhouette edge from some point of the convex hull of ``light`` (3, m).

    A face in front of all the hull's points, or behind all of them, is so for every point of the light.
    None if the surface does not lie wholly on one side of the light's points along any one direction.
    """
    centre = surface.vertices.mean(axis=1, keepdims=True)
    along = unit(-light.mean(axis=1, keepdims=True) if at_infinity else centre - light.mean(axis=1, keepdims=True))
    x, y = frame(along[:, 0])
    axes = np.stack((x, y, along[:, 0]))
    if not at_infinity:
        depth = (along * (surface.vertices - centre)).sum(axis=0).min()
        if depth + ((along * (centre - light)).sum(axis=0)).min() <= 1e-6 * np.abs(centre - light).max():
            return None
    a, b, c = (take(surface.vertices, corner) for corner in surface.triangles)
    normal = cross(b - a, c - a)
    offset = np.zeros(normal.shape[1]) if at_infinity else dot(normal, a)
    height = np.stack([dot(normal, column(point)) - offset for point in light.T])
    slack = 1e-14 * np.abs(normal).sum(axis=0) * (np.abs(a).max() + np.abs(light).max())
    front, back = (height > slack).all(axis=0), (height < -slack).all(axis=0)
    left, right = surface.left, surface.right
    k = np.flatnonzero(~((front[left] & front[right]) | (back[left] & back[right])))
    faces, place = np.unique(np.concatenate((left[k], right[k])), return_inverse=True)
    start, end = (take(surface.vertices, vertex[k]) for vertex in surface.edges)
    plane = np.vstack((normal[:, faces], offset[None, faces]))
    return Outline(axes, start, end, plane, place[: k.size], place[k.size :])


@dataclass(frozen=True, eq=False)
class Silhouette:
    """A surface's silhouette from one point, in the plane across the outline's direction.

    Parameters
    ----------
    x0, y0, x1, y1 : (e,) float64
        Edges, in cells; the faces turned to the eye on the right.
    low : (2,) float64
        Corner of the grid.
    scale : (2,) float64
        Cells per length.
    size : int
        Cells along a side.
    winding : (size, size) int64
        At the cells' centres, row by row.
    start, edges : (size^2 + 1,), (m,) int64
        Edges that touch each cell: ``edges[start[i]:start[i + 1]]``.
    """

    x0: Floats
    y0: Floats
    x1: Floats
    y1: Floats
    low: Floats
    scale: Floats
    size: int
    winding: Ints
    start: Ints
    edges: Ints


def project(outline: Outline, points: Floats, eye: Floats, at_infinity: bool) -> tuple[Floats, Floats, Floats]:
    """Coordinates across the outline's direction, and depth along it, of points seen from ``eye`` (3, 1)."""
    p = points if at_infinity else points - eye
    x, y, depth = (dot(row[:, None], p) for row in outline.axes)
    if at_infinity:
        # Along the light's direction onto the plane across the axis.
        slope = np.array([dot(row[:, None], eye)[0] for row in outline.axes])
        return x - depth * (slope[0] / slope[2]), y - depth * (slope[1] / slope[2]), depth
    with np.errstate(divide="ignore", invalid="ignore"):
        return x / depth, y / depth, depth


def silhouette(outline: Outline, eye: Floats, at_infinity: bool) -> Silhouette | None:
    """The silhouette from ``eye`` (3, 1), a point of the light or a direction to it; None if it is empty."""
    turned = ((outline.plane[:3].T @ eye)[:, 0] > outline.plane[3]).view(np.int8)
    sign = take(turned, outline.left) - take(turned, outline.right)
    k = np.flatnonzero(sign)
    if k.size == 0:
        return None
    back = take(sign, k) < 0
    start, end = take(outline.start, k), take(outline.end, k)
    start, end = np.where(back, end, start), np.where(back, start, end)
    (x0, y0, _), (x1, y1, _) = (project(outline, ends, eye, at_infinity) for ends in (start, end))
    size = int(np.clip(4 * np.sqrt(k.size), 8, CELLS))
    low = np.array([min(x0.min(), x1.min()), min(y0.min(), y1.min())])
    side = np.array([max(x0.max(), x1.max()), max(y0.max(), y1.max())]) - low
    scale = size * (1 - 1e-9) / np.where(side > 0, side, 1.0)
    x0, x1 = (x0 - low[0]) * scale[0], (x1 - low[0]) * scale[0]
    y0, y1 = (y0 - low[1]) * scale[1], (y1 - low[1]) * scale[1]
    start_, edges = _edges_in_cells(x0, y0, x1, y1, size)
    return Silhouette(x0, y0, x1, y1, low, scale, size, _at_centres(x0, y0, x1, y1, size), start_, edges)


def _at_centres(x0: Floats, y0: Floats, x1: Floats, y1: Floats, size: int) -> Ints:
    """Winding numbers at cell centres: edges that cross the line through a row's centres, summed along it."""
    up = y1 > y0
    low, high = np.where(up, y0, y1), np.where(up, y1, y0)
    first = np.ceil(low - 0.5).astype(np.int64)
    edge, number = expand(np.ceil(high - 0.5).astype(np.int64) - first)
    row = first[edge] + number
    at = x0[edge] + (row + 0.5 - y0[edge]) * ((x1 - x0)[edge] / (y1 - y0)[edge])
    column_ = np.clip(np.ceil(at - 0.5), 0, size).astype(np.int64)
    # The plane is seen from behind: what an edge goes round lies to its right.
    turns = np.bincount(row * (size + 1) + column_, np.where(up[edge], 1.0, -1.0), minlength=size * (size + 1))
    return np.rint(np.cumsum(turns.reshape(size, size + 1), axis=1)[:, :size]).astype(np.int64).ravel()


def _edges_in_cells(x0: Floats, y0: Floats, x1: Floats, y1: Floats, size: int) -> tuple[Ints, Ints]:
    """For each cell the edges whose boxes touch it."""
    left, right = (np.clip(f(x0, x1), 0, size - 1).astype(np.int64) for f in (np.minimum, np.maximum))
    low, high = (np.clip(f(y0, y1), 0, size - 1).astype(np.int64) for f in (np.minimum, np.maximum))
    wide = right - left + 1
    edge, number = expand(wide * (high - low + 1))
    row = number // wide[edge]
    cell = (low[edge] + row) * size + left[edge] + number - row * wide[edge]
    narrow = cell.astype(np.uint16) if size * size <= 1 << 16 else cell  # two bytes are sorted by radix
    start = np.concatenate(([0], np.cumsum(np.bincount(cell, minlength=size * size))))
    return start, edge[np.argsort(narrow, kind="stable")]


def winding(s: Silhouette, x: Floats, y: Floats) -> Ints:
    """Winding number of the silhouette around points of its plane, each (n,)."""
    px, py = (x - s.low[0]) * s.scale[0], (y - s.low[1]) * s.scale[1]
    found = np.zeros(px.size, dtype=np.int64)
    inside = np.flatnonzero((px >= 0) & (px < s.size) & (py >= 0) & (py < s.size))
    px, py = take(px, inside), take(py, inside)
    cx, cy = np.floor(px), np.floor(py)
    cell = (cy * s.size + cx).astype(np.int64)
    value = take(s.winding, cell)
    first = take(s.start, cell)
    count = take(s.start, cell + 1) - first
    near = np.flatnonzero(count)
    if near.size:
        owner, number = expand(take(count, near))
        edge = take(s.edges, take(take(first, near), owner) + number)
        point = take(near, owner)
        turns = _crossed(s, edge, take(px, point), take(py, point), take(cx, point) + 0.5, take(cy, point) + 0.5)
        value = value + np.rint(np.bincount(point, turns, minlength=value.size)).astype(np.int64)
    found[inside] = value
    return found


def _crossed(s: Silhouette, edge: Ints, px: Floats, py: Floats, qx: Floats, qy: Floats) -> Floats:
    """What changes from q, the centre, to p: +1 for an edge crossed to its right, -1 to its left.

    From q along x first, then along y: on which side of a line an edge's end lies is then a comparison, the
    same for both edges that meet there, and no vertex is passed twice or not at all.
    """
    ax, ay, bx, by = (take(v, edge) for v in (s.x0, s.y0, s.x1, s.y1))
    with np.errstate(divide="ignore", invalid="ignore"):
        x = ax + (qy - ay) * ((bx - ax) / (by - ay))
        y = ay + (px - ax) * ((by - ay) / (bx - ax))
    # From (qx, qy) to (px, qy): edges that cross the height qy between qx and px.
    up, down = (ay <= qy) & (by > qy), (ay > qy) & (by <= qy)
    right, left = (x > qx) & (x <= px), (x > px) & (x <= qx)
    turns = ((up & right) | (down & left)) * 1.0 - ((up & left) | (down & right))
    # From (px, qy) to (px, py): edges that cross px between the two heights.
    east, west = (ax <= px) & (bx > px), (ax > px) & (bx <= px)
    above, below = (y > qy) & (y <= py), (y > py) & (y <= qy)
    turns += ((east & below) | (west & above)) * 1.0 - ((east & above) | (west & below))
    return np.asarray(turns)
