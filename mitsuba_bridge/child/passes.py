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

from .holes import slips_through

WAVEFRONT = 1 << 22
"""Paths traced at once."""

BOX_SAMPLES = 1024
"""Rays a pixel's box is classified with."""

Array = NDArray[Any]


def integrator(bsdf_samples: int = 0) -> Any:
    """Light sampling alone, or with ``bsdf_samples`` by multiple importance sampling.

    One emitter sample: with more Mitsuba 3.9 counts lights without extent n times.
    """
    found = {"type": "direct", "emitter_samples": 1, "bsdf_samples": bsdf_samples, "hide_emitters": False}
    return mi.load_dict(found)


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


def make_sampler(seed: int, pixels: int, samples: int, kind: str = "multijitter") -> Any:
    """A sampler, Mitsuba's name for it, for ``samples`` paths in each of ``pixels`` pixels."""
    sampler = mi.load_dict({"type": kind, "sample_count": samples})
    sampler.set_samples_per_wavefront(samples)
    sampler.seed(seed, pixels * samples)
    return sampler


def pixel_sums(values: list[Any], samples: int) -> Array:
    """Sums of float32 values over the samples of each pixel, in float64: (len(values), n)."""
    float64: Any = dr.float64_array_t(mi.Float)
    wide = [float64(value) for value in values]
    dr.eval(wide)  # else each block_sum below would trace the paths again
    sums = [dr.block_sum(value, samples) if samples > 1 else value for value in wide]
    dr.eval(sums)
    return np.stack([np.array(value) for value in sums])


def one_pass(
    scene: Any,
    camera: Camera,
    pixels: Array,
    samples: int,
    seed: int,
    bsdf_samples: int = 0,
    kind: str = "multijitter",
) -> Array:
    """Mean radiance (3, n) float64 of one pass over the pixels (n,)."""
    direct = integrator(bsdf_samples)
    out = np.empty((3, pixels.size))
    step = max(1, WAVEFRONT // samples)
    seeds = np.random.SeedSequence(seed).generate_state(1 + max(pixels.size - 1, 0) // step)
    for number, start in enumerate(range(0, pixels.size, step)):
        some = pixels[start : start + step]
        sampler = make_sampler(int(seeds[number]), some.size, samples, kind)
        radiance, _, _ = direct.sample(scene, sampler, camera.rays(some, samples, sampler))
        out[:, start : start + some.size] = pixel_sums([radiance.x, radiance.y, radiance.z], samples) / samples
    return out


def look(
    scene: Any, camera: Camera, pixels: Array, samples: int, seed: int, emission: dict[str, list[float]]
) -> tuple[Array, Array, Array]:
    """What the camera rays of the pixels (n,) hit.

    Parameters
    ----------
    scene : mi.Scene
        Loaded unoptimised: merged meshes have lost their names.
    emission : dict
        By shape id, the radiance seen from the front of what emits and is no light.

    Returns
    -------
    emitter, background : (n,) float64
        Share of the rays that hit either side of a light's body, or nothing.
    glow : (3, n) float64
        Mean of that radiance.
    """
    number_of: Any = lambda pointers: dr.reinterpret_array(mi.UInt32, pointers)  # noqa: E731
    shapes = {int(number_of(mi.ShapePtr(shape))[0]): shape.id() for shape in scene.shapes()}
    table = np.zeros((4, 1 + max(shapes, default=0)), dtype=np.float32)
    for number, name in shapes.items():
        table[:3, number], table[3, number] = emission.get(name, 0.0), name.startswith("light")
    light, *glows = (mi.Float(row) for row in table[[3, 0, 1, 2]])
    sums = np.empty((5, pixels.size))
    step = max(1, WAVEFRONT // samples)
    seeds = np.random.SeedSequence(seed).generate_state(1 + max(pixels.size - 1, 0) // step)
    for number, start in enumerate(range(0, pixels.size, step)):
        some = pixels[start : start + step]
        sampler = make_sampler(int(seeds[number]), some.size, samples)
        si = scene.ray_intersect(camera.rays(some, samples, sampler))
        hit, front = si.is_valid(), si.is_valid() & (si.wi.z > 0)
        index = number_of(si.shape)
        found = [dr.gather(mi.Float, light, index, hit), dr.select(hit, mi.Float(0), mi.Float(1))]
        found += [dr.gather(mi.Float, glow, index, front) for glow in glows]
        sums[:, start : start + some.size] = pixel_sums(found, samples)
    emitter, background, *glow = sums / samples
    return emitter, background, np.stack(glow)


def holes(scene: Any, camera: Camera, pixels: Array) -> Array:
    """Which of the pixels (n,) have a ray through their centre that slips through a surface: 1.0 or 0.0."""
    out = np.empty(pixels.size)
    for start in range(0, pixels.size, WAVEFRONT):
        some = pixels[start : start + WAVEFRONT]
        out[start : start + some.size] = slips_through(scene, camera.rays(some, 1, None))
    return out
