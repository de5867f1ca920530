"""pbrt's perspective camera and film as ours."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nusselt.renderer.placed import looking
from nusselt.renderer.scene import MAX_SIDE, Camera
from nusselt.renderer.vectors import Floats

from .tokens import Directive

SIZE = (1280, 720)
"""Of a film that says none."""
MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])
NO_PART = ("filename", "diagonal", "savefp16")
"""Of a film: what changes no radiance in the scenes that are read."""


@dataclass(frozen=True)
class View:
    """A camera, the way from the file's world to ours, and what is to be said."""

    camera: Camera
    world: Floats
    notes: tuple[str, ...] = ()


def film_of(directive: Directive | None) -> tuple[int, int]:
    """Width and height in pixels."""
    if directive is None:
        return SIZE
    if directive.kind != "rgb":
        raise directive.refused(directive.kind, "rgb")
    directive.only("xresolution", "yresolution", "sensor", "iso", "exposuretime", "imagingratio", *NO_PART)
    if directive.word("sensor", "cie1931") != "cie1931":
        raise directive.refused(directive.word("sensor", ""), "cie1931: radiance as it is", "sensor")
    for name, plain in (("iso", 100.0), ("exposuretime", 1.0), ("imagingratio", 1.0)):
        if directive.number(name, plain) != plain:
            raise directive.refused(f"{name} {directive.number(name, plain):g}", f"{plain:g}: radiance as it is", name)
    width, height = (
        directive.whole(name, size) for name, size in zip(("xresolution", "yresolution"), SIZE, strict=True)
    )
    if not (1 <= width <= MAX_SIDE and 1 <= height <= MAX_SIDE):
        raise directive.refused(f"{width} x {height}", f"1 to {MAX_SIDE} pixels a side")
    return width, height


def lens_of(directive: Directive, transform: Floats, width: int, height: int) -> View:
    """The camera at the inverse of the transform that is current at it.

    ``fov`` is along the image's shorter side, where the screen window is from -1 to 1 unless said.
    """
    if directive.kind != "perspective":
        raise directive.refused(directive.kind, "perspective")
    directive.only(
        "fov", "screenwindow", "lensradius", "frameaspectratio", "shutteropen", "shutterclose", "focaldistance"
    )
    said = [f"{directive.where}: lensradius is left out: a pinhole"] * (directive.number("lensradius", 0.0) != 0)
    fov, shape = directive.number("fov", 90.0), width / height
    if not 0 < fov < 180:
        raise directive.refused(f"fov {fov:g}", "an angle in (0, 180) degrees", "fov")
    if directive.number("frameaspectratio", shape) != shape:
        raise directive.refused("frameaspectratio", "that of the film", "frameaspectratio")
    high = _half_height(directive, shape)
    fov_y = 2 * math.degrees(math.atan(math.tan(math.radians(fov) / 2) * high))
    camera = np.linalg.inv(transform)
    if np.linalg.det(camera[:3, :3]) < 0:
        return View(looking(camera, fov_y, 1.0), np.eye(4), tuple(said))
    told = f"{directive.where}: pbrt's space is left-handed: the world is mirrored in x, so that the image is its own"
    return View(looking(MIRROR @ camera, fov_y, 1.0), MIRROR, (*said, told))


def _half_height(directive: Directive, shape: float) -> float:
    """Of the screen window."""
    across, high = max(shape, 1.0), max(1 / shape, 1.0)
    window = directive.numbers("screenwindow", ("float",), np.array([-across, across, -high, high]))
    if window.size != 4 or not window[1] > 0 or not window[3] > 0 or window[0] != -window[1] or window[2] != -window[3]:
        raise directive.refused("screenwindow off the middle", "-x x -y y", "screenwindow")
    if abs(window[1] / window[3] / shape - 1) > 1e-6:
        raise directive.refused("a screenwindow of another shape", f"that of the film, {shape:g}", "screenwindow")
    return float(window[3])
