"""UsdGeomCamera and UsdRenderSettings as our camera and image size."""

from __future__ import annotations

import math

import numpy as np

from nusselt.renderer.placed import looking
from nusselt.renderer.scene import MAX_SIDE, Camera

from .prims import Notes, Prim

WIDTH = 640
"""Of an image whose size nobody says."""
LENS = (("fStop", 0.0), ("exposure", 0.0))
"""What is left out, and where it does nothing."""


def camera_of(prim: Prim, settings: Prim | None, notes: Notes) -> tuple[Camera, int, int]:
    """A camera, and the width and height of its image.

    The height and width of the aperture give the field of view along the one that the image's shape makes no wider:
    ``aspectRatioConformPolicy``, expandAperture unless said.
    """
    if str(prim.get("projection", "perspective")) != "perspective":
        raise prim.refused(prim.get("projection"), "perspective")
    across, high = prim.number("horizontalAperture", 20.955), prim.number("verticalAperture", 15.2908)
    for name in ("horizontalApertureOffset", "verticalApertureOffset"):
        if prim.number(name, 0.0) != 0:
            raise prim.refused(name, "0: the middle of the image is straight ahead")
    for name, nothing in LENS:
        if prim.number(name, nothing) != nothing:
            notes.say(prim, f"{name} is left out: a pinhole, and linear radiance")
    if prim.authored("clippingRange"):
        notes.say(prim, "clippingRange is left out: what is nearer or farther is seen too")
    if not (across > 0 and high > 0 and prim.number("focalLength", 50.0) > 0):
        raise prim.refused("an aperture or focal length of 0", "lengths above 0")
    width, height = _size(prim, settings, across / high, notes)
    shape = width / height
    policy = str(settings.get("aspectRatioConformPolicy", "expandAperture")) if settings else "expandAperture"
    by_width = {
        "expandAperture": shape < across / high,
        "cropAperture": shape > across / high,
        "adjustApertureWidth": False,
        "adjustApertureHeight": True,
    }
    if policy not in by_width:
        raise prim.refused(f"aspectRatioConformPolicy {policy}", ", ".join(by_width))
    opening = across / shape if by_width[policy] else high
    fov = 2 * math.degrees(math.atan(opening / 2 / prim.number("focalLength", 50.0)))
    matrix = prim.matrix()
    if np.linalg.det(matrix[:3, :3]) < 0:
        raise prim.refused("a mirrored transform", "one that turns, moves or scales")
    return looking(matrix, fov, -1.0), width, height


def _size(prim: Prim, settings: Prim | None, shape: float, notes: Notes) -> tuple[int, int]:
    if settings is None:
        height = min(max(1, round(WIDTH / shape)), MAX_SIDE)
        notes.say(prim, f"no RenderSettings: the image is {WIDTH} x {height} pixels")
        return WIDTH, height
    width, height = (int(side) for side in settings.get("resolution", (2048, 1080)))
    if settings.number("pixelAspectRatio", 1.0) != 1:
        raise settings.refused("pixelAspectRatio", "1")
    if not (1 <= width <= MAX_SIDE and 1 <= height <= MAX_SIDE):
        raise settings.refused(f"resolution {width} x {height}", f"1 to {MAX_SIDE} pixels a side")
    return width, height
