"""Mitsuba's error against its time: the best it can do, not what it does by default.

Only Embree's robust mode is left off, as it is for everybody who does not know of it: it takes 8 to 20 % more time
(the Cornell box, with AVX-512 and with AVX2).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats

from .description import describe
from .llvm import Backend, backend
from .process import ReferenceUnavailable
from .reference import ask
from .temporary import temporary_folder


@dataclass(frozen=True)
class Way:
    """A way of running Mitsuba's `direct`.

    Parameters
    ----------
    sampler : str
    bsdf_samples : {0, 1}
        0: light sampling alone; 1: with the surface's, by multiple importance sampling.
    """

    sampler: str
    bsdf_samples: int

    @property
    def name(self) -> str:
        return f"{'emitter+BSDF' if self.bsdf_samples else 'emitter'}, {self.sampler}"


AT_ONCE = 1 << 28
"""Samples of one image that are traced at once: more, with their samplers' states, may not fit into memory."""
WAYS = tuple(Way(sampler, n) for n in (0, 1) for sampler in ("multijitter", "independent", "ldsampler", "orthogonal"))
DEFAULT = Way("independent", 1)
"""What Mitsuba does when it is not told otherwise."""


@dataclass(frozen=True)
class Lap:
    """One image: its samples a pixel, seconds, relative RMS error, and seconds of all processors."""

    way: Way
    samples: int
    seconds: float
    error: float
    processor: float = math.nan


@dataclass(frozen=True)
class Race:
    """All laps of one run of Mitsuba; what is paid once, apart.

    Parameters
    ----------
    laps : tuple of Lap
    once : dict
        Seconds to import, to build the scene, and for each configuration's first image; of all processors for all.
    version, variant : str
    """

    laps: tuple[Lap, ...]
    once: dict[str, Any]
    version: str
    variant: str


def ladder(way: Way, sizes: tuple[int, ...]) -> list[int]:
    """Samples a pixel that fill the sampler's pattern: orthogonal arrays have the square of a prime."""
    primes = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59, 61, 67, 89, 127]
    if way.sampler != "orthogonal":
        return list(sizes)
    return [min((p * p for p in primes), key=lambda square: abs(np.log(square / size))) for size in sizes]


def run_race(
    scene: Scene,
    truth: Floats,
    judged: Any,
    *,
    sizes: tuple[int, ...],
    seed: int,
    ways: tuple[Way, ...] = WAYS,
    longest: float = 10.0,
    enough: float = 0.0,
    timeout: float = 900.0,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    running: Backend | None = None,
) -> Race:
    """Have Mitsuba render a scene in every way with more and more samples.

    Parameters
    ----------
    scene : Scene
        ``spp`` above 1: pixels by area; else their centres.
    truth : (3, h, w) float64
    judged : (h, w) bool
        Pixels whose errors count.
    sizes : tuple of int
        Samples a pixel.
    longest : float
        Seconds that one image may be expected to take.
    enough : float
        Error from which no more samples are tried.
    threads : int, optional
        As many as there are processors, unless it says otherwise.

    Raises
    ------
    ReferenceUnavailable
        If Mitsuba's LLVM variant does not run here: its other ones are no match.
    """
    running = running or backend()
    if running.variant == "scalar_rgb":
        raise ReferenceUnavailable(f"a race needs Mitsuba's LLVM variant: {running.sentence}")
    sizes_of = [ladder(way, sizes) for way in ways]
    with temporary_folder() as name:
        folder = Path(name)
        np.savez(folder / "truth.npz", truth=truth, judged=np.asarray(judged, dtype=np.float64))
        job = {
            "task": "race",
            "description": describe(scene, folder).as_json(),
            "truth": "truth.npz",
            "ways": [asdict(way) for way in ways],
            "sizes": sizes_of,
            "seed": seed,
            "longest": longest,
            "enough": enough,
            "at_once": AT_ONCE,
            "threads": threads or 0,
        }
        arrays, told = ask(job, folder, running, timeout, progress, fresh=True)
    laps = [
        Lap(way, samples, *(float(arrays[name][i, j]) for name in ("seconds", "errors", "processor")))
        for i, (way, samples_of) in enumerate(zip(ways, sizes_of, strict=True))
        for j, samples in enumerate(samples_of)
        if np.isfinite(arrays["seconds"][i, j])
    ]
    once = {"import": told["seconds"]["import"], "scene": float(arrays["built"]), "used": float(arrays["used"])}
    once["first images"] = {way.name: row.tolist() for way, row in zip(ways, arrays["first"], strict=True)}
    return Race(tuple(laps), once, str(told["version"]), str(told["variant"]))
