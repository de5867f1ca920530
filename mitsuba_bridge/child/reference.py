"""The reference image, in the child: one light at a time, in independent passes, added in float64.

Mitsuba's `direct` picks one light per sample, which adds noise; alone, each light is cheaper and its passes can
be sized to its own noise. The other lights' bodies stay as black blockers. Pixels that show a light or nothing
take one sample: they have no noise.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from . import passes, scalar_passes
from .passes import Array
from .sample_plan import PILOT, SIZES, OnePass, Pilot, Plan, pilot, plan, unseen
from .scene_dict import scene_dict
from .switches import Switches

tracing: Any = scalar_passes if str(mi.variant()).startswith("scalar") else passes

Progress = Callable[[int, int], None]


def _stream(seed: int, light: int, stage: int, number: int) -> int:
    """A random 32-bit seed of its own for every pass: consecutive ones give shifted copies in some samplers."""
    return int(np.random.SeedSequence([seed, light, stage, number]).generate_state(1)[0])


def reference(job: dict[str, Any], folder: Path, progress: Progress) -> dict[str, Array]:
    """All arrays of a reference; see `Reference` for their meaning."""
    deadline = time.monotonic() + job["seconds"]
    description, seed = job["description"], job["seed"]
    width, height = description["camera"]["width"], description["camera"]["height"]
    switches = Switches(description, folder, job.get("own"))
    # Unoptimised: loading merges meshes of one material, and their names with them.
    dark = switches.scene if switches.own else mi.load_dict(scene_dict(description, folder, ()), optimize=False)
    camera = tracing.Camera(dark, width, height, description["boxed"])
    every = np.arange(width * height)
    rays = tracing.BOX_SAMPLES if description["boxed"] else 1
    emission = {f"shape{number}": shape["emission"] for number, shape in enumerate(description["shapes"])}
    emitter, background, glow = tracing.look(dark, camera, every, rays, _stream(seed, 0, 0, 0), emission)
    holes = np.zeros(every.size) if description["boxed"] else tracing.holes(dark, camera, every)
    shaded = np.flatnonzero((emitter < 1) & (background < 1))
    sky = any(light["kind"] == "constant" for light in description["lights"])
    lights = np.flatnonzero((emitter == 1) | (sky & (background == 1)))  # without noise: one sample each
    groups = _groups(description["lights"], description["boxed"])
    sources: list[Any] = [_Lit(switches, camera, n, group, shaded, seed) for n, group in enumerate(groups)]
    mean, variance = np.zeros((3, width * height)), np.zeros((3, width * height))
    pixel_variance = np.zeros(width * height)
    if lights.size:
        for light in sources:
            mean[:, lights] += tracing.one_pass(light.scene, camera, lights, 1, _stream(seed, light.number, 3, 0))
    # An ordinary surface's emission is seen, and lights nothing: what the camera hits, added.
    if description["boxed"] and any(max(colour) > 0 for colour in emission.values()):
        sources.append(_Glow(dark, camera, len(sources), shaded, seed, emission))
    else:
        mean += glow
    asked = _plans(sources, job, shaded.size, deadline)
    plans = _within(asked, sources, deadline - time.monotonic())
    judged = (emitter == 0) & (background == 0) & (holes == 0)
    moments, values = _all_passes(sources, plans, shaded.size, judged[shaded], deadline, progress)
    done = [found.count for found in moments]
    pass_means = _pass_means(values, job["passes"])
    if judged.any():
        pass_means += mean[:, judged].mean()
    for found in moments:
        mean[:, shaded] += found.mean
        variance[:, shaded] += found.variance / found.count
        pixel_variance[shaded] += found.pixel_variance / found.count
    square = (3, height, width)
    return {
        "mean": mean.reshape(square),
        "standard_error": np.sqrt(variance).reshape(square),
        "pixel_standard_error": np.sqrt(pixel_variance).reshape(height, width),
        "emitter": emitter.reshape(height, width),
        "background": background.reshape(height, width),
        "holes": holes.reshape(height, width),
        "pass_means": pass_means,
        "samples": np.array(max((p.samples * n for p, n in zip(plans, done, strict=True)), default=1)),
        "passes": np.array(max(done, default=1)),
        "light_samples": _light_samples(groups, plans, done),
        "share": np.array(sum(done) / sum(p.passes for p in asked) if asked else 1.0),
    }


def _light_samples(groups: list[tuple[int, ...]], plans: list[Plan], done: list[int]) -> Array:
    """Samples a pixel of each light; lights that share a scene share its samples."""
    found = np.ones(sum(map(len, groups)))
    for group, plan_, count in zip(groups, plans, done, strict=False):  # what glows is no light
        found[list(group)] = max(plan_.samples * count // len(group), 1)
    return found


TURNS = 4


def _all_passes(
    sources: list[Any], plans: list[Plan], pixels: int, judged: Array, deadline: float, progress: Progress
) -> tuple[list[_Moments], list[list[float]]]:
    """All passes of all sources, and the mean over judged pixels of each: what the time allows, two at least.

    The sources take turns, a quarter of their passes each, so that all are done in some measure when the time is up.
    """
    moments, values = [_Moments(pixels) for _ in plans], [list[float]() for _ in plans]
    turns = sorted(
        (TURNS * number // plan_.passes, index, number)
        for index, plan_ in enumerate(plans)
        for number in range(plan_.passes)
    )
    progress(0, len(turns))  # from here on the rate of passes is known
    for done, (_, index, number) in enumerate(turns):
        if number >= 2 and time.monotonic() > deadline:
            continue
        image = sources[index].run(plans[index].samples, number, stage=2)
        moments[index].add(image)
        value = image.mean(axis=0)[judged]
        values[index].append(float(value.mean()) if value.size else 0.0)
        progress(done + 1, len(turns))
    return moments, values


def _pass_means(values: list[list[float]], passes: int) -> Array:
    """The sources' passes added up to ``passes`` passes, or as many as each random source has."""
    count = min((len(some) for some in values if len(some) > 2), default=1)
    found = np.zeros(min(count, passes))
    for some in values:
        groups = [some[k :: found.size] for k in range(found.size)]
        found += [np.mean(group) if group else np.mean(some) for group in groups]
    return found


