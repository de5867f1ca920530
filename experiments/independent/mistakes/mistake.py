"""What a mistake is: one step of the right renderer replaced, and the scene that shows it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nusselt.experiments.independent.steps import RIGHT, Rng, Steps
from nusselt.experiments.independent.world import Bools, Floats

Step = Callable[..., Any]
"""A step of `Steps`, or what makes one."""


@dataclass(frozen=True)
class Mistake:
    """A wrong renderer.

    Parameters
    ----------
    name : str
    says : str
        What is wrong, in a sentence.
    scene : str
        A classic scene, or one of `plain_scenes`.
    hook : str
        The step of `Steps` that is replaced.
    step : callable
        By what.
    strata : bool
        Whether samples are one in each cell of a grid, for those that show only so, or only otherwise.
    pixels : {"centres", "jittered", "areas"}
        Whether every sample has a camera ray of its own; whether images are then judged as areas, or against centres.
    """

    name: str
    says: str
    scene: str
    hook: str
    step: Step
    strata: bool = True
    pixels: str = "centres"

    @property
    def steps(self) -> Steps:
        """All steps, this one wrong."""
        return replace(RIGHT, **{self.hook: self.step})


Change = Callable[[Floats], Floats]


def where_shaded(change: Change) -> Callable[[Floats, Bools, Rng], Floats]:
    """The step `finished` that changes (3, h, w) what is no light and no background."""
    return lambda image, shaded, rng: np.where(shaded, change(image), image)


def everywhere(change: Change) -> Callable[[Floats, Bools, Rng], Floats]:
    """The step `finished` that changes (3, h, w) all of an image."""
    return lambda image, shaded, rng: change(image)


def by_chance(values: Floats, share: float) -> Bools:
    """True for a share of vectors (3, ...), by their digits: the same vector always falls alike."""
    mixed = np.sin(np.einsum("i...,i->...", values, np.array([12.9898, 78.233, 37.719]))) * 43758.5453
    return np.asarray(mixed - np.floor(mixed) < share)
