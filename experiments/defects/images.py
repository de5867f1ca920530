"""Wrong renderers around a right estimator, and wrong converters of the scene."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from nusselt.renderer.image import Image, render
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats

PLANES = (
    "first",
    "mean",
    "variance",
    "pixel_variance",
    "level_mean",
    "level_variance",
    "emitter",
    "background",
    "unjudged",
)
COLOURS = ("first", "mean", "variance", "level_mean", "level_variance")


def _each(image: Image, names: tuple[str, ...], change: Any) -> Image:
    planes = {name: getattr(image, name) for name in names}
    return dataclasses.replace(image, **{name: change(a) for name, a in planes.items() if a is not None})


def half_pixel(scene: Scene, estimator: Any, **options: Any) -> Image:
    """Rays through the pixels' corners: one pixel more a side shifts all centres by half a pixel."""
    wider = scene.camera.fov_y, math.tan(math.radians(scene.camera.fov_y) / 2) * (scene.height + 1) / scene.height
    camera = dataclasses.replace(scene.camera, fov_y=2 * math.degrees(math.atan(wider[1])))
    larger = scene.with_(width=scene.width + 1, height=scene.height + 1, camera=camera)
    return _each(render(larger, estimator, **options), PLANES, lambda a: a[..., : scene.height, : scene.width])


def other_fov(scene: Scene, estimator: Any, **options: Any) -> Image:
    """Half a degree too wide."""
    camera = dataclasses.replace(scene.camera, fov_y=scene.camera.fov_y + 0.5)
    return render(scene.with_(camera=camera), estimator, **options)


def emission_per_light(scene: Scene, estimator: Any, **options: Any) -> Image:
    """What the camera sees of a light, added once for every light."""
    image = render(scene, estimator, **options)
    often = np.where(image.emitter > 0, len(scene.lights), 1)
    return _each(image, ("first", "mean"), lambda a: a * often)


def mirrored(scene: Scene, estimator: Any, **options: Any) -> Image:
    """Left for right."""
    return _each(render(scene, estimator, **options), PLANES, lambda a: a[..., ::-1])


def swapped_channels(scene: Scene, estimator: Any, **options: Any) -> Image:
    """Blue for red."""
    return _each(render(scene, estimator, **options), COLOURS, lambda a: a[::-1])


def half_floats(scene: Scene, estimator: Any, **options: Any) -> Image:
    """Two hundred passes added up in float16."""

    def added(values: Floats) -> Floats:
        total, step = np.zeros(values.shape, np.float16), values.astype(np.float16)
        for _ in range(200):
            total += step
        return total.astype(np.float64) / 200

    return _each(render(scene, estimator, **options), ("first", "mean"), added)


def transposed(scene: Scene) -> Scene:
    """A converter that writes the axes of ellipsoids row for column."""
    turned = tuple(
        dataclasses.replace(ball, axes=tuple(zip(*ball.axes, strict=True)))  # type: ignore[arg-type]
        for ball in scene.ellipsoids
    )
    return scene.with_(ellipsoids=turned)
