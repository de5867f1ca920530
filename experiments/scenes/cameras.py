"""Several cameras for one scene: nothing may hold for one view alone."""

from __future__ import annotations

import math

from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.validation import Vec3

TURNS: tuple[tuple[float, float, float], ...] = (
    (0.0, 0.0, 1.0),
    (9.7, 4.1, 0.93),
    (-8.3, -2.2, 1.07),
    (4.9, 7.3, 0.81),
    (-5.7, 2.9, 1.19),
)
"""Degrees around the vertical through the target, degrees up, and distance from it, each relative to the scene's."""


def views(scene: Scene, count: int = len(TURNS)) -> list[Scene]:
    """The scene from its own camera and from others near by, up to five."""
    return [
        scene.with_(camera=turned(scene.camera, *turn), name=f"{scene.name}/{number}" if number else scene.name)
        for number, turn in enumerate(TURNS[:count])
    ]


def turned(camera: Camera, around: float, up: float, distance: float) -> Camera:
    """The camera moved on a sphere about its target."""
    if (around, up, distance) == (0.0, 0.0, 1.0):
        return camera
    x, y, z = (p - t for p, t in zip(camera.position, camera.target, strict=True))
    radius = math.sqrt(x * x + y * y + z * z)
    azimuth = math.atan2(x, z) + math.radians(around)
    height = min(max(math.asin(y / radius) + math.radians(up), -1.4), 1.4)
    radius *= distance
    step = (
        radius * math.cos(height) * math.sin(azimuth),
        radius * math.sin(height),
        radius * math.cos(height) * math.cos(azimuth),
    )
    tx, ty, tz = camera.target
    position: Vec3 = (tx + step[0], ty + step[1], tz + step[2])
    return Camera(position, camera.target, camera.up, camera.fov_y)
