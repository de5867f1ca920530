"""Convex bodies as small lists: planar polygons and closed polyhedra, cut by planes and seen from anywhere.

Only for building: a handful of vertices each, in plain loops, once per scene and light.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.renderer.vectors import Floats

FLAT = 1e-13
"""How far from a plane, relative to the body's extent, a vertex still lies in it."""

Loop = tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Convex:
    """A convex polygon (one face) or a closed convex polyhedron.

    Parameters
    ----------
    vertices : (3, v) float64
    faces : tuple of tuple of int
        Vertices of each face, counter-clockwise from outside; a polygon's from its front.
    triangles : tuple of int
        The scene's triangles it is made of.
    """

    vertices: Floats
    faces: tuple[Loop, ...]
    triangles: tuple[int, ...]

    @property
    def is_solid(self) -> bool:
        return len(self.faces) > 1

    def planes(self) -> tuple[Floats, Floats]:
        """Outward normals (3, f), unit where a face has an area, and offsets (f,): n . p = offset on the face."""
        normals = np.array([_area_vector(self.vertices[:, list(loop)]) for loop in self.faces]).T
        normals = normals / np.maximum(np.sqrt((normals**2).sum(axis=0)), 1e-300)
        middles = np.array([self.vertices[:, list(loop)].mean(axis=1) for loop in self.faces]).T
        return normals, (normals * middles).sum(axis=0)

    def flatness(self) -> Floats:
        """How far (f,) each face's own vertices lie from its plane."""
        normals, offsets = self.planes()
        heights = normals.T @ self.vertices - offsets[:, None]
        return np.array([np.abs(heights[k, list(loop)]).max() for k, loop in enumerate(self.faces)])

    def in_front(self, normal: Floats, point: Floats) -> Convex | None:
        """The part where normal . (p - point) > 0, for a unit normal (3, 1); None where nothing is left.

        What lies in the plane to rounding is not in front of it.
        """
        size = np.abs(self.vertices).max() + np.abs(point).max()
        height = (normal * (self.vertices - point)).sum(axis=0)
        height[np.abs(height) <= 64 * 2.0**-53 * size] = 0.0
        if (height <= 0).all():
            return None
        if (height >= 0).all():
            return self
        places = [*self.vertices.T]
        made: dict[tuple[int, int], int] = {}
        faces: list[Loop] = []
        follows: dict[int, int] = {}
        for loop in self.faces:
            cut = self._cut_face(loop, height, places, made)
            if len(cut) < 3:
                continue
            faces.append(tuple(cut))
            for a, b in zip(cut, cut[1:] + cut[:1], strict=True):
                if _on_plane(a, height) and _on_plane(b, height):
                    follows[b] = a  # the cap runs the other way
        if self.is_solid and len(follows) > 2:
            faces.append(_chain(follows))
        used = sorted({k for loop in faces for k in loop})
        number = {old: new for new, old in enumerate(used)}
        renamed = tuple(tuple(number[k] for k in loop) for loop in faces)
        return Convex(np.array([places[k] for k in used]).T, renamed, self.triangles) if faces else None

    def _cut_face(
        self, loop: Loop, height: Floats, places: list[Floats], made: dict[tuple[int, int], int]
    ) -> list[int]:
        out: list[int] = []
        for a, b in zip(loop, loop[1:] + loop[:1], strict=True):
            if height[a] >= 0:
                out.append(a)
            if height[a] * height[b] < 0:
                edge = (min(a, b), max(a, b))
                if edge not in made:
                    i, j = edge
                    share = height[i] / (height[i] - height[j])
                    made[edge] = len(places)
                    places.append(places[i] + share * (places[j] - places[i]))
                out.append(made[edge])
        return out if any(k < height.size and height[k] > 0 for k in out) else []

    def faces_apart(self) -> list[Convex]:
        """Every face as a polygon of its own."""
        return [Convex(self.vertices[:, list(f)], (tuple(range(len(f))),), self.triangles) for f in self.faces]

    def silhouette(self, code: int) -> Loop:
        """The outline seen by points in front of the faces whose bits are set, clockwise from there.

        A polygon is seen from behind if its bit is not set; a solid has no outline from inside.
        """
        if not self.is_solid:
            return self.faces[0][::-1] if code else self.faces[0]
        seen = [loop for k, loop in enumerate(self.faces) if code >> k & 1]
        edges = {pair for loop in seen for pair in zip(loop, loop[1:] + loop[:1], strict=True)}
        return _chain({b: a for a, b in edges if (b, a) not in edges})


def _on_plane(k: int, height: Floats) -> bool:
    """Whether a vertex lies in the cutting plane: made by the cut, or there before."""
    return k >= height.size or height[k] == 0


def _area_vector(corners: Floats) -> Floats:
    arms = corners - corners[:, :1]
    return np.asarray(np.cross(arms[:, 1:-1], arms[:, 2:], axis=0).sum(axis=1))


def _chain(follows: dict[int, int]) -> Loop:
    """The longest closed chain of a successor map."""
    best: list[int] = []
    left = dict(follows)
    while left:
        chain = [next(iter(left))]
        while chain[-1] in left:
            chain.append(left.pop(chain[-1]))
        if len(chain) - 1 > len(best):
            best = chain[:-1]
    return tuple(best)
