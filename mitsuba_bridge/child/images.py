"""In the child: images as people make them with Mitsuba, all lights on and one chosen by chance for each sample."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from . import passes
from .passes import Array
from .scene_dict import EVERY, scene_dict


def images(job: dict[str, Any], folder: Path, progress: Callable[[int, int], None]) -> dict[str, Array]:
    """``images`` (k, 3, h, w), one for each of the job's ``seeds``, with its ``sampler`` and ``samples``."""
    description = job["description"]
    width, height = description["camera"]["width"], description["camera"]["height"]
    if str(mi.variant()).startswith("scalar"):
        raise RuntimeError("images by a sampler of one's own are made in the LLVM variants only")
    # Merged meshes stand in another order each time, and their lights with them: another one for the same number.
    scene = mi.load_dict(scene_dict(description, folder, EVERY), optimize=False)
    camera = passes.Camera(scene, width, height, description["boxed"])
    every, out = np.arange(width * height), []
    for number, seed in enumerate(job["seeds"]):
        # Far apart: consecutive seeds give shifted copies in some samplers.
        stream = int(np.random.SeedSequence([seed]).generate_state(1)[0])
        out.append(passes.one_pass(scene, camera, every, job["samples"], stream, 0, job["sampler"]))
        progress(number + 1, len(job["seeds"]))
    return {"images": np.array(out).reshape(-1, 3, height, width)}
