"""The reference image, in the child: one light at a time, in independent passes, added in float64.

Mitsuba's `direct` picks one light per sample, which adds noise; alone, each light is cheaper and its passes can
be sized to its own noise. The other lights' bodies stay as black blockers. Pixels that show a light or nothing
take one sample: they have no noise.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from . import passes, scalar_passes
from .passes import Array
from .sample_plan import SIZES, OnePass, Plan, pilot, plan, unseen
from .scene_dict import scene_dict

tracing: Any = scalar_passes if str(mi.variant()).startswith("scalar") else passes

Progress = Callable[[int, int], None]


def _stream(seed: int, light: int, stage: int, number: int) -> int:
    """A random 32-bit seed of its own for every pass: consecutive ones give shifted copies in some samplers."""
    return int(np.random.SeedSequence([seed, light, stage, number]).generate_state(1)[0])


def reference(job: dict[str, Any], folder: Path, progress: Progress) -> dict[str, Array]:
    """All arrays of a reference; see `Reference` for their meaning."""
    description, seed = job["description"], job["seed"]
    width, height = description["camera"]["width"], description["camera"]["height"]
    # Unoptimised: loading merges meshes of one material, and their names with them.
    dark = mi.load_dict(scene_dict(description, folder, None), optimize=False)
    camera = tracing.Camera(dark, width, height, description["boxed"])
    every = np.arange(width * height)
    rays = tracing.BOX_SAMPLES if description["boxed"] else 1
    emission = {f"shape{number}": shape["emission"] for number, shape in enumerate(description["shapes"])}
    emitter, background, glow = tracing.look(dark, camera, every, rays, _stream(seed, 0, 0, 0), emission)
    holes = np.zeros(every.size) if description["boxed"] else tracing.holes(dark, camera, every)
    shaded = np.flatnonzero((emitter < 1) & (background < 1))
    lights = np.flatnonzero(emitter == 1)  # without noise: one sample each
    sources: list[Any] = [_Lit(job, folder, camera, number, shaded) for number in range(len(description["lights"]))]
    mean, variance = np.zeros((3, width * height)), np.zeros((3, width * height))
    pixel_variance = np.zeros(width * height)
    for light in sources:
        mean[:, lights] += tracing.one_pass(light.scene, camera, lights, 1, _stream(seed, light.number, 3, 0))
    # An ordinary surface's emission is seen, and lights nothing: what the camera hits, added.
    if description["boxed"] and any(max(colour) > 0 for colour in emission.values()):
        sources.append(_Glow(dark, camera, len(sources), shaded, seed, emission))
    else:
        mean += glow
    plans = _plans(sources, job, shaded.size)
    total, done = sum(p.passes for p in plans), 0
    judged = (emitter == 0) & (background == 0) & (holes == 0)
    pass_means = np.zeros(job["passes"] if any(p.passes > 2 for p in plans) else 1)
    if judged.any():
        pass_means += mean[:, judged].mean()
    for source, plan_ in zip(sources, plans, strict=True):
        groups: list[list[float]] = [[] for _ in range(pass_means.size)]
        moments = _Moments(shaded.size)
        for number in range(plan_.passes):
            image = source.run(plan_.samples, number, stage=2)
            moments.add(image)
            value = image.mean(axis=0)[judged[shaded]]
            groups[number % pass_means.size].append(float(value.mean()) if value.size else 0.0)
            done += 1
            progress(done, total)
        mean[:, shaded] += moments.mean
        variance[:, shaded] += moments.variance / plan_.passes
        pixel_variance[shaded] += moments.pixel_variance / plan_.passes
        everything = [value for group in groups for value in group]
        pass_means += [np.mean(group) if group else np.mean(everything) for group in groups]
    square = (3, height, width)
    return {
        "mean": mean.reshape(square),
        "standard_error": np.sqrt(variance).reshape(square),
        "pixel_standard_error": np.sqrt(pixel_variance).reshape(height, width),
        "emitter": emitter.reshape(height, width),
        "background": background.reshape(height, width),
        "holes": holes.reshape(height, width),
        "pass_means": pass_means,
        "samples": np.array(max((p.samples * p.passes for p in plans), default=1)),
        "passes": np.array(max((p.passes for p in plans), default=1)),
        "light_samples": np.array([p.samples * p.passes for p in plans[: len(description["lights"])]], dtype=float),
    }


class _Lit:
    """The scene with one light on."""

    def __init__(self, job: dict[str, Any], folder: Path, camera: Any, number: int, shaded: Array) -> None:
        description = job["description"]
        self.scene = mi.load_dict(scene_dict(description, folder, number))
        self.camera, self.number, self.shaded, self.seed = camera, number, shaded, job["seed"]
        light = description["lights"][number]
        self.random = description["boxed"] or max(light.get("radiance", [0.0])) > 0
        """Whether samples can differ. A pilot alone cannot tell: it may miss a slit that the light comes through."""

    def run(self, samples: int, number: int, stage: int) -> Array:
        seed = _stream(self.seed, self.number, stage, number)
        return tracing.one_pass(self.scene, self.camera, self.shaded, samples, seed)


class _Glow:
    """Emission of ordinary surfaces in pixels that are boxes: one more source of noise."""

    random = True

    def __init__(
        self, scene: Any, camera: Any, number: int, shaded: Array, seed: int, emission: dict[str, list[float]]
    ) -> None:
        self.scene, self.camera, self.number, self.shaded = scene, camera, number, shaded
        self.seed, self.emission = seed, emission

    def run(self, samples: int, number: int, stage: int) -> Array:
        seed = _stream(self.seed, self.number, stage, number)
        _, _, glow = tracing.look(self.scene, self.camera, self.shaded, samples, seed, self.emission)
        return np.asarray(glow)


def _staged(source: Any, stage: int) -> OnePass:
    """Passes with the random numbers of one stage (pilots share none with what is kept)."""
    return lambda samples, number: source.run(samples, number, stage)


class _Moments:
    """Mean and variance over passes (3, n), from differences to the first."""

    def __init__(self, count: int) -> None:
        self.count = 0
        self.first = self.total = self.square = np.zeros((3, count))
        self.pixel_square = np.zeros(count)

    def add(self, image: Array) -> None:
        if self.count == 0:
            self.first = image
        step = image - self.first
        self.total = self.total + step
        self.square = self.square + step * step
        self.pixel_square = self.pixel_square + step.mean(axis=0) ** 2
        self.count += 1

    @property
    def mean(self) -> Array:
        return self.first + self.total / self.count

    @property
    def variance(self) -> Array:
        return np.maximum(self.square - self.total**2 / self.count, 0) / max(self.count - 1, 1)

    @property
    def pixel_variance(self) -> Array:
        mean = self.total.mean(axis=0)
        return np.maximum(self.pixel_square - mean**2 / self.count, 0) / max(self.count - 1, 1)


def _plans(sources: list[Any], job: dict[str, Any], pixels: int) -> list[Plan]:
    """Each noisy source gets an equal share of the variance the pooled mean may have."""
    if pixels == 0:
        return [Plan(1, 1) for _ in sources]
    pilots = [pilot(_staged(source, 1), SIZES[0]) for source in sources]
    noisy = sum(p.variance > 0 for p in pilots)
    allowed = (job["target"] * sum(p.mean for p in pilots)) ** 2 / max(noisy, 1)
    return [
        plan(_staged(source, 4), first, allowed, job["passes"], job["max_samples"])
        if first.variance > 0 or not source.random
        else unseen(pixels, job["passes"], job["max_samples"])
        for source, first in zip(sources, pilots, strict=True)
    ]
