"""Mitsuba's perspective sensor as our camera."""

from __future__ import annotations

import math

import numpy as np

from nusselt.renderer.placed import is_sheared, looking
from nusselt.renderer.scene import MAX_SIDE, Camera

from .nodes import Node

SIZE = (768, 576)
"""Of a film that says none."""
IGNORED = ("near_clip", "far_clip", "shutter_open", "shutter_close", "focus_distance")


def camera_of(sensor: Node) -> tuple[Camera, int, int]:
    """A camera, and the width and height of its film."""
    if sensor.plugin != "perspective":
        raise sensor.refused(sensor.plugin, "perspective")
    sensor.holds("Film", "Sampler")
    sensor.only("fov", "fov_axis", "focal_length", "to_world", *IGNORED)
    width, height = _film(next(sensor.of_kind("Film"), None), sensor)
    matrix = sensor.matrix()
    if np.linalg.det(matrix[:3, :3]) <= 0:
        raise sensor.refused("a mirrored to_world", "one that turns, moves or scales: lookat does")
    if is_sheared(matrix):
        raise sensor.refused("a sheared to_world", "one that turns, moves or scales: lookat does")
    return looking(matrix, _fov_y(sensor, width, height), 1.0), width, height


def _film(film: Node | None, sensor: Node) -> tuple[int, int]:
    if film is None:
        return SIZE
    if film.plugin != "hdrfilm" or film.word("pixel_format", "rgb") not in ("rgb", "rgba"):
        raise film.refused(f"{film.plugin}, {film.word('pixel_format', 'rgb')}", "hdrfilm, rgb")
    width, height = (int(film.number(name, size)) for name, size in zip(("width", "height"), SIZE, strict=True))
    if not (1 <= width <= MAX_SIDE and 1 <= height <= MAX_SIDE):
        raise film.refused(f"{width} x {height}", f"1 to {MAX_SIDE} pixels a side")
    whole = {"crop_offset_x": 0, "crop_offset_y": 0, "crop_width": width, "crop_height": height}
    if any(film.number(name, size) != size for name, size in whole.items()):
        raise film.refused("a crop", "the whole film")
    return width, height


def _fov_y(sensor: Node, width: int, height: int) -> float:
    """Vertical field of view in degrees; Mitsuba's is along x unless said otherwise."""
    if "focal_length" in sensor.properties or "fov" not in sensor.properties:
        words = sensor.word("focal_length", "50mm")
        try:
            length = float(words.removesuffix("mm"))
        except ValueError:
            raise sensor.refused(f"focal_length {words!r}", "a length in mm, such as 50mm") from None
        fov, axis = 2 * math.degrees(math.atan(math.hypot(36, 24) / 2 / length)), "diagonal"
    else:
        fov, axis = sensor.number("fov"), sensor.word("fov_axis", "x")
    if not 0 < fov < 180:
        raise sensor.refused(f"fov {fov:g}", "an angle in (0, 180) degrees")
    sides = {"x": width, "y": height, "diagonal": math.hypot(width, height)}
    sides |= {"smaller": min(width, height), "larger": max(width, height)}
    if axis not in sides:
        raise sensor.refused(f"fov_axis {axis!r}", ", ".join(sides))
    return 2 * math.degrees(math.atan(math.tan(math.radians(fov) / 2) * height / sides[axis]))
