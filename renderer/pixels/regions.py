"""Which region of the scene is seen at a point of the image, and where its surface is.

A region is where radiance is smooth but for visibility: a face or an ellipsoid, on one side of each light's
own plane. Rays through one block of the image look only at the triangles of that block.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.camera.edge_functions import Pencil
from nusselt.renderer.camera.first_hits import Seen, ellipsoid_distance, hits_at, nearer_disks
from nusselt.renderer.camera.screen_boxes import ImageBoxes
from nusselt.renderer.camera.view import shading_points
from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.lights import Light
from nusselt.renderer.scene import Scene
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats, Ints, dot, unit

from .candidate_edges import light_planes
from .faces import Faces, find_faces
from .far_sides import far_sides
from .folds import SLACK
from .projection import Lens

BLOCKS = (128, 64, 32, 16)
"""Pixels a side of the blocks whose triangles are looked up; small ones only where there are many triangles."""
MANY = 200
"""Triangles from which on small blocks are looked up, and what closed bodies hide by themselves."""
FEW = 1 << 19
"""Pairs of a ray and a triangle that cost less than the looking up."""
BIG = 1024
"""Triangles beyond which rays are sorted into pixels instead."""
NOTHING = -1
MOST_PLANES = 16
"""Lights whose planes crease surfaces; further ones are left to refinement."""


@dataclass(frozen=True, eq=False)
class Regions:
    """The regions of a scene as one camera sees them.

    Region = surface + surfaces x sides; a surface is a face, an ellipsoid or a disk, numbered in this order; bit k of
    ``sides`` tells the side of light plane k, for the surfaces that it cuts.
    """

    geometry: Geometry
    faces: Faces
    lens: Lens
    pencil: Pencil
    planes: list[tuple[Floats, Floats]]

    @classmethod
    def of(cls, scene: Scene, geometry: Geometry, lights: tuple[Light, ...]) -> Regions:
        """The regions of a scene; ``lights`` are those that light something."""
        lens = Lens.of(scene)
        planes = light_planes(lights)[:MOST_PLANES]
        return cls(geometry, find_faces(geometry), lens, Pencil.about(geometry, lens.origin), planes)

    @property
    def surfaces(self) -> int:
        return self.faces.count + self.geometry.ellipsoids + self.geometry.disks

    @cached_property
    def creased(self) -> NDArray[np.bool_]:
        """Which plane cuts which surface, (planes, surfaces)."""
        g, found = self.geometry, np.zeros((len(self.planes), self.surfaces), dtype=bool)
        for row, (normal, point) in enumerate(self.planes):
            away = [corner - point for corner in (g.a, g.b, g.c)]
            height = np.stack([dot(normal, corner) for corner in away])
            low, high = np.full(self.faces.count, np.inf), np.full(self.faces.count, -np.inf)
            np.minimum.at(low, self.faces.of_triangle, height.min(axis=0, initial=np.inf))
            np.maximum.at(high, self.faces.of_triangle, height.max(axis=0, initial=-np.inf))
            slack = SLACK * float(np.abs(away).max(initial=0))  # a light may lie in a face
            found[row, : self.faces.count] = (low < -slack) & (high > slack)
            found[row, self.faces.count : self.surfaces - g.disks] = True  # disks do not reflect: no crease shows
        return found

    @cached_property
    def _blocks(self) -> dict[tuple[int, int, int], Ints]:
        return {}

    def _candidates(self, level: int, row: int, column: int) -> Ints:
        """Triangles seen in a block, found once, among those of the block around it."""
        key = level, row, column
        if key not in self._blocks:
            x, y, size = np.array([0, 1, 0, 1]), np.array([0, 0, 1, 1]), BLOCKS[level]
            corners = self.lens.directions((column + x) * size + 0.02 * (x - 0.5), (row + y) * size + 0.02 * (y - 0.5))
            among = self._candidates(level - 1, row // 2, column // 2) if level else self._live
            self._blocks[key] = self.pencil.in_tile(corners, among)
        return self._blocks[key]

    def seen(self, x: Floats, y: Floats) -> Ints:
        """Regions (n,) at image points (n,); NOTHING where there is none."""
        d = self.lens.directions(x, y)
        distance, triangle = self._nearest_triangles(x, y, d)
        surface = np.where(triangle >= 0, self.faces.of_triangle[triangle] if self.faces.count else -1, NOTHING)
        if self.geometry.disks:
            near, disk = nearer_disks(self.geometry, self.lens.origin, d, 1 / distance, triangle)
            distance = np.where(disk < 0, distance, 1 / np.where(disk < 0, 1.0, near))
            surface = np.where(disk < 0, surface, self.surfaces - self.geometry.disks + disk)
        for index in range(self.geometry.ellipsoids):
            t = ellipsoid_distance(self.geometry, index, self.lens.origin, d)
            nearer = t < distance  # the very comparison of `camera.first_hits`: of what ties the triangle is seen
            distance = np.where(nearer, t, distance)
            surface[nearer] = self.faces.count + index
        return self._sided(surface, d, distance)

    @cached_property
    def shadow_edges(self) -> dict[Light, tuple[Floats, Floats]]:
        """What may throw a light's shadow, as far as it was asked for; see `doubt`."""
        return {}

    @cached_property
    def radii(self) -> Floats:
        """Radius (r,) of each surface: what is seen from its edge has a footprint no larger; see `doubt`."""
        g, faces = self.geometry, self.faces
        low, high = np.full((3, faces.count), np.inf), np.full((3, faces.count), -np.inf)
        for corner in (g.a, g.b, g.c):
            for least, most, value in zip(low, high, corner, strict=True):
                np.minimum.at(least, faces.of_triangle, value)
                np.maximum.at(most, faces.of_triangle, value)
        flat, round_ = np.sqrt(dot(high - low, high - low)) / 2, np.sqrt((g.axes**2).sum(axis=(1, 2)))
        return np.concatenate((flat, round_, g.disk_radius))

    @cached_property
    def far(self) -> NDArray[np.bool_]:
        """Triangles (t,) that closed bodies hide by themselves; looked for where there are many."""
        if self.geometry.triangles < MANY:
            return np.zeros(self.geometry.triangles, dtype=bool)
        return far_sides(self.geometry, self.faces, self.lens.origin, self.pencil.planes)

    @cached_property
    def _live(self) -> Ints:
        return np.flatnonzero(self.pencil.live & ~self.far)

    @cached_property
    def _boxes(self) -> ImageBoxes:
        corners = self.lens.directions(np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]))
        boxes = ImageBoxes.about(self.geometry, self.lens.origin, corners)
        return replace(boxes, live=boxes.live & ~self.far)

    def _nearest_triangles(self, x: Floats, y: Floats, d: Floats) -> tuple[Floats, Ints]:
        if self.geometry.triangles > BIG:
            distance, triangle, _ = self._boxes.nearest(d)
            return distance, triangle
        if self.geometry.triangles * x.size <= FEW:
            near, triangle = self.pencil.nearest(d, self._live)
            return np.divide(1, near, out=np.full(x.size, np.inf), where=near > 0), triangle
        level = 1 if self.geometry.triangles < MANY else len(BLOCKS) - 1
        size = BLOCKS[level]
        across = -(-self.lens.width // size)
        column = np.clip(x // size, 0, across - 1)
        row = np.clip(y // size, 0, -(-self.lens.height // size) - 1)
        block = (row * across + column).astype(np.int64)
        order = np.argsort(block, kind="stable")
        bounds = np.flatnonzero(np.diff(block[order], prepend=-1, append=-1))
        near, triangle = np.zeros(x.size), np.full(x.size, -1)
        for first, last in pairwise(bounds):
            here = order[first:last]
            chosen = self._candidates(level, *divmod(int(block[here[0]]), across))
            near[here], triangle[here] = self.pencil.nearest(d[:, here], chosen)
        return np.divide(1, near, out=np.full(x.size, np.inf), where=near > 0), triangle

    def _sided(self, surface: Ints, d: Floats, distance: Floats) -> Ints:
        region = surface.copy()
        for row, (normal, point) in enumerate(self.planes):
            mine = np.flatnonzero((surface >= 0) & self.creased[row, surface])
            height = dot(normal, self.lens.origin - point) + dot(normal, d[:, mine]) * distance[mine]
            region[mine] += self.surfaces * ((height > 0).astype(np.int64) << row)
        return region

    def points(self, x: Floats, y: Floats, region: Ints) -> ShadingPoints:
        """Points of given regions' surfaces at image points, whatever stands before them.

        A face or a disk is as wide as its plane; an ellipsoid that is missed by a hair is touched.
        """
        d = self.lens.directions(x, y)
        surface = region % self.surfaces
        flat = surface < self.faces.count
        triangle = np.where(flat, self.faces.triangle[np.where(flat, surface, 0)] if self.faces.count else -1, -1)
        round_ = ~flat & (surface < self.surfaces - self.geometry.disks)
        ellipsoid = np.where(round_, surface - self.faces.count, -1)
        disk = np.where(flat | round_, -1, surface - self.surfaces + self.geometry.disks)
        distance = np.full(x.size, np.inf)
        for index in range(self.geometry.ellipsoids):
            mine = np.flatnonzero(ellipsoid == index)
            distance[mine] = ellipsoid_distance(self.geometry, index, self.lens.origin, d[:, mine], certain=True)
        weight = self.pencil.weights(d, triangle) if self.geometry.triangles else np.zeros_like(d)
        seen = Seen(triangle, weight, disk, ellipsoid, distance)
        hits = hits_at(self.geometry, self.lens.origin, d, seen)
        return shading_points(self.geometry, hits, -unit(d), np.arange(x.size))
