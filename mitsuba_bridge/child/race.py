"""Mitsuba's error against its time, in the child: every way of running `direct`, more and more samples.

Pixels by area are `mi.render`'s own, with a box filter, which is Mitsuba at its fastest; pixel centres go through
`passes`. Each size runs once apart, unless that took long already: kernels are compiled for it. A time ends when
the image lies in NumPy's memory, since Dr.Jit returns long before its work is done. The scene is without Embree's
robust mode, which the reference needs: nobody's Mitsuba has it by default.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from . import passes
from .passes import Array
from .scene_dict import EVERY, scene_dict, sensor_dict

Progress = Callable[[int, int], None]
Draw = Callable[[int, int], Array]
"""(samples a pixel, seed) to radiance (3, h, w)."""

LONG = 5.0
"""Seconds beyond which compiling no longer counts."""


def race(job: dict[str, Any], folder: Path, progress: Progress) -> dict[str, Array]:
    """Seconds, processors' seconds and errors: arrays (configurations, sizes), NaN where a size was left out.

    A configuration's next size is left out when it would take longer than the job's ``longest`` seconds, or when the
    last one's error was ``enough``.
    """
    description, ways, sizes = job["description"], job["ways"], job["sizes"]
    if job["threads"]:
        dr.set_thread_count(job["threads"])
    started = time.perf_counter()
    scene = mi.load_dict(scene_dict(description, folder, EVERY, robust=False))
    built = time.perf_counter() - started
    with np.load(folder / job["truth"], allow_pickle=False) as kept:
        truth, judged = kept["truth"], kept["judged"].astype(bool)
    norm = float((truth[:, judged] ** 2).sum())
    shape = len(ways), max(map(len, sizes))
    seconds, errors, first, processor = (np.full(shape, np.nan) for _ in range(4))
    for number, (way, ladder) in enumerate(zip(ways, sizes, strict=True)):
        camera = description["camera"]
        draw = _in_parts(_draw(scene, description, way), max(1, job["at_once"] // (camera["width"] * camera["height"])))
        for rank, samples in enumerate(ladder):
            if rank and seconds[number, rank - 1] * samples / ladder[rank - 1] > job["longest"]:
                break
            seed = int(np.random.SeedSequence([job["seed"], number, rank]).generate_state(1)[0])
            image, first[number, rank], processor[number, rank] = _timed(draw, samples, seed)
            seconds[number, rank] = first[number, rank]
            if first[number, rank] < LONG:
                image, seconds[number, rank], processor[number, rank] = _timed(draw, samples, seed)
            errors[number, rank] = np.sqrt(((image - truth)[:, judged] ** 2).sum() / norm)
            if errors[number, rank] <= job["enough"]:
                break
        progress(number + 1, len(ways))
    found = {"seconds": seconds, "errors": errors, "first": first, "processor": processor}
    return found | {"built": np.array(built), "used": np.array(time.process_time())}


def _in_parts(draw: Draw, most: int) -> Draw:
    """Images of many samples as the mean of several of as many as fit into memory."""

    def drawn(samples: int, seed: int) -> Array:
        if samples <= most:
            return draw(samples, seed)
        count = -(-samples // most)
        seeds = np.random.SeedSequence(seed).generate_state(count)
        return np.mean([draw(samples // count, int(one)) for one in seeds], axis=0)

    return drawn


def _timed(draw: Draw, samples: int, seed: int) -> tuple[Array, float, float]:
    started, used = time.perf_counter(), time.process_time()
    image = draw(samples, seed)
    return image, time.perf_counter() - started, time.process_time() - used


def _draw(scene: Any, description: dict[str, Any], way: dict[str, Any]) -> Draw:
    camera = description["camera"]
    width, height = camera["width"], camera["height"]
    if not description["boxed"]:
        rays, every = passes.Camera(scene, width, height, False), np.arange(width * height)

        def centres(samples: int, seed: int) -> Array:
            image = passes.one_pass(scene, rays, every, samples, seed, way["bsdf_samples"], way["sampler"])
            return image.reshape(3, height, width)

        return centres
    direct = passes.integrator(way["bsdf_samples"])
    sensor = mi.load_dict(sensor_dict(camera) | {"sampler": {"type": way["sampler"], "sample_count": 4}})

    def areas(samples: int, seed: int) -> Array:
        image = mi.render(scene, sensor=sensor, integrator=direct, spp=samples, seed=seed)
        return np.array(image, dtype=np.float64).transpose(2, 0, 1)

    return areas
