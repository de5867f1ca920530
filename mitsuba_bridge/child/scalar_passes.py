"""The passes of `passes`, where only the scalar variant runs: slower, and for diffuse scenes.

Mitsuba has no sensor that shoots through pixel centres; a `batch` of `radiancemeter`s, one a pixel, does. For
pixels that are boxes its own camera and box filter do. Renders stay short enough for the film's float32 (256
samples: 3e-6), and are added in float64.
"""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from .holes import slips_through

Array = NDArray[Any]

LONGEST = 256
"""Samples in one render."""
BOX_SAMPLES = 64
"""Rays a pixel's box is classified with, one by one in Python."""


class Camera:
    """Camera rays of some pixels; the meters of the last set asked for are kept."""

    def __init__(self, scene: Any, width: int, height: int, boxed: bool) -> None:
        self.sensor = scene.sensors()[0]
        self.width, self.height, self.boxed = width, height, boxed
        self._kept: tuple[Array, Any] | None = None

    def ray(self, pixel: int, x: float = 0.5, y: float = 0.5) -> Any:
        """The ray through a place in the pixel's box."""
        row, column = divmod(int(pixel), self.width)
        place = mi.Point2f((column + float(x)) / self.width, (row + float(y)) / self.height)
        ray, _ = self.sensor.sample_ray(0.0, 0.5, place, mi.Point2f(0.5))
        return ray

    def meters(self, pixels: Array) -> Any:
        """A sensor whose film has one column for each of the pixels (n,)."""
        if self._kept is not None and np.array_equal(self._kept[0], pixels):
            return self._kept[1]
        film = {"type": "hdrfilm", "width": int(pixels.size), "height": 1, "rfilter": {"type": "box"}}
        film |= {"component_format": "float32", "pixel_format": "rgb"}
        found: dict[str, Any] = {"type": "batch", "film": film, "sampler": {"type": "multijitter"}}
        for number, pixel in enumerate(pixels):
            ray = self.ray(pixel)
            found[f"meter{number:07d}"] = {
                "type": "radiancemeter",
                "origin": list(ray.o),
                "direction": list(ray.d),
                "film": {"type": "hdrfilm", "width": 1, "height": 1, "rfilter": {"type": "box"}},
            }
        sensor = mi.load_dict(found)
        self._kept = (pixels, sensor)
        return sensor


def one_pass(scene: Any, camera: Camera, pixels: Array, samples: int, seed: int) -> Array:
    """Mean radiance (3, n) float64 of one pass over the pixels (n,)."""
    total = np.zeros((3, pixels.size))
    if pixels.size == 0:
        return total  # a batch without meters is refused
    direct = mi.load_dict({"type": "direct", "emitter_samples": 1, "bsdf_samples": 0, "hide_emitters": False})
    sensor = camera.sensor if camera.boxed else camera.meters(pixels)
    parts = -(-samples // LONGEST)
    for seed_ in np.random.SeedSequence(seed).generate_state(parts):
        image = mi.render(scene, sensor=sensor, integrator=direct, spp=samples // parts, seed=int(seed_))
        values = np.array(image, dtype=np.float64).reshape(-1, 3).T
        total += values[:, pixels] if camera.boxed else values
    return total / parts


def look(
    scene: Any, camera: Camera, pixels: Array, samples: int, seed: int, emission: dict[str, list[float]]
) -> tuple[Array, Array, Array]:
    """What the camera rays of the pixels (n,) hit; see `passes.look`."""
    emitter, background, glow = np.zeros(pixels.size), np.zeros(pixels.size), np.zeros((3, pixels.size))
    seen = {name: np.array(colour) for name, colour in emission.items() if max(colour) > 0}
    rng = np.random.default_rng(seed)
    for column, pixel in enumerate(pixels):
        for x, y in rng.random((samples, 2)) if camera.boxed else [(0.5, 0.5)] * samples:
            si = scene.ray_intersect(camera.ray(pixel, x, y))
            if not si.is_valid():
                background[column] += 1
                continue
            name = si.shape.id()
            emitter[column] += name.startswith("light")
            if name in seen and si.wi.z > 0:
                glow[:, column] += seen[name]
    return emitter / samples, background / samples, glow / samples


def holes(scene: Any, camera: Camera, pixels: Array) -> Array:
    """Pixels whose ray slips through a surface; see `passes.holes`."""
    return np.array([float(slips_through(scene, camera.ray(pixel))) for pixel in pixels])
