"""Pixels that another renderer's rounding may resolve otherwise: they are listed, and not judged."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.renderer.vectors import Bools

from .camera.rays import pixel_size
from .camera.view import View, look
from .geometry.arrays import Geometry
from .lights.sampling import random_beams
from .needs import Needs, Source
from .scene import Scene
from .shading import ShadingPoints
from .validation import Vec3
from .vectors import Floats, column, dot, frame, unit


@dataclass(frozen=True)
class Tolerance:
    """How far rounding may move a ray.

    Parameters
    ----------
    angle : float
        Of primary rays, radians.
    lift, slide : float
        Of the origins of shadow rays along the normal and along the surface, scene units.
    unit : float
    centre : Vec3, optional
        With a centre, lift and slide grow with the place: they are times unit + max|p - centre|.
    """

    angle: float
    lift: float
    slide: float
    unit: float = 1.0
    centre: Vec3 | None = None

    def growth(self, points: Floats) -> Floats | float:
        """What lift and slide are to be multiplied by at points (3, n)."""
        if self.centre is None:
            return 1.0
        return self.unit + np.abs(points - column(self.centre)).max(axis=0, initial=0.0)


def near_edges(
    scene: Scene, geometry: Geometry, needs: Needs, view: View, x: Floats, y: Floats, tolerance: Tolerance
) -> Bools:
    """Which of n pixels change their surface, or their view of a light without extent, within the tolerance.

    Penumbrae of extended lights move too, but continuously: they are judged, with the rest of the image.
    """
    step = tolerance.angle / pixel_size(scene)
    near = np.zeros(x.shape, dtype=bool)
    for dx, dy in ((step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step)):
        moved = look(scene, geometry, x + dx, y + dy)
        near |= _surface_changes(view, moved)
        if geometry.painted:
            near |= _albedo_jumps(view, moved)
    for source in needs.sources:
        if not source.has_extent and not source.blockers.none:
            near[view.lit] |= _shadow_changes(source, view.points, tolerance)
    return near


def _surface_changes(view: View, moved: View) -> Bools:
    """Another surface, a fold, or a jump in depth; a slanted smooth surface is none of them."""
    a, b = view.hits, moved.hits
    hit = (a.surface >= 0) & (b.surface >= 0)
    depth, other = np.where(hit, a.distance, 1.0), np.where(hit, b.distance, 1.0)
    slant = np.maximum(np.abs(dot(a.normal, view.outgoing)), 1e-3)
    jump = np.abs(depth - other) > 1e-3 * depth / slant
    fold = dot(a.normal, b.normal) < 1 - 1e-3
    return (a.surface != b.surface) | (hit & (jump | fold))


def _albedo_jumps(view: View, moved: View) -> Bools:
    """Another texel of a texture whose texels are not smoothed."""
    jumps, here, there = np.zeros(view.background.size, dtype=bool), *np.zeros((2, 3, view.background.size))
    here[:, view.lit], there[:, moved.lit] = view.points.diffuse, moved.points.diffuse
    both = np.intersect1d(view.lit, moved.lit)
    jumps[both] = (np.abs(here - there)[:, both] > 1e-3).any(axis=0)
    return jumps


AWAY = -1e-6
"""Cosine below which a surface faces away from a light, wherever rounding moves the point: it is dark."""


def _shadow_changes(source: Source, points: ShadingPoints, tolerance: Tolerance) -> Bools:
    def way(position: Floats) -> Floats:
        return random_beams(source.light, position, np.random.default_rng(0), 1, False)[0]

    def seen(position: Floats) -> Bools:
        d = way(position)
        return source.blockers.visible(position, points.ellipsoid, d, source.light.at_infinity, points.normal)[:, 0]

    here, growth = seen(points.position), tolerance.growth(points.position)
    lifted = points.position + growth * tolerance.lift * points.normal
    changed = seen(lifted) != here
    for tangent in frame(points.normal):
        for slide in (growth * tolerance.slide * tangent, -growth * tolerance.slide * tangent):
            changed |= (seen(lifted + slide) != here) | (seen(points.position + slide) != here)
    return changed & (dot(points.normal, unit(way(points.position)[:, :, 0])) > AWAY)
