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
from nusselt.renderer.needs import Needs, Source
from nusselt.renderer.prepared import prepare
from nusselt.renderer.radiance import reflected, still
from nusselt.renderer.scene import Scene
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats, Ints, dot

from .regions import NOTHING, Regions

SMALLEST = 4096
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
    return reflected(points, needs, still(work.estimator))


def unshadowed(regions: Regions, needs: Needs, x: Floats, y: Floats, region: Ints) -> Floats:
    """Reflected radiance (3, n) as if nothing blocked and no light had a rim, at image points that reflect."""

    def free(points: ShadingPoints, source: Source) -> Floats:
        return without_shadows(points, replace(source, light=source.light.without_rim()))

    return reflected(regions.points(x, y, region).as_exact_as(1.0), needs, free)


@dataclass
class Shader:
    """Shades on an executor, and counts.

    Parameters
    ----------
    work : Work
    executor : Executor or None
    evaluations : int
        Points shaded so far.
    """

    work: Work
    executor: Executor | None
    evaluations: int = 0

    def __call__(self, x: Floats, y: Floats, region: Ints) -> Floats:
        """Radiance (3, n) at image points (n,) of regions (n,) that reflect."""
        self.evaluations += x.size
        order = np.lexsort((x, y // STRIP, region))
        return gathered(partial(shade_chunk, self.work), self.executor, pieces(order, SMALLEST), x, y, region)


@dataclass(frozen=True)
class Palette:
    """What is known of regions without shading them.

    Parameters
    ----------
    seen : (3, r) float64
        Radiance seen directly; column -1 is the background's.
    reflects, emitter, back : (r,) bool
        Whether it is to be shaded; is a light's body; is the black back of a one-sided surface.
    """

    seen: Floats
    reflects: NDArray[np.bool_]
    emitter: NDArray[np.bool_]
    back: NDArray[np.bool_]


def palette_of(scene: Scene, regions: Regions, needs: Needs) -> Palette:
    """The palette by surface (region modulo the number of surfaces); its last column is NOTHING's."""
    g, faces = regions.geometry, regions.faces
    origin = regions.lens.origin
    k = faces.triangle
    height = dot(g.normal[:, k], origin - g.a[:, k])
    outside = np.array([origin_in(g, index, origin)[1] > 0 for index in range(g.ellipsoids)], dtype=bool)
    front = np.concatenate((height > 0, outside, dot(g.disk_normal, origin - g.disk_center) > 0))
    surface = np.concatenate((g.triangle_surface[k], g.ellipsoid_surface, g.disk_surface)).astype(np.int64)
    emitter = g.light[surface] >= 0
    seen = np.where(front, g.emission[:, surface], 0.0)
    faced = front | scene.two_sided
    reflects = faced & ~emitter & g.reflects[surface] & bool(needs.sources)
    pad: NDArray[np.bool_] = np.zeros(1, dtype=bool)
    sky = around(scene.lights)
    return Palette(
        np.hstack((seen, np.zeros((3, 1)) if sky is None else sky)),
        np.concatenate((reflects, pad)),
        np.concatenate((emitter, pad)),
        np.concatenate((~faced & ~emitter, pad)),
    )


def surface_of(region: Ints, surfaces: int) -> Ints:
    """Column of a palette for each region."""
    return np.where(region == NOTHING, surfaces, region % max(surfaces, 1))
