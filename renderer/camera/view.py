"""What one set of camera rays sees: surfaces, emission, and the points that are to be shaded."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.lights import around
from nusselt.renderer.scene import Scene
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats, Ints, column, dot, unit
from nusselt.renderer.visibility.segments import small_triangles

from .first_hits import Hits, first_hits
from .rays import pixel_corners, primary_directions

FACING_ULPS = 16 * 2.0**-53
"""Rounding of the cosine between two unit vectors: where a surface is seen edge-on its front is what is seen."""


@dataclass(frozen=True, eq=False)
class View:
    """Camera rays and what they hit.

    Parameters
    ----------
    hits : Hits
    outgoing : (3, n) float64
        Unit directions to the viewer.
    emission : (3, n) float64
        Radiance seen directly, from the front of what emits.
    emitter, background, back : (n,) bool
        The ray hits a light; nothing, or a sky; the black back of a one-sided surface.
    lit : (k,) int64
        The rays whose hit reflects.
    points : ShadingPoints
        Their hits, k of them.
    """

    hits: Hits
    outgoing: Floats
    emission: Floats
    emitter: NDArray[np.bool_]
    background: NDArray[np.bool_]
    back: NDArray[np.bool_]
    lit: NDArray[np.intp]
    points: ShadingPoints


def shading_points(
    geometry: Geometry, hits: Hits, outgoing: Floats, index: Ints, outside: NDArray[np.bool_] | None = None
) -> ShadingPoints:
    """The hits ``index`` (k,) as shading points, their normals turned to the viewer; ``outside`` (k,), else False."""
    surface = hits.surface[index]
    outgoing = outgoing.take(index, axis=1)
    normal = hits.normal.take(index, axis=1)
    facing = dot(normal, outgoing)
    behind = facing < -FACING_ULPS
    normal = np.where(behind, -normal, normal)
    position = hits.position.take(index, axis=1)
    columns = {name: table.take(surface, axis=-1) for name, table in geometry.columns.items()}
    for painted in geometry.painted:
        corners = geometry.a, geometry.b, geometry.c
        mine, albedo = painted.albedo(corners, hits.triangle[index], position)
        columns["diffuse"][:, mine] = albedo
    return ShadingPoints(
        position=position,
        normal=normal,
        outgoing=outgoing,
        mirror=2 * np.abs(facing) * normal - outgoing,
        lobes=geometry.lobes,
        columns=columns,
        ellipsoid=np.where(behind, -1, hits.ellipsoid[index]),
        outside=np.zeros(index.size, dtype=bool) if outside is None else outside,
    )


def look(scene: Scene, geometry: Geometry, x: Floats, y: Floats, frames: int = 1) -> View:
    """Trace the rays through image points (x, y) in pixels, each (n,), y down; ``frames`` as in `first_hits`."""
    corners = pixel_corners(scene)
    d = primary_directions(scene, x, y)
    hits = first_hits(geometry, column(scene.camera.position), d, corners, frames)
    outgoing = -unit(d)
    background = hits.surface < 0
    cosine = dot(hits.normal, outgoing)
    emitter, emission = np.zeros(x.shape, dtype=bool), np.zeros(d.shape)
    hit = np.flatnonzero(~background)
    emitter[hit] = geometry.light[hits.surface[hit]] >= 0
    emission[:, hit] = geometry.emission[:, hits.surface[hit]] * (cosine[hit] > 0)
    sky = around(scene.lights)
    if sky is not None:
        emission[:, background] = sky
    faces = (cosine != 0) if scene.two_sided else (cosine > 0)
    reflects = ~background & ~emitter & faces
    lit = np.flatnonzero(reflects)
    points = shading_points_seen(geometry, column(scene.camera.position), hits, outgoing, lit)
    return View(hits, outgoing, emission, emitter, background, ~background & ~emitter & ~faces, lit, points)


def shading_points_seen(geometry: Geometry, eye: Floats, hits: Hits, outgoing: Floats, index: Ints) -> ShadingPoints:
    """The hits ``index`` (k,) of rays from an eye (3, 1), as shading points."""
    return shading_points(geometry, hits, outgoing, index, _outside(geometry, eye, hits, outgoing, index))


def _outside(geometry: Geometry, eye: Floats, hits: Hits, outgoing: Floats, index: Ints) -> NDArray[np.bool_] | None:
    """See `ShadingPoints`; None if no point is known to be."""
    tree = small_triangles(geometry)
    if tree is None or (np.abs(eye - tree.centre) <= tree.half).all():
        return None
    mine = np.zeros(geometry.triangles + 1, dtype=bool)  # the last for rays that hit none
    mine[tree.triangles] = True
    return np.asarray(mine[hits.triangle[index]] & (dot(hits.normal, outgoing)[index] > 0))
