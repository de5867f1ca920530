"""An image of ours with every light's share of it, as layers."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import replace

import numpy as np

from nusselt.experiments.results.layers import Layers, all_layers
from nusselt.renderer.image import Image
from nusselt.renderer.scene import Scene
from nusselt.renderer.tile import LIGHTS
from nusselt.renderer.vectors import Floats

from .draw import Drawing, draw


def drawn_layers(
    scene: Scene, image: Image, drawing: Drawing, executor: Executor | None = None
) -> tuple[Layers, tuple[str, ...]]:
    """All layers of an image that was drawn, and which were left out and why.

    Where the image does not have its lights' shares (pixels by area or interpolated), each of 2 to 24 lights is drawn
    alone: the others are black and stand where they stood.
    """
    if image.light_means is None and 1 < len(scene.lights) <= LIGHTS:
        alone = [draw(_lit_by(scene, k), drawing, executor).image.mean for k in range(len(scene.lights))]
        rest: Floats = np.zeros(image.mean.shape)
        if any(any(material.emission) for material in scene.materials):
            rest = draw(_lit_by(scene), drawing, executor).image.mean
        image = replace(image, light_means=np.array([*(mean - rest for mean in alone), rest], dtype=np.float32))
    return all_layers(image, scene)


def _lit_by(scene: Scene, *which: int) -> Scene:
    lights = (light if n in which else light.with_colour((0.0, 0.0, 0.0)) for n, light in enumerate(scene.lights))
    return scene.with_(lights=tuple(lights))
