"""What an estimator says of the points a camera sees, and how far it may be off by its own claim."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from nusselt.renderer.camera.rays import pixel_centres
from nusselt.renderer.camera.view import View, look
from nusselt.renderer.estimators.analytic import without_shadows
from nusselt.renderer.geometry.arrays import Geometry, build_geometry
from nusselt.renderer.geometry.recentre import near_origin
from nusselt.renderer.needs import Source, find_needs
from nusselt.renderer.scene import Scene
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats

from .motions import places
from .sensitivity import scale_of

ULPS = 64 * 2.0**-53
"""Rounding of a light's closed form, relative to what it gives a surface that faces it."""


@dataclass(frozen=True, eq=False)
class Seen:
    """A scene as it is rendered, and the points its camera sees.

    Parameters
    ----------
    scene : Scene
        Brought near the origin, as `render` does it.
    anchor : (3,) float64
        What was subtracted from every place.
    """

    scene: Scene
    anchor: Floats
    geometry: Geometry
    view: View

    @property
    def points(self) -> ShadingPoints:
        return self.view.points

    @cached_property
    def size(self) -> float:
        """The largest coordinate of the scene as it is given: its digits end there, wherever it is brought."""
        shift = self.anchor[:, None]
        eye = np.array(self.scene.camera.position)[:, None]
        return float(np.abs(np.hstack((places(self.scene), self.points.position, eye)) + shift).max(initial=0.0))

    @cached_property
    def pixel_of(self) -> Any:
        """Number of the point of each pixel, -1 where none is lit; (h, w)."""
        found = np.full(self.scene.width * self.scene.height, -1)
        found[self.view.lit] = np.arange(self.view.lit.size)
        return found.reshape(self.scene.height, self.scene.width)


def seen(scene: Scene) -> Seen:
    """The camera's points, one a pixel."""
    near = near_origin(scene)
    anchor = np.array(scene.camera.position) - np.array(near.camera.position)
    geometry = build_geometry(near)
    x, y = pixel_centres(range(near.width), range(near.height))
    return Seen(near, anchor, geometry, look(near, geometry, x, y))


@dataclass(frozen=True, eq=False)
class Values:
    """Of n points, summed over the lights: radiance, what it may be off by, and the closed form without blockers.

    ``allowed`` is infinite where something was sampled. ``free`` is the closed form by the number of the
    light, ``most`` what the lights would give to a surface that faced them.
    """

    radiance: Floats
    allowed: Floats
    unoccluded: Floats
    free: dict[int, Floats]
    most: Floats

    @property
    def size(self) -> Floats:
        """What differences are told relative to, (n,): the unoccluded value; a millionth of the most there can be."""
        return np.asarray(np.maximum(self.unoccluded.max(axis=0), 1e-6 * self.most.max(axis=0)) + 1e-300)


def with_bound(estimator: Any, points: ShadingPoints, source: Source) -> tuple[Floats, Floats]:
    """Radiance (3, n) of one light, and its claimed error (n,) relative to the unoccluded value."""
    radiance, bound, _ = estimator.with_bounds(points, source, np.random.default_rng(0))
    return radiance, bound


def values(seen: Seen, points: ShadingPoints, estimator: Any) -> Values:
    """What the estimator makes of points of a scene."""
    flat = np.zeros((3, points.count))
    found = Values(flat.copy(), flat.copy(), flat.copy(), {}, flat.copy())
    for source in find_needs(seen.scene, seen.geometry).sources:
        near = source.seen_from(points.position)
        free = without_shadows(points, near)
        radiance, allowed = _of_light(estimator, points, near, free)
        found.radiance[:] += radiance
        found.unoccluded[:] += free
        found.allowed[:] += allowed
        found.free[source.index] = free
        found.most[:] += scale_of(points, source.light)
    return found


def twin_values(
    seen: Seen, points: ShadingPoints, estimator: Any, free: list[Floats | float], everything: bool = False
) -> tuple[Floats, Floats]:
    """Radiance (3, n) at the twin's points and what it may be off by; ``free`` is the closed form of each light."""
    total, off = np.zeros((3, points.count)), np.zeros((3, points.count))
    for source in find_needs(seen.scene, seen.geometry, everything).sources:
        near = source.seen_from(points.position)
        radiance, allowed = _of_light(estimator, points, near, free[source.index])
        total += radiance
        off += allowed
    return total, off


def _of_light(estimator: Any, points: ShadingPoints, source: Source, free: Floats | float) -> tuple[Floats, Floats]:
    radiance, bound = with_bound(estimator, points, source)
    with np.errstate(invalid="ignore"):  # no bound at all, of nothing
        off = np.where(bound == np.inf, np.inf, bound * free)
    return radiance, off + ULPS * scale_of(points, source.light)
