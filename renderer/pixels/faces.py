"""The pieces of plane a scene's triangles make up, and the edges between them.

Triangles of one surface in one plane are one face: light varies smoothly over it, so no line needs to be drawn
inside. Planes are told apart by rounding; where that parts two that are one, a line too many is drawn, and
nothing is wrong.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.geometry.ragged import take
from nusselt.renderer.vectors import Floats, Ints, alike, dot, unit

PLANE = 1e-8
"""Planes closer than this (unit normals; offsets relative to the scene) are one."""


@dataclass(frozen=True, eq=False)
class Faces:
    """Flat faces.

    Parameters
    ----------
    of_triangle : (t,) int64
        Face of each triangle.
    triangle : (f,) int64
        A triangle of each face.
    start, end : (3, s) float64
        Edges that bound faces, each once.
    beside : (2, s) int64
        Triangles of the two faces that meet there; -1 where another number of faces does.
    vertex : (3, t) int64
        Numbers of the triangles' corners: one for those in one place.
    """

    of_triangle: Ints
    triangle: Ints
    start: Floats
    end: Floats
    beside: Ints
    vertex: Ints

    @property
    def count(self) -> int:
        return int(self.triangle.size)


def find_faces(geometry: Geometry) -> Faces:
    """Group triangles into faces and list the edges between them."""
    g = geometry
    if g.triangles == 0:
        ends, numbers = np.zeros((3, 0)), np.zeros((3, 0), dtype=np.int64)
        return Faces(numbers[0], numbers[0], ends, ends, numbers[:2], numbers)
    planes = plane_keys(unit(g.normal), g.a - g.a.mean(axis=1, keepdims=True))
    first, face, _ = alike(np.vstack((planes, g.triangle_surface)))
    return Faces(face, first, *_outline(g, face))


def plane_keys(normal: Floats, position: Floats) -> Floats:
    """Whole numbers (4, n), the same for planes that are one: those through places (3, n) with unit normals."""
    size = max(float(np.abs(position).max()), np.finfo(float).tiny)
    return np.rint(np.vstack((normal, dot(normal, position) / size)) / PLANE + 0.1234)


def apex(g: Geometry, triangle: Ints, start: Floats, end: Floats) -> Floats:
    """The corner (3, s) of each triangle that is not an end of its edge."""
    found = take(g.a, triangle)
    for corner in (g.b, g.c):
        on_edge = (found == start).all(axis=0) | (found == end).all(axis=0)
        found = np.where(on_edge, take(corner, triangle), found)
    return found


def _outline(g: Geometry, face: Ints) -> tuple[Floats, Floats, Ints, Ints]:
    """Triangle edges without those inside a face, and without repeats; the triangles beside each; all corners."""
    corners = np.hstack((g.a, g.b, g.c))
    _, vertex, _ = alike(corners)
    vertex = vertex.reshape(3, -1)
    a, b, c = vertex
    ends = np.sort(np.stack((np.hstack((a, b, c)), np.hstack((b, c, a)))), axis=0)
    owner = np.tile(face, 3)
    position = np.empty((3, int(vertex.max()) + 1))
    position[:, vertex.reshape(-1)] = corners
    at, _, count = alike(np.vstack((ends, owner)))
    outer = at[count == 1]  # twice in one face: inside it
    first, _, count = alike(ends[:, outer])
    bounds, triangle = ends[:, outer[first]], outer % face.size
    beside = np.stack((triangle[first], triangle[np.minimum(first + 1, triangle.size - 1)]))
    return position[:, bounds[0]], position[:, bounds[1]], np.where(count == 2, beside, -1), vertex
