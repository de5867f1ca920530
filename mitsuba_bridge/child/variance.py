"""In the child: the variance of Mitsuba's `direct` per pixel and number of samples, by sampler, and its time.

One light at a time, like ours: all lights are summed and none is chosen. Pixels are the shaded ones; the rest
have no noise. LLVM variants only. Its time counts: like the race it goes without Embree's robust mode.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from . import passes
from .passes import Array
from .scene_dict import scene_dict

Progress = Callable[[int, int], None]


def spread(job: dict[str, Any], folder: Path, progress: Progress) -> dict[str, Array]:
    """For each of the job's settings (sampler, samples, passes): arrays of index k.

    ``mean_k`` and ``variance_k`` (h, w) of one pass's channel average, ``passes_k`` (passes,) its mean over shaded
    pixels, ``seconds_k`` (passes,) of all lights, and if the job wants them ``images_k`` (passes, h, w).
    """
    description = job["description"]
    width, height = description["camera"]["width"], description["camera"]["height"]
    if str(mi.variant()).startswith("scalar"):
        raise RuntimeError("the spread of samplers is measured in the LLVM variants only")
    dark = mi.load_dict(scene_dict(description, folder, (), robust=False), optimize=False)
    camera = passes.Camera(dark, width, height, description["boxed"])
    emitter, background, _ = passes.look(dark, camera, np.arange(width * height), 1, job["seed"], {})
    shaded = np.flatnonzero((emitter == 0) & (background == 0))
    lights = range(len(description["lights"]))
    lit = [mi.load_dict(scene_dict(description, folder, (number,), robust=False)) for number in lights]
    out: dict[str, Array] = {}
    total, done = sum(setting["passes"] for setting in job["settings"]), 0
    for index, setting in enumerate(job["settings"]):
        values, seconds = [], []
        for number in range(setting["passes"]):
            seeds = np.random.SeedSequence([job["seed"], index, number]).generate_state(len(lit))
            started = time.perf_counter()
            image = np.zeros((3, shaded.size))
            for scene, seed in zip(lit, seeds, strict=True):
                image += passes.one_pass(scene, camera, shaded, setting["samples"], int(seed), kind=setting["sampler"])
            seconds.append(time.perf_counter() - started)
            values.append(image.mean(axis=0))
            done += 1
            progress(done, total)
        stack = np.array(values)
        for name, value in (("mean", stack.mean(axis=0)), ("variance", stack.var(axis=0, ddof=1))):
            plane = np.zeros(width * height)
            plane[shaded] = value
            out[f"{name}_{index}"] = plane.reshape(height, width)
        if job.get("images"):
            planes = np.zeros((len(values), width * height))
            planes[:, shaded] = stack
            out[f"images_{index}"] = planes.reshape(-1, height, width)
        out[f"passes_{index}"] = stack.mean(axis=1)
        out[f"seconds_{index}"] = np.array(seconds)
    return out
