"""Irradiance at points of a scene, light by light, as Mitsuba's light sampling and shadow rays find it; child only."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from .patch_irradiance import strata
from .switches import Switches

LANES = 1 << 21
"""Samples traced at once."""

Array = NDArray[Any]


def _places(position: Array, normal: Array, samples: int) -> Any:
    """Interactions: each sensor ``samples`` times."""
    found = dr.zeros(mi.SurfaceInteraction3f, position.shape[1] * samples)
    found.p = mi.Point3f(np.repeat(position, samples, axis=1).astype(np.float32))
    found.n = mi.Normal3f(np.repeat(normal, samples, axis=1).astype(np.float32))
    found.sh_frame = mi.Frame3f(mi.Vector3f(found.n))
    return found


def _one_pass(scene: Any, place: Any, sensors: int, samples: int, rng: np.random.Generator) -> tuple[Array, ...]:
    """Mean, and the mean and largest of what a sample brings if nothing blocks, (3, n) each."""
    at = strata(sensors, samples, rng)
    sample, bare = scene.sample_emitter_direction(place, at, False)
    _, found = scene.sample_emitter_direction(place, at, True)
    cosine = dr.maximum(dr.dot(mi.Vector3f(place.n), sample.d), 0)
    value, most = (np.array(weight * cosine, dtype=np.float64).reshape(3, sensors, -1) for weight in (found, bare))
    return value.mean(axis=2), most.mean(axis=2), most.max(axis=2)


def sensors(job: dict[str, Any], folder: Path, progress: Callable[[int, int], None]) -> dict[str, Array]:
    """``mean``, ``standard_error``, ``unoccluded`` and ``grain`` (3, n) of the job's sensors."""
    description, passes = job["description"], job["passes"]
    position, normal = (np.array(job[name], dtype=np.float64) for name in ("position", "normal"))
    count, lights = position.shape[1], description["lights"]
    means, grain, bare = np.zeros((passes, 3, count)), np.zeros((3, count)), np.zeros((3, count))
    side = max(1, LANES // job["samples"])
    switches = Switches(description, folder)
    for number, light in enumerate(lights):
        scene = switches.lighting((number,))
        delta = "radiance" not in light  # one sample settles it
        samples, repeats = (1, 1) if delta else (job["samples"], passes)
        rng = np.random.default_rng(np.random.SeedSequence(job["seed"], spawn_key=(number,)))
        for start in range(0, count, side):
            part = slice(start, start + side)
            place = _places(position[:, part], normal[:, part], samples)
            for k in range(repeats):
                mean, free, largest = _one_pass(scene, place, position[:, part].shape[1], samples, rng)
                means[slice(None) if delta else k, :, part] += mean
                bare[:, part] += free / repeats
                if not delta:
                    grain[:, part] = np.maximum(grain[:, part], largest / (samples * passes))
        progress(number + 1, len(lights))
    error = means.std(axis=0, ddof=1) / math.sqrt(passes)
    return {"mean": means.mean(axis=0), "standard_error": error, "unoccluded": bare, "grain": grain}
