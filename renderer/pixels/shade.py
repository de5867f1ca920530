"""Radiance at image points of given regions, in chunks that any executor may take.

Chunks are cut after sorting by region and place: what is near shares its blockers, and the bits do not depend
on who does the work.
"""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.camera.first_hits import origin_in
from nusselt.renderer.chunks import STRIP, gathered, pieces
from nusselt.renderer.estimators.analytic import without_shadows
from nusselt.renderer.estimators.protocol import Estimator
from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.lights import around
from nusselt.renderer.lobes import Lambert
from nusselt.renderer.needs import Needs, Source
from nusselt.renderer.prepared import prepare
from nusselt.renderer.radiance import reflected, still
from nusselt.renderer.scene import Scene
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats, Ints, dot, unit
from nusselt.renderer.visibility.segments import box_corners

from .regions import Regions

SMALLEST = 8192
"""Points in a piece of work, at least: half the time of a piece of a thousand goes by whatever their number."""


@dataclass(frozen=True)
class Work:
    """What a worker needs to know; ``tolerance`` is the image's."""

    scene: Scene
    digest: str
    estimator: Estimator
    everything: bool
    tolerance: float


Found: TypeAlias = tuple[Geometry, Needs, Regions]
_LAST: dict[tuple[str, bool], Found] = {}


def regions_of(scene: Scene, digest: str, everything: bool = False) -> Found:
    """A scene's arrays, needs and regions, found once; the scene is known by its digest."""
    key = digest, everything
    found = _LAST.get(key)
    if found is None:
        near, geometry, needs = prepare(scene, everything)
        found = geometry, needs, Regions.of(near, geometry, tuple(source.light for source in needs.sources))
        _LAST.clear()
        _LAST[key] = found
    return found


def shade_chunk(work: Work, x: Floats, y: Floats, region: Ints) -> Floats:
    """Reflected radiance (3, n) at image points of regions that reflect."""
    _, needs, regions = regions_of(work.scene, work.digest, work.everything)
    points = regions.points(x, y, region).as_exact_as(work.tolerance)
    return reflected(points, needs, still(work.estimator), box_corners(points.position))


def unshadowed(regions: Regions, needs: Needs, x: Floats, y: Floats, region: Ints, tolerance: float) -> Floats:
    """Reflected radiance (3, n) as if nothing blocked and no light had a rim, at image points that reflect."""

    def free(points: ShadingPoints, source: Source) -> Floats:
        return without_shadows(points, replace(source, light=source.light.without_rim()))

    points = regions.points(x, y, region).as_exact_as(tolerance)
    return reflected(points, needs, free, np.zeros((3, 0)))  # what blocks it has no say


@dataclass(frozen=True, eq=False)
class Palette:
    """What is known of regions without shading them, by surface; see `surface_of`.

    Parameters
    ----------
    seen : (3, r) float64
        Radiance seen directly.
    reflects, emitter, back : (r,) bool
        Whether it is to be shaded; is a light's body; is the black back of a one-sided surface.
    tint : (3, r) or (3, 1) float64, optional
        Unit, the colour that a surface reflects, where it has but one: all lights have one colour, and all lobes are
        Lambert's. One column if no two that reflect differ.
    """

    seen: Floats
    reflects: NDArray[np.bool_]
    emitter: NDArray[np.bool_]
    back: NDArray[np.bool_]
    tint: Floats | None

    def told(self, radiance: Floats) -> Floats:
        """What is kept of reflected radiance (3, n): its length (1, n) if its colour is known, else itself."""
        return radiance if self.tint is None else np.sqrt(dot(radiance, radiance))[None]

    def radiance(self, told: Floats, surface: Ints) -> Floats:
        """Radiance (3, ...) from what is told (c, ...) of it, on surfaces (...)."""
        if self.tint is None:
            return told
        return (self.tint if self.tint.shape[1] == 1 else np.take(self.tint, surface, axis=1)) * told


@dataclass
class Shader:
    """Shades on an executor, and counts.

    Parameters
    ----------
    work : Work
    executor : Executor or None
    palette : Palette
    evaluations : int
        Points shaded so far.
    """

    work: Work
    executor: Executor | None
    palette: Palette
    evaluations: int = 0

    def __call__(self, x: Floats, y: Floats, region: Ints) -> Floats:
        """Radiance (c, n), see `Palette.told`, at image points (n,) of regions (n,) that reflect."""
        self.evaluations += x.size
        order = np.lexsort((x, y // STRIP, region))
        values = gathered(partial(shade_chunk, self.work), self.executor, pieces(order, SMALLEST), x, y, region)
        return self.palette.told(values)

    def free(self, regions: Regions, needs: Needs, x: Floats, y: Floats, region: Ints) -> Floats:
        """The same as if nothing blocked, see `unshadowed`; it is not counted."""
        return self.palette.told(unshadowed(regions, needs, x, y, region, self.work.tolerance))


def palette_of(scene: Scene, regions: Regions, needs: Needs) -> Palette:
    """The palette of a scene as its camera sees it."""
    g, faces = regions.geometry, regions.faces
    origin = regions.lens.origin
    k = faces.triangle
    height = dot(g.normal[:, k], origin - g.a[:, k])
    outside = np.array([origin_in(g, index, origin)[1] > 0 for index in range(g.ellipsoids)], dtype=bool)
    front = np.concatenate((height > 0, outside, dot(g.disk_normal, origin - g.disk_center) > 0))
    surface = np.concatenate((g.triangle_surface[k], g.ellipsoid_surface, g.disk_surface)).astype(np.int64)
    emitter = g.light[surface] >= 0
    faced = front | scene.two_sided
    reflects = faced & ~emitter & g.reflects[surface] & bool(needs.sources)
    seen = np.zeros((3, surface.size + 2))
    seen[:, :-2] = np.where(front, g.emission[:, surface], 0.0)
    sky = around(scene.lights)
    if sky is not None:
        seen[:, [-2]] = sky
    reflects, emitter, back = (np.pad(kind, (0, 2)) for kind in (reflects, emitter, ~faced & ~emitter))
    return Palette(seen, reflects, emitter, back, _tint(g, needs, surface, reflects))


SAME = 1e-12
"""Of unit colours, by which they may differ and be one."""


def _tint(g: Geometry, needs: Needs, surface: Ints, reflects: NDArray[np.bool_]) -> Floats | None:
    """See `Palette`, for the rows ``surface`` (r - 2,) of the scene's table."""
    colours = np.array([source.light.colour for source in needs.sources]).reshape(-1, 3)
    if not needs.sources or any(kind is not Lambert for source in needs.sources for kind in source.lobes):
        return None
    colours = unit(colours.T)
    if (np.abs(colours - colours[:, :1]) > SAME).any():
        return None
    albedo = np.pad(g.columns[Lambert.PARAMETERS[0].name][:, surface], ((0, 0), (0, 2)))
    tint = unit(albedo * colours[:, :1])
    one = tint[:, [int(reflects.argmax())]]
    return one if (tint == one)[:, reflects].all() else tint


def surface_of(region: Ints, surfaces: int) -> Ints:
    """Column of a palette for each region: the last for EDGE, the last but one for NOTHING."""
    most = int(region.max(initial=0))
    if most >= region.size:
        return np.where(region < 0, surfaces - 1 - region, region % max(surfaces, 1))
    return np.concatenate((np.arange(most + 1) % max(surfaces, 1), (surfaces + 1, surfaces)))[region]
