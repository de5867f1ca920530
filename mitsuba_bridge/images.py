"""Images of single passes by Mitsuba, with the noise that somebody's Mitsuba has: not references."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats

from .description import describe
from .llvm import Backend, backend
from .process import ReferenceUnavailable
from .reference import ask
from .temporary import temporary_folder


def mitsuba_images(
    scene: Scene, samples: int, seeds: Sequence[int], *, sampler: str, timeout: float, running: Backend | None = None
) -> Floats:
    """Images (k, 3, h, w), one a seed, by Mitsuba's `direct`, which picks one light for each sample.

    Parameters
    ----------
    samples : int
        A pixel.
    sampler : str
        One of `variance.SAMPLERS`.
    timeout : float
        Seconds, for all of them.

    Raises
    ------
    ReferenceUnavailable
        If Mitsuba's LLVM variant cannot run here, or fails.
    """
    running = running or backend()
    if running.variant.startswith("scalar"):
        raise ReferenceUnavailable(f"images by Mitsuba's samplers need LLVM: {running.sentence}")
    with temporary_folder() as name:
        folder = Path(name)
        job = {
            "task": "images",
            "description": describe(scene, folder).as_json(),
            "samples": samples,
            "seeds": [int(seed) for seed in seeds],
            "sampler": sampler,
        }
        arrays, _ = ask(job, folder, running, timeout)
    if "images" not in arrays or arrays["images"].shape[1:] != (3, scene.height, scene.width):
        raise ReferenceUnavailable("Mitsuba's process gave no images of the scene's size")
    return arrays["images"]
