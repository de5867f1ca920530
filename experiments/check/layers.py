"""An image of ours with every light's share of it, as layers."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor

from nusselt.experiments.results.layers import Layers, image_layers, scene_layers
from nusselt.renderer.image import Image
from nusselt.renderer.scene import Scene

from .draw import Drawing, draw

LIGHTS = 24
"""Lights that have a layer each, at most: readers count channels."""


def drawn_layers(scene: Scene, image: Image, drawing: Drawing, executor: Executor | None = None) -> Layers:
    """All layers of an image that was drawn, with each light's share of it where there are 2 to 24 lights.

    There it alone shines; the others are black and stand where they stood, so that its random numbers are its own.
    Where an error is asked for, each is sampled to that.
    """
    found = image_layers(image) | scene_layers(scene)
    if 1 < len(scene.lights) <= LIGHTS:
        found |= {
            f"light{k}": draw(alone, drawing, executor).image.mean for k, alone in enumerate(_each_alone(scene), 1)
        }
    return found


def _each_alone(scene: Scene) -> Iterator[Scene]:
    for k in range(len(scene.lights)):
        lights = (light if k == n else light.with_colour((0.0, 0.0, 0.0)) for n, light in enumerate(scene.lights))
        yield scene.with_(lights=tuple(lights))
