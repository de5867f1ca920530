"""Means over pixels of what many small faces reflect if nothing blocks: by each face's share of the pixel.

A face's part of a pixel is the area between its upper and lower edges, both cut off at the pixel's sides: of each
edge the area below it, and that area's moments, are sums over at most three straight bits. Where parts add up to the
pixel no face is before another, but for what lies in front of them all.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.renderer.camera.first_hits import Hits
from nusselt.renderer.camera.rays import pixel_corners, primary_directions
from nusselt.renderer.camera.screen_boxes import kept_boxes
from nusselt.renderer.camera.view import shading_points
from nusselt.renderer.estimators.analytic import without_shadows
from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.geometry.ragged import Cells, take
from nusselt.renderer.lobes import Lambert
from nusselt.renderer.needs import Needs
from nusselt.renderer.radiance import reflected
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats, Ints, column, distinct, dot, transform, unit
from nusselt.renderer.visibility.segments import small_triangles

LEAST = 1e-9
"""Of a pixel: smaller parts are none, and what parts may lack of all of it."""
AT_ONCE = 1 << 16
"""Parts shaded together."""


@dataclass(frozen=True, eq=False)
class Parts:
    """Parts of pixels that faces turned to the camera would show if nothing were before them.

    Parameters
    ----------
    pixel : (p,) int64
        Index among those asked.
    triangle : (p,) int64
    area : (p,) float64
        Of the pixel.
    x, y : (p,) float64
        Centroids in the image, in pixels.
    """

    pixel: Ints
    triangle: Ints
    area: Floats
    x: Floats
    y: Floats

    def take(self, index: Ints) -> Parts:
        """Those of ``index`` (k,)."""
        return Parts(self.pixel[index], self.triangle[index], self.area[index], self.x[index], self.y[index])


def parts_of(scene: Scene, geometry: Geometry, pixel: Ints) -> Parts:
    """Parts of pixels (n,) by the scene's small triangles; none where the camera may be among these."""
    tree, nothing = small_triangles(geometry), np.zeros(0, dtype=np.int64)
    none = Parts(nothing, nothing, *np.zeros((3, 0)))
    eye = column(scene.camera.position)
    corners = pixel_corners(scene)
    seen = kept_boxes(geometry, eye.tobytes(), corners.tobytes())
    if tree is None or seen.rows is None or pixel.size == 0 or (np.abs(eye - tree.centre) <= tree.half).all():
        return none
    row, across = np.divmod(pixel, scene.width)
    cells = Cells.of(across + 0.5, row + 0.5)
    mine = tree.triangles.astype(np.int64)
    ahead = np.isfinite(seen.boxes[:, mine]).all(axis=0) & seen.live[mine]
    mine = mine[ahead & (dot(take(geometry.normal, mine), eye - take(geometry.a, mine)) > 0)]
    if cells is None or mine.size == 0:
        return none
    ends = []
    for corner in (geometry.a, geometry.b, geometry.c):
        depth, *place = transform(seen.rows, take(corner, mine) - eye)
        ends.append(np.stack(place) / depth)
    corner3 = np.stack(ends)
    low, high = corner3.min(axis=0), corner3.max(axis=0)
    found = [none]
    for box, point in cells.in_boxes(low[0] - 0.5, high[0] + 0.5, low[1] - 0.5, high[1] + 0.5):
        x, y = take(corner3[:, 0], box) - across[point], take(corner3[:, 1], box) - row[point]
        area, *moments = np.abs(_below(x, y))
        k = np.flatnonzero(area > LEAST)
        middle = np.clip(np.stack(moments)[:, k] / area[k], 0.0, 1.0)
        some = point[k]
        found.append(Parts(some, mine[box[k]], area[k], across[some] + middle[0], row[some] + middle[1]))
    return Parts(*(np.concatenate([getattr(part, name) for part in found]) for name in Parts.__dataclass_fields__))


def _below(x: Floats, y: Floats) -> Floats:
    """Area of triangles (3 corners, m) in the unit square, and its moments in x and y; with the sign of their turn."""
    total = np.zeros((3, x.shape[1]))
    for start, end in ((0, 1), (1, 2), (2, 0)):
        x0, y0, dx, dy = x[start], y[start], x[end] - x[start], y[end] - y[start]
        with np.errstate(divide="ignore", invalid="ignore"):
            sides, levels = np.sort(np.stack((-x0, 1 - x0)) / dx, axis=0), np.sort(np.stack((-y0, 1 - y0)) / dy, axis=0)
        first, last = np.clip(np.nan_to_num(sides, nan=0.0), 0.0, 1.0)
        between = np.clip(np.nan_to_num(levels, nan=0.0), first, last)
        t = np.stack((first, *between, last))
        u, v = np.clip(x0 + t * dx, 0.0, 1.0), np.clip(y0 + t * dy, 0.0, 1.0)
        step, before, after, left, right = np.diff(u, axis=0), v[:-1], v[1:], u[:-1], u[1:]
        total[0] += (step * (before + after)).sum(axis=0) / 2
        total[1] += (step * (left * (2 * before + after) + right * (before + 2 * after))).sum(axis=0) / 6
        total[2] += (step * (before * before + before * after + after * after)).sum(axis=0) / 6
    return total


def unshadowed_means(scene: Scene, geometry: Geometry, needs: Needs, pixel: Ints, tolerance: float) -> Floats:
    """Radiance (3, n) of pixels (n,) that faces fill, if nothing blocks; NaN where they do not.

    Textures and lobes that are not Lambert's may change within a part: NaN too.
    """
    mean = np.full((3, pixel.size), np.nan)
    parts = parts_of(scene, geometry, pixel)
    surface = distinct(geometry.triangle_surface[parts.triangle])
    glossy = [geometry.columns[lobe.PARAMETERS[0].name] for lobe in geometry.lobes if lobe is not Lambert]
    if geometry.painted or any(albedo[:, surface].any() for albedo in glossy):
        return mean
    whole = np.abs(np.bincount(parts.pixel, parts.area, minlength=pixel.size) - 1) < 16 * LEAST
    mean[:, whole] = 0.0
    parts = parts.take(np.flatnonzero(whole[parts.pixel]))
    for first in range(0, parts.pixel.size, AT_ONCE):
        some = parts.take(np.arange(first, min(first + AT_ONCE, parts.pixel.size)))
        light = _shaded(scene, geometry, needs, some, tolerance) * some.area
        for out, channel in zip(mean, light, strict=True):
            out += np.bincount(some.pixel, channel, minlength=pixel.size)
    return mean


def _shaded(scene: Scene, geometry: Geometry, needs: Needs, parts: Parts, tolerance: float) -> Floats:
    """Radiance (3, p) at the centroids."""
    eye, d = column(scene.camera.position), primary_directions(scene, parts.x, parts.y)
    normal = unit(take(geometry.normal, parts.triangle))
    distance = dot(normal, take(geometry.a, parts.triangle) - eye) / dot(normal, d)
    surface, every = geometry.triangle_surface[parts.triangle], np.arange(parts.pixel.size)
    hits = Hits(surface, eye + distance * d, normal, distance, np.full(every.size, -1), parts.triangle)
    points = shading_points(geometry, hits, -unit(d), every, np.ones(every.size, dtype=bool))
    return reflected(points.as_exact_as(tolerance), needs, without_shadows)