MOST_APART = 12
"""Lights that are lit one by one. More of them, with an extent, go in so many groups: Mitsuba picks one of a group's
lights a sample, by a stratified number, which is less noise than many small passes take time."""


def _groups(lights: list[dict[str, Any]], boxed: bool) -> list[tuple[int, ...]]:
    """The numbers of the lights that are lit together. Those without extent have no noise, and stay alone."""
    wide = [number for number, light in enumerate(lights) if boxed or "radiance" in light]
    if len(wide) <= MOST_APART:
        return [(number,) for number in range(len(lights))]
    alone = [(number,) for number in range(len(lights)) if number not in set(wide)]
    return [*(tuple(wide[k::MOST_APART]) for k in range(MOST_APART)), *alone]


class _Lit:
    """The scene with a light on, or some."""

    def __init__(
        self, switches: Switches, camera: Any, number: int, lit: tuple[int, ...], shaded: Array, seed: int
    ) -> None:
        self.switches, self.lit = switches, lit
        self.camera, self.number, self.shaded, self.seed = camera, number, shaded, seed
        lights = [switches.description["lights"][each] for each in lit]
        boxed = switches.description["boxed"]
        self.random = boxed or any(max(light.get("radiance", [0.0])) > 0 for light in lights)
        """Whether samples can differ. A pilot alone cannot tell: it may miss a slit that the light comes through."""
        self.seconds: dict[int, float] = {}
        """The shortest time of a pass, by its samples."""

    @property
    def scene(self) -> Any:
        return self.switches.lighting(self.lit)

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
        self.seconds: dict[int, float] = {}

    def run(self, samples: int, number: int, stage: int) -> Array:
        seed = _stream(self.seed, self.number, stage, number)
        _, _, glow = tracing.look(self.scene, self.camera, self.shaded, samples, seed, self.emission)
        return np.asarray(glow)


def _staged(source: Any, stage: int) -> OnePass:
    """Passes with the random numbers of one stage (pilots share none with what is kept), and their time."""

    def one_pass(samples: int, number: int) -> Array:
        started = time.monotonic()
        image = source.run(samples, number, stage)
        now = time.monotonic() - started
        source.seconds[samples] = min(now, source.seconds.get(samples, now))  # the first compiles
        return np.asarray(image)

    return one_pass


def _forecast(source: Any, samples: int) -> float:
    """Seconds of a pass, from the largest that was timed."""
    known = max((size for size in source.seconds if size <= samples), default=0)
    return source.seconds[known] * samples / known if known else 0.0


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


def _plans(sources: list[Any], job: dict[str, Any], pixels: int, deadline: float) -> list[Plan]:
    """Each noisy source gets an equal share of the variance the pooled mean may have, and of the time."""
    if pixels == 0:
        return [Plan(1, 1) for _ in sources]
    pilots = [pilot(_staged(source, 1), SIZES[0]) for source in sources]
    noisy = max(sum(p.variance > 0 for p in pilots), 1)
    allowed = (job["target"] * sum(p.mean for p in pilots)) ** 2 / noisy
    seconds = (deadline - time.monotonic()) / noisy

    def planned(source: Any, first: Pilot) -> Plan:
        if first.variance == 0 and source.random:
            return unseen(pixels, job["passes"], job["max_samples"])

        def affordable(samples: int) -> bool:
            return _forecast(source, samples) * (job["passes"] + PILOT) < seconds

        return plan(_staged(source, 4), first, allowed, job["passes"], job["max_samples"], affordable)

    return [planned(source, first) for source, first in zip(sources, pilots, strict=True)]


def _within(plans: list[Plan], sources: list[Any], seconds: float) -> list[Plan]:
    """The plans, or fewer passes where they would take longer than there is time."""

    def forecast() -> float:
        return sum(_forecast(source, p.samples) * p.passes for source, p in zip(sources, plans, strict=True))

    if forecast() <= seconds:
        return plans
    for source, p in zip(sources, plans, strict=True):  # from small passes it is too long: they take their time too
        if p.samples not in source.seconds:
            _staged(source, 5)(p.samples, 0)
    return [p.within(seconds / forecast()) for p in plans]
