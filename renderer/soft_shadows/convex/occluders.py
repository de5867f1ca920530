"""What may stand before one light, as convex pieces whose outline any point can look up.

Each piece is cut to the light's front side once: a cone over it then holds exactly what it hides of the light. On
which side of a face a point lies is decided here and once, beyond the rounding of the face's plane and of the point.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from nusselt.renderer.closed_forms.circles.pairing import columns
from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.lights import Light
from nusselt.renderer.vectors import Bools, Floats, Ints, cross, dot, unit
from nusselt.renderer.visibility.segments import Blockers
from nusselt.renderer.watertight import PLANE_ULPS

from .convex import Convex, Loop
from .convex_decomposition import convex_pieces

INSIDE, TOUCHING, BEHIND = -1, -2, -3
"""Instead of an outline's length: all is hidden; the piece's own faces hide what lies behind them; nothing is."""


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
                table[row] = loop + loop[-1:] * (widest - len(loop))  # an edge of no length bounds nothing
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
    center, half : (3, m) float64
        Middles and half sides of boxes that hold them.
    radius : (m,) float64
        Of balls about the same middles.
    normals : (3, f, m) float64
    offsets, flatness : (f, m) float64
        Face planes; infinitely far where a piece has fewer faces. How far a face's vertices lie from its plane.
    solid : (m,) bool
    members, first : (k,), (m,) int64
        Triangles of the pieces, one after the other, and where each piece's start.
    """

    vertices: Floats
    center: Floats
    half: Floats
    radius: Floats
    normals: Floats
    offsets: Floats
    flatness: Floats
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

    def outline(self, points: Floats, normal: Floats, piece: Ints) -> tuple[Ints, Ints, Bools]:
        """Outline of one piece from each of n points (3, n) with unit normals (3, n).

        Returns
        -------
        row, width : (n,) int64
            Row of ``outlines.table``; its length, or INSIDE, TOUCHING or BEHIND.
        on : (f, n) bool
            Faces in whose plane the point lies to rounding.
        """
        n = columns(self.normals, piece)
        height = dot(n, points[:, None]) - columns(self.offsets, piece)
        size = np.abs(points).max(axis=0) + np.abs(columns(self.center, piece)).max(axis=0) + self.radius[piece]
        room = 2 * PLANE_ULPS * size + columns(self.flatness, piece)
        on = np.abs(height) <= room
        agrees = dot(n, normal[:, None])
        before = height > room
        solid = self.solid[piece]
        bits = 1 << np.arange(height.shape[0])
        row = self.outlines.find(
            (piece << height.shape[0]) + bits @ np.where(solid, before | (on & (agrees > 0)), height > 0)
        )
        width = self.outlines.width[row]
        # From within: behind the point's own face nothing is seen; before a face of the other side all is hidden.
        within = solid & ~before.any(axis=0)
        against = on & (agrees < 1 - ALONG)
        width = np.where(
            within, np.where(on.any(axis=0), np.where(against.any(axis=0), TOUCHING, BEHIND), INSIDE), width
        )
        opposite = within & (on.sum(axis=0) == 1) & (on & (agrees < ALONG - 1)).any(axis=0)
        width[opposite] = INSIDE
        width[~solid & on[0]] = BEHIND
        return row, width, on


ALONG = 1e-9
"""One minus the cosine of directions that are one."""


@lru_cache(maxsize=16)
def occluders(geometry: Geometry, light: Light) -> Occluders:
    """The pieces of a scene that can stand before a light."""
    pieces = [part for piece in convex_pieces(geometry) for part in _before(piece, light)]
    faces = max((len(piece.faces) for piece in pieces), default=1)
    m = len(pieces)
    normals, offsets, flatness = np.zeros((3, faces, m)), np.full((faces, m), np.inf), np.zeros((faces, m))
    center, half, radius = np.zeros((3, m)), np.zeros((3, m)), np.zeros(m)
    for k, piece in enumerate(pieces):
        normals[:, : len(piece.faces), k], offsets[: len(piece.faces), k] = piece.planes()
        flatness[: len(piece.faces), k] = piece.flatness()
        center[:, k] = (piece.vertices.min(axis=1) + piece.vertices.max(axis=1)) / 2
        arm = piece.vertices - center[:, [k]]
        half[:, k], radius[k] = np.abs(arm).max(axis=1), np.sqrt(dot(arm, arm).max())
    counts = np.array([len(piece.triangles) for piece in pieces], dtype=np.int64)
    sizes = np.array([piece.vertices.shape[1] for piece in pieces], dtype=np.int64)
    first_vertex = np.cumsum(sizes) - sizes
    return Occluders(
        vertices=np.hstack([np.empty((3, 0)), *(piece.vertices for piece in pieces)]),
        center=center,
        half=half,
        radius=radius,
        normals=normals,
        offsets=offsets,
        flatness=flatness,
        solid=np.array([piece.is_solid for piece in pieces], dtype=bool),
        members=np.array([t for piece in pieces for t in piece.triangles], dtype=np.int64),
        first=np.cumsum(counts) - counts,
        first_vertex=first_vertex,
        outlines=_Outlines(tuple(pieces), first_vertex, faces),
    )


def _before(piece: Convex, light: Light) -> list[Convex]:
    """The part of a piece before a light; a body that may hold the light, face by face."""
    quad = light.parallelogram()
    if quad is None:
        return [piece]
    corner, ab, ac = quad.columns
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
