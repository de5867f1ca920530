"""Somebody's renderer as a function of Python."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from nusselt.experiments.images.read import raw_of
from nusselt.renderer.scene import Scene

from .program import Run

RenderFunction = Callable[[Scene, int, int], Any]
"""(scene, samples, seed) to an array (h, w, 3): radiance, or uint8 or uint16 levels."""


@dataclass(frozen=True)
class FunctionRenderer:
    """A function that renders, for one scene.

    Parameters
    ----------
    function : callable
    scene : Scene
    """

    function: RenderFunction
    scene: Scene
    takes_samples: bool = True

    def run(self, samples: int, seed: int) -> Run:
        """One image; what the function raises is the caller's to see.

        Raises
        ------
        InputError
            If it is no image of the scene.
        """
        started = time.perf_counter()
        image = self.function(self.scene, samples, seed)
        seconds = time.perf_counter() - started
        return Run(raw_of(image, self.scene, f"renderer, seed {seed}"), seed, samples, seconds)
