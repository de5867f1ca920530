"""The reference: what Mitsuba's `direct` integrator says of a scene, with its standard error."""

from __future__ import annotations

import math
import time
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from nusselt.renderer.image import Image
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Bools, Floats

from .description import describe
from .llvm import Backend, backend
from .origin import own_file
from .process import ReferenceUnavailable
from .standing import run_job
from .temporary import LEAST, temporary_folder
from .ties import tied

TIME = 0.8
"""Share of the time allowed that passes are planned for; the rest is for starting, and for the last of them."""
ITSELF = "the reference is the file itself, as Mitsuba reads it: nothing is moved or scaled"
PASSES = 32
"""Fewest passes of a light with noise: below, a t quantile at a report's level costs too much."""

__all__ = ["GlossyNeedsLLVM", "Reference", "ReferenceUnavailable", "render_reference"]


class GlossyNeedsLLVM(ReferenceUnavailable):
    """A glossy scene where only scalar_rgb runs: its Python surface is too slow there to judge by."""


@dataclass(frozen=True)
class Reference:
    """A reference image.

    Parameters
    ----------
    mean, standard_error : (3, h, w) float64
        Radiance and its standard error.
    pixel_standard_error : (h, w) float64
        Of the average of the channels.
    emitter, background : (h, w) float64
        Share of camera rays that hit a light, or nothing.
    holes : (h, w) float64
        1 where a pixel is not to be judged: Mitsuba's ray slips through a surface, between its triangles (but for
        pixels that are boxes, whose many rays pay for one), or two surfaces lie in the place that is seen.
    pass_means : (r,) float64
        Mean over the shaded pixels of the channels' average, pass by pass; one value where nothing is random.
    samples, passes : int
        Largest number of samples per pixel and light, and of passes.
    renderer, version, variant, llvm : str
        What made it.
    notes : tuple of str
        What is approximate about it.
    seconds : dict
        Everything that comes from a clock.
    light_samples : tuple of int
        Samples per pixel of each light, where they are known.
    limits : tuple of str
        Why the reference itself may be wrong in this scene, one plain sentence a cause ("Mitsuba up to 3.9: ..."),
        the light or surface named. Where there is one, a finding against the other side that the cause can explain
        is not to be trusted: it makes a row `undecided`, with these sentences, and not `differs`. What no cause
        explains stays a finding. Pixels that are known to be wrong one by one are ``holes`` instead.
    """

    mean: Floats
    standard_error: Floats
    pixel_standard_error: Floats
    emitter: Floats
    background: Floats
    holes: Floats
    pass_means: Floats
    samples: int
    passes: int
    renderer: str
    version: str
    variant: str
    llvm: str | None
    notes: tuple[str, ...]
    seconds: dict[str, Any]
    light_samples: tuple[int, ...] = ()
    limits: tuple[str, ...] = ()

    @property
    def pooled_error(self) -> float:
        """Standard error, radiance, of the mean over the shaded pixels; 0 where nothing is random."""
        passes = self.pass_means
        return float(np.std(passes, ddof=1)) / math.sqrt(passes.size) if passes.size > 1 else 0.0

    @classmethod
    def of_image(cls, image: Image, renderer: str, samples: int, version: str = "") -> Reference:
        """One of our images in the place of a reference.

        Parameters
        ----------
        image : Image
        renderer : str
            What to call it.
        samples : int
            Per pixel and light, of each of its passes.
        version : str
        """
        passes = image.pass_means.size
        return cls(
            mean=image.mean,
            standard_error=np.sqrt(image.variance / passes),
            pixel_standard_error=np.sqrt(image.pixel_variance / passes),
            emitter=image.emitter,
            background=image.background,
            holes=np.zeros(image.background.shape),
            pass_means=image.pass_means,
            samples=samples * passes,
            passes=passes,
            renderer=renderer,
            version=version,
            variant="float64",
            llvm=None,
            notes=(),
            seconds={},
        )

    def as_image(self) -> Image:
        """In the place of one of our images; its first pass is not known, and is its mean."""
        passes = self.pass_means.size
        return replace(
            Image.without_noise(self.mean, self.emitter, self.background),
            variance=self.standard_error**2 * passes,
            pixel_variance=self.pixel_standard_error**2 * passes,
            pass_means=self.pass_means,
        )


def ask(
    job: dict[str, Any],
    folder: Path,
    running: Backend,
    timeout: float,
    progress: Callable[[int, int], None] | None = None,
    fresh: bool = False,
) -> tuple[dict[str, Floats], dict[str, Any]]:
    """Have a child do a job, see `run_job`: its arrays, and what it ran with.

    Raises
    ------
    ReferenceUnavailable
        If it fails, or its arrays cannot be read.
    """
    told, out_file = run_job(job, folder, running.variant, running.llvm, timeout, progress, fresh)
    try:
        with np.load(out_file, allow_pickle=False) as archive:
            arrays: dict[str, Floats] = {k: np.asarray(archive[k], dtype=np.float64) for k in archive.files}
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise ReferenceUnavailable(f"Mitsuba's process gave no arrays ({error})") from error
    if not {"version", "variant", "seconds"} <= told.keys():
        raise ReferenceUnavailable("Mitsuba's process did not say what it ran with")
    return arrays, told


