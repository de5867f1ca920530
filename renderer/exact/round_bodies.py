"""A scene's spheres and ellipsoids as occluders of one light."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..geometry import Geometry, Ints
from ..light_points import hull
from ..lights import Light, QuadLight
from ..vectors import Floats, column, cross, dot, transform, unit
from .light_cone import Bools
from .occluders import GOLDEN
from .rounds import Rounds, ellipsoids, spheres

SHRINK = 1e-12
"""As for pieces: coincident bodies become nested ones."""


@dataclass(frozen=True, eq=False)
class RoundBodies:
    """All ellipsoids of a scene, before a light.

    Parameters
    ----------
    center : (3, e) float64
    reach : (e,) float64
        Largest semi-axis.
    inverse : (e, 3, 3) float64
        Ellipsoid to unit sphere.
    sphere : (e,) bool
    behind : (e,) bool
        Wholly behind the light.
    awkward : (e,) bool
        Crossing the light's plane, or around the light: left to sampling.
    """

    center: Floats
    reach: Floats
    inverse: Floats
    sphere: Bools
    behind: Bools
    awkward: Bools

    def seen(self, points: Floats, point: Ints, body: Ints) -> tuple[list[Rounds], Ints]:
        """Cones of pairs of a point (ascending) and a body, and the points (k,) inside a body."""
        local = np.einsum("qij,jq->iq", self.inverse[body], points[:, point] - self.center[:, body])
        outside = dot(local, local) >= 1
        groups = []
        for kind in (True, False):
            mine = np.flatnonzero(outside & (self.sphere[body] == kind))
            if mine.size:
                b = body[mine]
                if kind:
                    groups.append(spheres(points, point[mine], self.center[:, b], self.reach[b]))
                else:
                    groups.append(ellipsoids(points, point[mine], self.center[:, b], self.inverse[b]))
        return groups, point[~outside]


@lru_cache(maxsize=16)
def round_bodies(geometry: Geometry, light: Light) -> RoundBodies:
    """A scene's ellipsoids, drawn towards their centres by amounts of their own."""
    count = geometry.ellipsoids
    amount = 1 - SHRINK * (1 + (np.arange(count) + 1) * GOLDEN % 1)
    axes = geometry.axes * amount[:, None, None]
    sizes = np.linalg.svd(axes, compute_uv=False).reshape(count, 3)
    behind, awkward = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
    if isinstance(light, QuadLight) and count:
        normal = unit(-cross(column(light.ab), column(light.ac)))
        height = dot(normal, geometry.center - column(light.corner))
        reach = np.sqrt((np.einsum("eij,i->ej", axes, normal[:, 0]) ** 2).sum(axis=1))
        behind, awkward = height <= -reach, np.abs(height) < reach
        corners, _ = hull(light)
        for k in range(count):
            local = transform(geometry.inverse[k], corners - geometry.center[:, [k]])
            awkward[k] |= bool((dot(local, local) < 1).any())
    return RoundBodies(
        center=geometry.center,
        reach=sizes[:, 0],
        inverse=np.linalg.inv(axes),
        sphere=sizes[:, 0] - sizes[:, 2] <= 1e-12 * sizes[:, 0],
        behind=behind,
        awkward=awkward & ~behind,
    )
