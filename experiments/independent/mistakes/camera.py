"""Mistakes of the camera."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from nusselt.experiments.independent.rays import dot
from nusselt.experiments.independent.steps import rays
from nusselt.experiments.independent.world import Floats, World

from .mistake import Mistake, Step, everywhere


def _moved(x: float, y: float) -> Step:
    """The step `pixel` off by so many pixels."""
    return lambda corner, offset: corner + offset + np.array([[x], [y]])


def _fov(change: Step) -> Step:
    return lambda world: replace(world, fov=change(world))


def _across(world: World) -> float:
    """The angle taken for the horizontal one."""
    return 2 * math.degrees(math.atan(math.tan(math.radians(world.fov) / 2) * world.height / world.width))


def _wide(share: float) -> Step:
    """The step `rays` through places farther from the middle, across the image only."""
    return lambda world, x, y: rays(world, (x - world.width / 2) * share + world.width / 2, y)


def _square(world: World, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    return _wide(world.height / world.width)(world, x, y)


def _last(world: World, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Pixel numbers over one less than their count."""
    return rays(world, (x - 0.5) * world.width / (world.width - 1), (y - 0.5) * world.height / (world.height - 1))


def _rolled(degrees: float) -> Step:
    def step(world: World) -> World:
        look = (world.at - world.eye) / np.linalg.norm(world.at - world.eye)
        t = math.radians(degrees)
        return replace(world, up=math.cos(t) * world.up + math.sin(t) * np.cross(look, world.up))

    return step


def _looking(share: float) -> Step:
    """The step `finished` darker towards the corners, by the cosine of 45 degrees' view to a power."""

    def change(image: Floats) -> Floats:
        height, width = image.shape[1:]
        y, x = np.mgrid[:height, :width] + 0.5
        far = ((x - width / 2) ** 2 + (y - height / 2) ** 2) * (2 * math.tan(math.radians(20)) / height) ** 2
        return image * (1 + far) ** (-share / 2)

    return everywhere(change)


def _bent(world: World, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Equal angles, not equal steps, across the image."""
    half = math.atan(math.tan(math.radians(world.fov) / 2) * world.width / world.height)
    there = np.tan((2 * x / world.width - 1) * half) / math.tan(half)
    return rays(world, (there + 1) * world.width / 2, y)


def _not_normalised(world: World, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """The right vector keeps its length: look x up is not normalised."""
    look = (world.at - world.eye) / np.linalg.norm(world.at - world.eye)
    side = np.cross(look, world.up)
    return _wide(float(np.sqrt(dot(side, side))))(world, x, y)


CAMERA = (
    Mistake("half a pixel", "rays through the pixels' corners", "ball", "pixel", _moved(-0.5, -0.5)),
    Mistake("a quarter of a pixel", "to the right", "ball", "pixel", _moved(0.25, 0)),
    Mistake("a pixel down", "rows counted from one", "ball", "pixel", _moved(0, 1)),
    Mistake("a pixel to the right", "columns counted from one", "ball", "pixel", _moved(1, 0)),
    Mistake("over width - 1", "the last pixel's centre is the image's edge", "ball", "rays", _last),
    Mistake(
        "fov 1 degree less",
        "as an integer division of half of it gives",
        "ball",
        "world",
        _fov(lambda world: world.fov - 1),
    ),
    Mistake("fov 0.1 degrees more", "a rounded pi", "ball", "world", _fov(lambda world: world.fov + 0.1)),
    Mistake("fov horizontal", "the angle is taken for the horizontal one", "ball", "world", _fov(_across)),
    Mistake("no aspect", "as if the image were square", "ball", "rays", _square),
    Mistake("aspect 1 % off", "pixels are not square", "ball", "rays", _wide(1.01)),
    Mistake("equal angles", "pixels at equal angles", "ball", "rays", _bent),
    Mistake("right not normalised", "as long as the sine of the angle to up", "ball", "rays", _not_normalised),
    Mistake("mirrored", "left for right", "box", "finished", everywhere(lambda x: x[:, :, ::-1])),
    Mistake("upside down", "rows from below", "ball", "finished", everywhere(lambda x: x[:, ::-1])),
    Mistake("turned by 180 degrees", "both", "ball", "finished", everywhere(lambda x: x[:, ::-1, ::-1])),
    Mistake("rolled by a degree", "about the line of sight", "ball", "world", _rolled(1)),
    Mistake("rolled by a fifth of a degree", "about the line of sight", "ball", "world", _rolled(0.2)),
    Mistake(
        "eye moved", "by 0.02", "ball", "world", lambda world: replace(world, eye=world.eye + np.array([0.02, 0, 0]))
    ),
    Mistake(
        "target moved", "by 0.01", "ball", "world", lambda world: replace(world, at=world.at + np.array([0, 0.01, 0]))
    ),
    Mistake("dark corners", "times the cosine of the pixel's angle", "floor", "finished", _looking(1)),
    Mistake("vignette", "times its fourth power", "floor", "finished", _looking(4)),
)