def render_reference(
    scene: Scene,
    *,
    seed: int,
    target_relative_se: float,
    max_samples: int,
    timeout: float,
    passes: int = PASSES,
    progress: Callable[[int, int], None] | None = None,
    running: Backend | None = None,
    normalise: bool = True,
) -> Reference:
    """Render a scene with Mitsuba's `direct` integrator at our pixels.

    Parameters
    ----------
    seed : int
        Root of every pass's seed.
    target_relative_se : float
        Standard error to reach of the mean over shaded pixels, relative to it.
    max_samples : int
        Per pixel and light.
    timeout : float
        Seconds. What would take longer is planned smaller, and what is done by then is the reference: a noisier one,
        which says so.
    passes : int
        Fewest passes of a light with noise, if there is time.
    running : Backend, optional
        Instead of the one found.
    normalise : bool
        See `describe`.

    Raises
    ------
    ReferenceUnavailable
        If Mitsuba cannot run here, fails, or gives something that is not an image of the scene.
    """
    running = running or backend()
    if scene.is_glossy and running.variant == "scalar_rgb":
        raise GlossyNeedsLLVM(f"a glossy scene needs Mitsuba's LLVM variant: {running.sentence}")
    started = time.perf_counter()
    with temporary_folder(max(LEAST, PIXEL * scene.width * scene.height)) as name:
        folder = Path(name)
        own = own_file(scene)
        description = describe(scene, folder, normalise=normalise and own is None)
        job: dict[str, Any] = {
            "task": "reference",
            "description": description.as_json(),
            "seed": seed,
            "target": target_relative_se,
            "passes": passes,
            "max_samples": max_samples,
            "seconds": TIME * timeout,
        }
        if own is not None:
            job["own"] = own
        arrays, told = ask(job, folder, running, timeout, progress)
    _check(arrays, scene)
    tie, said = tied(scene)
    slipped = arrays["holes"] > 0
    arrays["holes"] = (slipped | tie).astype(np.float64)
    limits = [*description.limits, *said]
    return Reference(
        **{k: arrays[k] for k in SHAPES},
        pass_means=arrays["pass_means"],
        samples=int(arrays["samples"]),
        passes=int(arrays["passes"]),
        renderer="mitsuba",
        version=str(told["version"]),
        variant=str(told["variant"]),
        llvm=None if told.get("llvm") is None else str(told["llvm"]),
        notes=(
            running.sentence,
            *([ITSELF] if own is not None else []),
            *limits,
            *description.notes,
            *_said_of(slipped, tie),
            *_hurried(arrays, timeout),
        ),
        limits=tuple(limits),
        seconds={**told["seconds"], "whole": time.perf_counter() - started},
        light_samples=tuple(int(count) for count in arrays["light_samples"]),
    )


PIXEL = 96
"""Bytes of a reference's arrays, as Mitsuba's process hands them over, in a pixel."""
SHAPES = {"mean": 3, "standard_error": 3, "pixel_standard_error": 0, "emitter": 0, "background": 0, "holes": 0}
"""Channels of each image, 0 for a plane."""


def _said_of(slipped: Bools, tie: Bools) -> list[str]:
    causes = (slipped, "Mitsuba's ray passes between two triangles of a surface"), (tie, "two surfaces are seen there")
    return [f"{mask.sum()} pixels are not judged: {why}" for mask, why in causes if mask.any()]


def _hurried(arrays: dict[str, Floats], timeout: float) -> list[str]:
    share = float(arrays["share"])
    if share >= 1:
        return []
    return [f"{timeout:g} s (--timeout) allowed for {share:.0%} of the passes planned: the reference is noisier"]


def _check(arrays: dict[str, Floats], scene: Scene) -> None:
    plane = (scene.height, scene.width)
    for name, channels in SHAPES.items():
        shape = (channels, *plane) if channels else plane
        if name not in arrays or arrays[name].shape != shape:
            raise ReferenceUnavailable(f"Mitsuba's process gave no {name} of shape {shape}")
        if not np.isfinite(arrays[name]).all():
            raise ReferenceUnavailable(f"Mitsuba's {name} is not finite everywhere")
    if not {"pass_means", "samples", "passes", "light_samples", "share"} <= arrays.keys():
        raise ReferenceUnavailable("Mitsuba's process did not say how it sampled")
