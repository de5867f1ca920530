"""Independent passes of Mitsuba's `direct` integrator, summed in float64; runs in the child only.

A pass is one wavefront of `samples` paths a pixel from the `multijitter` sampler under a random 32-bit seed of
its own, averaged in float64. Passes are independent, so that their spread is an honest standard error whatever
the sampler does inside one; multijitter alone makes the mean of a pass 16 to 50 times less noisy than
independent samples where a light is near (measured). Never `mi.render`: its float32 film drifts with the
samples, and the same seed does not give the same bits.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

WAVEFRONT = 1 << 22
"""Paths traced at once."""

Array = NDArray[Any]


def integrator() -> Any:
    """Light sampling alone: with more than one emitter sample Mitsuba 3.9 counts lights without extent n times."""
    return mi.load_dict({"type": "direct", "emitter_samples": 1, "bsdf_samples": 0, "hide_emitters": False})


class Camera:
    """Camera rays of some pixels, at their centres or all over their boxes."""

    def __init__(self, scene: Any, width: int, height: int, boxed: bool) -> None:
        self.sensor = scene.sensors()[0]
        self.width, self.height, self.boxed = width, height, boxed

    def rays(self, pixels: Array, samples: int, sampler: Any) -> Any:
        """``samples`` rays through each of the pixels (row-major indices), one pixel after the other."""
        index = dr.gather(
            mi.UInt32, mi.UInt32(pixels.astype(np.uint32)), dr.arange(mi.UInt32, pixels.size * samples) // samples
        )
        y = index // self.width
        x = index - y * self.width
        offset = sampler.next_2d() if self.boxed else mi.Point2f(0.5)
        place = mi.Point2f((mi.Float(x) + offset.x) / self.width, (mi.Float(y) + offset.y) / self.height)
        ray, _ = self.sensor.sample_ray_differential(0.0, 0.5, place, mi.Point2f(0.5))
        return ray


def make_sampler(seed: int, pixels: int, samples: int) -> Any:
    """A multijitter sampler for ``samples`` paths in each of ``pixels`` pixels."""
    sampler = mi.load_dict({"type": "multijitter", "sample_count": samples})
    sampler.set_samples_per_wavefront(samples)
    sampler.seed(seed, pixels * samples)
    return sampler


def one_pass(scene: Any, camera: Camera, pixels: Array, samples: int, seed: int) -> Array:
    """Mean radiance (3, n) float64 of one pass over the pixels (n,)."""
    direct = integrator()
    wide: Any = dr.float64_array_t(mi.Float)
    out = np.empty((3, pixels.size))
    step = max(1, WAVEFRONT // samples)
    seeds = np.random.SeedSequence(seed).generate_state(1 + (pixels.size - 1) // step)
    for number, start in enumerate(range(0, pixels.size, step)):
        some = pixels[start : start + step]
        sampler = make_sampler(int(seeds[number]), some.size, samples)
        radiance, _, _ = direct.sample(scene, sampler, camera.rays(some, samples, sampler))
        channels = [wide(c) for c in (radiance.x, radiance.y, radiance.z)]
        dr.eval(channels)  # else each block_sum below would trace the paths again
        sums = [dr.block_sum(c, samples) if samples > 1 else c for c in channels]
        dr.eval(sums)
        out[:, start : start + some.size] = np.stack([np.array(s) for s in sums]) / samples
    return out


def shares(
    scene: Any, camera: Camera, pixels: int, samples: int, seed: int
) -> tuple[dict[str, Array], dict[str, Array]]:
    """Share of the rays of each pixel that hit the front of each shape, and either side, by shape id: (n,) each."""
    fronts: dict[str, Array] = {}
    hits: dict[str, Array] = {}
    shapes = scene.shapes()
    step = max(1, WAVEFRONT // samples)
    for start in range(0, pixels, step):
        some = np.arange(start, min(start + step, pixels))
        sampler = make_sampler((seed + start) % 2**32, some.size, samples)
        si = scene.ray_intersect(camera.rays(some, samples, sampler))
        for shape in shapes:
            on = si.is_valid() & (si.shape == mi.ShapePtr(shape))
            for table, mask in ((hits, on), (fronts, on & (si.wi.z > 0))):
                count = dr.select(mask, mi.Float(1), mi.Float(0))
                count = dr.block_sum(count, samples) if samples > 1 else count
                table.setdefault(shape.id(), np.zeros(pixels))[some] = np.array(count, dtype=np.float64) / samples
    return fronts, hits
