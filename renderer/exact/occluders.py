"""What may stand before one light, as convex pieces whose outline any point can look up.

Each piece is cut to the light's front side once: a cone over it then holds exactly what it hides of the light. Each
is drawn towards its centre by an amount of its own, 1e-11 to 2e-11 of its size: identical pieces become nested
ones, shared edges and edges that project onto the light's come apart in one consistent order, and no tie is left to
rounding (which, undecided, costs up to a quarter of the irradiance). What it changes, relative to the unoccluded
irradiance, over 2,962 points of cornell-boxes against 40 digits: median 2e-12, 99 % 6e-11, largest 1.8e-10.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..geometry import Geometry, Ints
from ..lights import Light, QuadLight
from ..shadows import PLANE_ULPS, Blockers
from ..vectors import Floats, column, cross, dot, unit
from .convex import Convex, Loop
from .pieces import convex_pieces

Bools = NDArray[np.bool_]

SHRINK = 1e-11
GOLDEN = 0.6180339887498949


class _Outlines:
    """Outlines seen so far: rows of vertex numbers, found by piece and by the faces in front."""

    def __init__(self, pieces: tuple[Convex, ...], first: Ints, faces: int) -> None:
        self.pieces, self.first, self.faces = pieces, first, faces
        self.rows: dict[int, int] = {}
        self.table = np.zeros((0, 8), dtype=np.int64)
        self.width = np.zeros(0, dtype=np.int64)

    def find(self, key: Ints) -> Ints:
        """Row of each key, piece 2^faces + code."""
        unique, inverse = np.unique(key, return_inverse=True)
        new = [k for k in unique.tolist() if k not in self.rows]
        if new:
            self._add(new)
        rows = np.array([self.rows[k] for k in unique.tolist()], dtype=np.int64)
        return np.asarray(rows[inverse.ravel()])

    def _add(self, keys: list[int]) -> None:
        loops: list[Loop] = []
        for key in keys:
            piece, code = key >> self.faces, key & ((1 << self.faces) - 1)
            loops.append(tuple(int(self.first[piece]) + k for k in self.pieces[piece].silhouette(code)))
            self.rows[key] = len(self.rows)
        widest = max(self.table.shape[1], *(len(loop) for loop in loops))
        table = np.zeros((len(self.rows), widest), dtype=np.int64)
        table[: self.table.shape[0], : self.table.shape[1]] = self.table
        for row, loop in enumerate(loops, start=self.table.shape[0]):
            if loop:
                table[row] = loop + loop[-1:] * (widest - len(loop))  # an edge of no length clips nothing
        self.table = table
        self.width = np.r_[self.width, [_class(len(loop)) for loop in loops]]


def _class(length: int) -> int:
    """Outlines are handled together with others of about their length."""
    return length if length <= 4 else (length + 1) // 2 * 2 if length <= 8 else (length + 3) // 4 * 4


@dataclass(frozen=True, eq=False)
class Occluders:
    """Convex pieces before a light.

    Parameters
    ----------
    vertices : (3, v) float64
        Of all pieces.
    center : (3, m) float64
    radius : (m,) float64
        Balls that hold them.
    normals : (3, f, m) float64
    offsets : (f, m) float64
        Face planes; infinitely far where a piece has fewer faces.
    solid : (m,) bool
    members, first : (k,), (m,) int64
        Triangles of the pieces, one after the other, and where each piece's start.
    """

    vertices: Floats
    center: Floats
    radius: Floats
    normals: Floats
    offsets: Floats
    solid: Bools
    members: Ints
    first: Ints
    first_vertex: Ints
    outlines: _Outlines = field(repr=False)

    @property
    def count(self) -> int:
        return self.radius.size

    def among(self, blockers: Blockers) -> Ints:
        """Pieces that hold any of these triangles."""
        if self.count == 0:
            return np.empty(0, dtype=np.int64)
        chosen = np.zeros(blockers.geometry.triangles, dtype=bool)
        chosen[blockers.triangles] = True
        return np.flatnonzero(np.logical_or.reduceat(chosen[self.members], self.first))

    def outline(self, points: Floats, piece: Ints) -> tuple[Ints, Ints, Bools]:
        """Outline of one piece from each of n points.

        Returns
        -------
        row, width : (n,) int64
            Row of ``outlines.table``; its length, 0 where the point is inside the piece.
        edge_on : (n,) bool
            The point lies in the polygon's plane to rounding, and sees nothing of it.
        """
        height = dot(self.normals[:, :, piece], points[:, None]) - self.offsets[:, piece]
        size = np.abs(points).max(axis=0) + np.abs(self.center[:, piece]).max(axis=0) + self.radius[piece]
        edge_on = ~self.solid[piece] & (np.abs(height[0]) <= 4 * PLANE_ULPS * size)
        bits = 1 << np.arange(height.shape[0])
        row = self.outlines.find((piece << height.shape[0]) + bits @ (height > 0))
        return row, self.outlines.width[row], edge_on


@lru_cache(maxsize=16)
def occluders(geometry: Geometry, light: Light) -> Occluders:
    """The pieces of a scene that can stand before a light."""
    pieces = [part for piece in convex_pieces(geometry) for part in _before(piece, light)]
    pieces = [piece.shrunk(SHRINK * (1 + (k + 1) * GOLDEN % 1)) for k, piece in enumerate(pieces)]
    faces = max((len(piece.faces) for piece in pieces), default=1)
    m = len(pieces)
    normals, offsets = np.zeros((3, faces, m)), np.full((faces, m), np.inf)
    center, radius = np.zeros((3, m)), np.zeros(m)
    for k, piece in enumerate(pieces):
        normals[:, : len(piece.faces), k], offsets[: len(piece.faces), k] = piece.planes()
        center[:, k] = (piece.vertices.min(axis=1) + piece.vertices.max(axis=1)) / 2
        arm = piece.vertices - center[:, [k]]
        radius[k] = np.sqrt(dot(arm, arm).max())
    counts = np.array([len(piece.triangles) for piece in pieces], dtype=np.int64)
    sizes = np.array([piece.vertices.shape[1] for piece in pieces], dtype=np.int64)
    first_vertex = np.cumsum(sizes) - sizes
    return Occluders(
        vertices=np.hstack([np.empty((3, 0)), *(piece.vertices for piece in pieces)]),
        center=center,
        radius=radius,
        normals=normals,
        offsets=offsets,
        solid=np.array([piece.is_solid for piece in pieces], dtype=bool),
        members=np.array([t for piece in pieces for t in piece.triangles], dtype=np.int64),
        first=np.cumsum(counts) - counts,
        first_vertex=first_vertex,
        outlines=_Outlines(tuple(pieces), first_vertex, faces),
    )


def _before(piece: Convex, light: Light) -> list[Convex]:
    """The part of a piece before a light; a body that may hold the light, face by face."""
    if not isinstance(light, QuadLight):
        return [piece]
    corner, ab, ac = column(light.corner), column(light.ab), column(light.ac)
    normal = unit(-cross(unit(ab), unit(ac)))
    part = piece.in_front(normal, corner)
    if part is None:
        return []
    if piece.is_solid:
        n, offset = piece.planes()
        corners = np.hstack((corner, corner + ab, corner + ac, corner + ab + ac))
        height = dot(n[:, :, None], corners[:, None]) - offset[:, None]
        size = np.abs(piece.vertices).max() + np.abs(corners).max()
        if not (height > 1e-13 * size).all(axis=1).any():
            apart = [face.in_front(normal, corner) for face in piece.faces_apart()]
            return [face for face in apart if face is not None]
    return [part]
