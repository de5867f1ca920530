"""A scene's spheres and ellipsoids as occluders of one light."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from nusselt.renderer.closed_forms.circles.cones import Rounds, ellipsoids, spheres
from nusselt.renderer.closed_forms.circles.pairing import columns
from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.lights import Light
from nusselt.renderer.vectors import Bools, Floats, Ints, dot, transform, unit
from nusselt.renderer.watertight import PLANE_ULPS

from .occluders import ALONG, BEHIND, INSIDE, TOUCHING


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
        Wholly behind the light, or another one over again.
    awkward : (e,) bool
        Crossing the light's plane, or around the light: left to sampling.
    """

    center: Floats
    reach: Floats
    inverse: Floats
    sphere: Bools
    behind: Bools
    awkward: Bools

    def sides(self, points: Floats, normal: Floats, own: Bools, body: Ints) -> tuple[Ints, Floats]:
        """Where points (3, q) with unit normals (3, q) are to bodies (q,), and the bodies' outward normals there.

        Parameters
        ----------
        own : (q,) bool
            The point lies on the body.

        Returns
        -------
        side : (q,) int
            OUTSIDE; INSIDE, also on the inner side of its surface: all is hidden; BEHIND, on the outer side: nothing
            is; TOUCHING: on the surface, and facing another way.
        outward : (3, q) float64
        """
        inverse = self.inverse[body]
        local = np.einsum("qij,jq->iq", inverse, points - columns(self.center, body))
        outward = unit(np.einsum("qji,jq->iq", inverse, local))
        square = dot(local, local)
        coordinates = np.abs(points).max(axis=0) + np.abs(columns(self.center, body)).max(axis=0)
        room = 4 * PLANE_ULPS * (1 + coordinates * np.abs(inverse).sum(axis=2).max(axis=1))
        on = own | (np.abs(square - 1) <= room)
        agrees = dot(outward, normal)
        met = np.where(agrees > 1 - ALONG, BEHIND, np.where(agrees < ALONG - 1, INSIDE, TOUCHING))
        return np.where(
            on, np.where(own, np.where(agrees > 0, BEHIND, INSIDE), met), np.where(square > 1, OUTSIDE, INSIDE)
        ), outward

    def seen(self, points: Floats, point: Ints, body: Ints) -> list[Rounds]:
        """Cones of pairs of a point (ascending) and a body around none of the points."""
        groups = []
        for kind in (True, False):
            mine = np.flatnonzero(self.sphere[body] == kind)
            if mine.size:
                b = body[mine]
                if kind:
                    groups.append(spheres(points, point[mine], columns(self.center, b), self.reach[b]))
                else:
                    groups.append(ellipsoids(points, point[mine], columns(self.center, b), self.inverse[b]))
        return groups


OUTSIDE = 0


@lru_cache(maxsize=16)
def round_bodies(geometry: Geometry, light: Light) -> RoundBodies:
    """A scene's ellipsoids; of those that are one to rounding, one."""
    count, axes = geometry.ellipsoids, geometry.axes
    sizes = np.linalg.svd(axes, compute_uv=False).reshape(count, 3)
    behind, awkward = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
    plane = light.plane()
    if plane is not None and count:
        normal, place = plane
        height = dot(normal, geometry.center - place)
        reach = np.sqrt((np.einsum("eij,i->ej", axes, normal[:, 0]) ** 2).sum(axis=1))
        behind, awkward = height <= -reach, np.abs(height) < reach
        corners = light.hull()
        for k in range(count):
            local = transform(geometry.inverse[k], corners - geometry.center[:, [k]])
            awkward[k] |= bool((dot(local, local) < 1).any())
    behind |= _repeated(geometry.center, axes)
    return RoundBodies(
        center=geometry.center,
        reach=sizes[:, 0],
        inverse=geometry.inverse,
        sphere=sizes[:, 0] - sizes[:, 2] <= 1e-12 * sizes[:, 0],
        behind=behind,
        awkward=awkward & ~behind,
    )


def _repeated(center: Floats, axes: Floats) -> Bools:
    """Which ellipsoids (e,) are an earlier one to rounding."""
    count = center.shape[1]
    square = np.einsum("eij,ekj->eik", axes, axes)
    out = np.zeros(count, dtype=bool)
    for k in range(1, count):
        room = 16 * 2.0**-53
        moved = np.abs(center[:, :k] - center[:, [k]]).max(axis=0) <= room * np.abs(center[:, k]).max()
        turned = np.abs(square[:k] - square[k]).max(axis=(1, 2)) <= room * np.abs(square[k]).max()
        out[k] = (moved & turned & ~out[:k]).any()
    return out
