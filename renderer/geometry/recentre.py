"""A scene far from the origin, brought near it without rounding a digit.

At 1e9 a hit point is known to 1e-7 however well its triangle is. Along an axis on which every coordinate has one
sign and none is more than twice another, differences are exact (Sterbenz 1974): there the one nearest zero becomes
the origin. Elsewhere nothing is moved, since that would round.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats


def _anchor(places: Floats) -> Floats:
    """What can be subtracted from all of (3, n) exactly, (3,)."""
    low, high = places.min(axis=1), places.max(axis=1)
    above, below = (low > 0) & (high <= 2 * low), (high < 0) & (low >= 2 * high)
    return np.where(above, low, np.where(below, high, 0.0))


def near_origin(scene: Scene) -> Scene:
    """The same scene, moved if that takes no rounding; itself if there is nothing to gain."""
    camera = scene.camera
    small = [
        camera.position,
        camera.target,
        *(s.position for s in scene.sensors),
        *(e.center for e in scene.ellipsoids),
    ]
    lamps = [light.anchored() for light in scene.lights]
    anchor = _anchor(np.hstack([np.array(small).T, *lamps, *(mesh.vertices for mesh in scene.meshes)]))
    if not anchor.any():
        return scene

    def moved(place: Any) -> Any:
        return tuple((np.array(place) - anchor).tolist())

    return scene.with_(
        camera=replace(camera, position=moved(camera.position), target=moved(camera.target)),
        meshes=tuple(replace(mesh, vertices=mesh.vertices - anchor[:, None]) for mesh in scene.meshes),
        ellipsoids=tuple(replace(ellipsoid, center=moved(ellipsoid.center)) for ellipsoid in scene.ellipsoids),
        lights=tuple(light.moved(anchor) for light in scene.lights),
        sensors=tuple(replace(sensor, position=moved(sensor.position)) for sensor in scene.sensors),
    )
