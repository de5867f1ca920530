"""What the centres of pixels show: surfaces of all, shading points of those that are asked for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.renderer.camera.first_hits import Seen, hits_at, nearest_surfaces, origin_in
from nusselt.renderer.camera.rays import pixel_centres, pixel_corners, primary_directions
from nusselt.renderer.camera.view import shading_points_seen
from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.geometry.ragged import take
from nusselt.renderer.lights import around
from nusselt.renderer.scene import Scene
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Bools, Floats, Ints, alike, column, dot, unit

from .faces import plane_keys

SPAN = 7 * 7
"""Pixels of the least square between whose 4 x 4 nodes something is interpolated."""


@dataclass(frozen=True, eq=False)
class CentreView:
    """Camera rays through all pixel centres, row by row, and what they meet.

    Parameters
    ----------
    scene : Scene
    geometry : Geometry
    seen : Seen
    surface : (n,) int64
        Row of the surface tables, -1 where nothing is met.
    emission : (3, n) float64
        Radiance seen directly.
    background, emitter, back, reflects : (n,) bool
        See `camera.view.View`; reflects: is to be shaded.
    """

    scene: Scene
    geometry: Geometry
    seen: Seen
    surface: Ints
    emission: Floats
    background: Bools
    emitter: Bools
    back: Bools
    reflects: Bools

    @classmethod
    def of(cls, scene: Scene, geometry: Geometry) -> CentreView:
        """What the camera of a scene near the origin sees."""
        x, y = pixel_centres(range(scene.width), range(scene.height))
        corners = pixel_corners(scene)
        eye, d = column(scene.camera.position), primary_directions(scene, x, y)
        found = nearest_surfaces(geometry, eye, d, corners)
        row = np.where(found.ellipsoid >= 0, geometry.triangles + found.ellipsoid, found.triangle)
        row = np.where(found.disk >= 0, geometry.triangles + geometry.ellipsoids + found.disk, row)
        surface, front = _sides(geometry, eye)
        row = np.where(row < 0, surface.size, row)  # nothing comes last
        emitter, faced, sky = geometry.light[surface] >= 0, front | scene.two_sided, around(scene.lights)
        seen = np.where(front, geometry.emission[:, surface], 0.0)
        emission = take(np.hstack((seen, np.zeros((3, 1)) if sky is None else sky)), row)
        kinds = (take(np.append(kind, False), row) for kind in (emitter, ~emitter & ~faced, ~emitter & faced))
        return cls(scene, geometry, found, take(np.append(surface, -1), row), emission, row == surface.size, *kinds)

    def points(self, index: Ints) -> ShadingPoints:
        """Shading points (k,) of pixels that reflect."""
        row, across = np.divmod(index, self.scene.width)
        eye, d = column(self.scene.camera.position), primary_directions(self.scene, across + 0.5, row + 0.5)
        hits = hits_at(self.geometry, eye, d, self.seen.take(index))
        return shading_points_seen(self.geometry, eye, hits, -unit(d), np.arange(index.size))

    def planes(self) -> Ints:
        """A number (n,) for each plane of each surface that reflects; -1 for pixels that do not."""
        found, k = np.full(self.reflects.size, -1), np.flatnonzero(self.reflects)
        if k.size == 0:
            return found
        one, of = _standing_for(self.seen.triangle[k])
        points, surface = self.points(k[one]), self.surface[k[one]]
        _, number, _ = alike(np.vstack((plane_keys(points.normal, points.position), surface)))
        found[k] = number[of]
        return found


def _sides(g: Geometry, eye: Floats) -> tuple[Ints, Bools]:
    """Of triangles, ellipsoids and disks, in this order: their surface, and whether the eye (3, 1) is before them."""
    outside = np.array([origin_in(g, index, eye)[1] > 0 for index in range(g.ellipsoids)], dtype=bool)
    before = dot(g.normal, eye - g.a) > 0, outside, dot(g.disk_normal, eye - g.disk_center) > 0
    return np.concatenate((g.triangle_surface, g.ellipsoid_surface, g.disk_surface)), np.concatenate(before)


def _standing_for(triangle: Ints) -> tuple[Ints, Ints]:
    """One hit (m,) of each of the triangles (n,), and every one of none (-1); and which of those stands for each."""
    most = int(triangle.max()) + 1
    group = np.where(triangle >= 0, triangle, np.arange(most, most + triangle.size))
    stands = np.full(most + triangle.size, -1)
    stands[group] = np.arange(triangle.size)
    some = np.flatnonzero(stands >= 0)
    one = stands[some]
    stands[some] = np.arange(some.size)
    return one, stands[group]


def on_small_planes(plane: Ints) -> Ints:
    """Pixels (k,) of planes (n,) that are seen in so few that nothing can be interpolated; see `CentreView.planes`."""
    count = np.bincount(plane[plane >= 0], minlength=1)
    return np.flatnonzero((plane >= 0) & (count[plane] < SPAN))
