"""A scene's sensors in the place of camera rays: white matt points, whose radiance is irradiance over pi."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.lobes import Lambert
from nusselt.renderer.scene import Scene
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats, Ints, dot

from .first_hits import Hits
from .view import View

ON = 1e-9
"""Heights above an ellipsoid, in units of its size, at which a sensor lies on it."""


def sensor_view(scene: Scene, geometry: Geometry, index: Ints) -> View:
    """The sensors ``index`` (n,) of a scene, as if each were what one camera ray meets."""
    sensors = [scene.sensors[k] for k in index.tolist()]
    position, normal = (
        np.array([getattr(s, name) for s in sensors]).reshape(-1, 3).T for name in ("position", "normal")
    )
    count = len(sensors)
    nothing = np.zeros(count, dtype=bool)
    none = np.full(count, -1)
    ellipsoid = _on(geometry, position, normal)
    points = ShadingPoints(
        position=position,
        normal=normal,
        outgoing=normal,
        mirror=normal,
        lobes=(Lambert,),
        columns={Lambert.PARAMETERS[0].name: np.ones((3, count))},
        ellipsoid=ellipsoid,
        outside=nothing,
    )
    hits = Hits(none, position, normal, np.zeros(count), ellipsoid, none)
    return View(hits, normal, np.zeros((3, count)), nothing, nothing, nothing, np.arange(count), points)


def _on(geometry: Geometry, position: Floats, normal: Floats) -> Ints:
    """The ellipsoid (n,) on whose outside each sensor lies, looking away from it; -1 for none."""
    found = np.full(position.shape[1], -1)
    for k in range(geometry.ellipsoids):
        local = geometry.inverse[k] @ (position - geometry.center[:, k : k + 1])
        outwards = dot(geometry.inverse[k].T @ local, normal) > 0
        found[outwards & (np.abs(np.sqrt(dot(local, local)) - 1) < ON)] = k
    return found


def to_irradiance(radiance: Any) -> Any:
    """What a sensor reads, W m^-2, from the radiance of a white matt point, a number or an array."""
    return math.pi * radiance
