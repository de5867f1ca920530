"""Errors of our own images against the closed form, exact shadows, or many samples where neither holds.

A pixel is the unit: its channels are averaged first. Only shaded pixels count.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from nusselt.experiments.check.estimators import noise_free
from nusselt.renderer.estimators import ControlVariate, Estimator
from nusselt.renderer.image import render
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats

SURE = 5.0
"""Standard errors beyond which an unbiased mean is not found once in a million times."""


@dataclass(frozen=True)
class Truth:
    """What an image should be.

    Parameters
    ----------
    mean : (3, h, w) float64
    noise : (h, w) float64
        Variance of the channels' average; 0 where it is the closed form.
    shaded : (h, w) bool
    name : str
        How it was found.
    """

    mean: Floats
    noise: Floats
    shaded: Any
    name: str

    @property
    def level(self) -> float:
        """Mean over the shaded pixels: what errors are relative to."""
        return float(self.mean.mean(axis=0)[self.shaded].mean()) if self.shaded.any() else 0.0


def truth_of(scene: Scene, seed: int, samples: int = 1024, passes: int = 4) -> Truth:
    """The closed form where nothing blocks, exact shadows where they are, else a control variate's passes."""
    visibility = prepare(scene).needs.visibility
    name = "exact shadows" if visibility else "closed form"
    estimator = noise_free(scene) if scene.spp == 1 or not visibility else None
    if estimator is None:
        estimator = ControlVariate(samples=samples, stratified=True)
        name = f"{estimator.name} {samples} x {passes}"
    image = render(scene, estimator, seed=seed, passes=passes)
    return Truth(image.mean, image.pixel_variance / passes, image.shaded, name)


def measured(
    scene: Scene, estimator: Estimator, truth: Truth, seed: int, passes: int = 4
) -> tuple[dict[str, Any], Floats]:
    """Relative RMS of one pass, relative bias and its standard errors; and the first pass's image."""
    image = render(scene, estimator, seed=seed, passes=passes)
    keep, level = truth.shaded, truth.level
    difference = (image.mean - truth.mean).mean(axis=0)[keep]
    variance, noise = image.pixel_variance[keep], truth.noise[keep]
    square = difference**2 + variance * (1 - 1 / passes) - noise
    error = math.sqrt(float((variance / passes + noise).sum())) / max(keep.sum(), 1)
    bias = float(difference.mean())
    rounding = 1e-12 * level
    return {
        "rms_relative": math.sqrt(max(float(square.mean()), 0.0)) / level,
        "bias_relative": bias / level,
        "bias_standard_errors": bias / math.hypot(error, rounding),
    }, image.first
