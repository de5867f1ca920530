"""The passes of `passes`, where only the scalar variant runs: slower, for diffuse scenes at pixel centres.

Mitsuba has no sensor that shoots through pixel centres; a `batch` of `radiancemeter`s, one a pixel, does.
Passes stay short enough for the film's float32 (256 samples: 3e-6), and are added in float64.
"""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

LONGEST = 256


def _centre_ray(sensor: Any, pixel: int, width: int, height: int) -> Any:
    y, x = divmod(int(pixel), width)
    ray, _ = sensor.sample_ray(0.0, 0.5, mi.Point2f((x + 0.5) / width, (y + 0.5) / height), mi.Point2f(0.5))
    return ray


class Camera:
    """Camera rays through the centres of some pixels; the meters of the last set asked for are kept."""

    def __init__(self, scene: Any, width: int, height: int, boxed: bool) -> None:
        if boxed:
            raise RuntimeError("pixels that are boxes (spp above 1) need Mitsuba's LLVM variant")
        self.sensor = scene.sensors()[0]
        self.width, self.height = width, height
        self._kept: tuple[Array, Any] | None = None

    def ray(self, pixel: int) -> Any:
        return _centre_ray(self.sensor, pixel, self.width, self.height)

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
    direct = mi.load_dict({"type": "direct", "emitter_samples": 1, "bsdf_samples": 0, "hide_emitters": False})
    meters = camera.meters(pixels)
    parts = -(-samples // LONGEST)
    seeds = np.random.SeedSequence(seed).generate_state(parts)
    total = np.zeros((3, pixels.size))
    for number in range(parts):
        image = mi.render(scene, sensor=meters, integrator=direct, spp=samples // parts, seed=int(seeds[number]))
        total += np.array(image, dtype=np.float64)[0].T
    return total / parts


def shares(
    scene: Any, camera: Camera, pixels: int, samples: int, seed: int
) -> tuple[dict[str, Array], dict[str, Array]]:
    """Which pixels' rays hit the front of each shape, and either side, by shape id: (n,) of 0 or 1 each."""
    fronts = {shape.id(): np.zeros(pixels) for shape in scene.shapes()}
    hits = {name: np.zeros(pixels) for name in fronts}
    for pixel in range(pixels):
        si = scene.ray_intersect(camera.ray(pixel))
        if si.is_valid():
            hits[si.shape.id()][pixel] = 1.0
            fronts[si.shape.id()][pixel] = float(si.wi.z > 0)
    return fronts, hits
