"""How noisy Mitsuba's own image is: its variance per pixel for a sampler and a number of samples."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats

from .description import describe
from .llvm import Backend, backend
from .reference import ReferenceUnavailable, ask
from .temporary import temporary_folder

SAMPLERS = ("independent", "stratified", "multijitter", "ldsampler")
"""Mitsuba's, by its own names, that take any power of four; its `orthogonal` takes squares of primes alone."""


@dataclass(frozen=True)
class Setting:
    """One sampler at one number of samples a pixel and light, repeated."""

    sampler: str
    samples: int
    passes: int


@dataclass(frozen=True)
class Spread:
    """What the passes of one setting say.

    Parameters
    ----------
    mean, variance : (h, w) float64
        Of one pass's channel average, over passes; 0 at pixels that are not shaded.
    pass_means : (passes,) float64
        Over the shaded pixels.
    seconds : (passes,) float64
        Of each pass, all lights together; the first compiles.
    images : (passes, h, w) float64, optional
        Every pass.
    """

    mean: Floats
    variance: Floats
    pass_means: Floats
    seconds: Floats
    images: Floats | None = None


def measure_spread(
    scene: Scene,
    settings: Sequence[Setting],
    *,
    seed: int,
    timeout: float,
    images: bool = False,
    running: Backend | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[Spread]:
    """Render a scene under each setting.

    Parameters
    ----------
    images : bool
        Hand back every pass too.

    Raises
    ------
    ReferenceUnavailable
        If Mitsuba's LLVM variant cannot run here, or fails.
    """
    running = running or backend()
    if running.variant.startswith("scalar"):
        raise ReferenceUnavailable(f"the variance of Mitsuba's samplers needs LLVM: {running.sentence}")
    with temporary_folder() as name:
        folder = Path(name)
        job = {
            "task": "spread",
            "description": describe(scene, folder).as_json(),
            "seed": seed,
            "images": images,
            "settings": [asdict(setting) for setting in settings],
        }
        arrays, _ = ask(job, folder, running, timeout, progress)
    try:
        return [
            Spread(
                mean=arrays[f"mean_{k}"],
                variance=arrays[f"variance_{k}"],
                pass_means=arrays[f"passes_{k}"],
                seconds=arrays[f"seconds_{k}"],
                images=arrays.get(f"images_{k}"),
            )
            for k in range(len(settings))
        ]
    except KeyError as error:
        raise ReferenceUnavailable(f"Mitsuba's process gave no {error}") from error
