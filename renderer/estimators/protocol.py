"""What an estimator is."""

from __future__ import annotations

import math
from typing import ClassVar, Literal, Protocol, runtime_checkable

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.needs import Needs, Source
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats

Claim = Literal["exact", "unbiased", "consistent", "biased"]
"""exact: no error beyond rounding. unbiased: noise only. consistent: bias that vanishes with samples.
biased: an error that stays."""


BLOCK = 1 << 17
"""Point-sample pairs an estimator handles at once."""


def square_number(samples: int) -> None:
    """Refuse a number of samples that does not fill a square grid of strata."""
    if samples < 1 or math.isqrt(samples) ** 2 != samples:
        raise InputError("samples", samples, "a square number (1, 4, 9, ...) for strata")


class Estimator(Protocol):
    """A rule for the light one source sends to the eye from many points.

    Attributes
    ----------
    name : str
        As the command line knows it.
    summary : str
        One line.
    samples : int
        Per light with an extent.
    stratified : bool
        Whether they are laid in strata.
    shares_points : bool
        Whether the pixels of one pass share their light points: then their noise is common, and only whole passes
        are independent.
    """

    name: ClassVar[str]
    summary: ClassVar[str]
    shares_points: ClassVar[bool]

    def __init__(self, *, samples: int = 1, stratified: bool = False) -> None: ...

    @property
    def samples(self) -> int: ...

    @property
    def stratified(self) -> bool: ...

    def claim(self, needs: Needs) -> Claim:
        """What it promises of a scene with these needs."""
        ...

    def is_random(self, needs: Needs) -> bool:
        """Whether two seeds give two images."""
        ...

    def __call__(self, points: ShadingPoints, source: Source, rng: np.random.Generator) -> Floats:
        """Reflected radiance (3, n), W m^-2 sr^-1, due to ``source``."""
        ...


@runtime_checkable
class Bounded(Protocol):
    """An estimator whose values carry bounds of their errors; it goes different ways for different points."""

    def with_bounds(
        self, points: ShadingPoints, source: Source, rng: np.random.Generator
    ) -> tuple[Floats, Floats, dict[str, int]]:
        """Reflected radiance (3, n); bounds (n,); and the number of points that took each route.

        A bound is absolute, in units of what the light would give if nothing were in its way; inf where a value has
        noise.
        """
        ...

    def sampled(self, needs: Needs) -> tuple[str, ...]:
        """Which lights with big meshes before them are left to sampling, and why."""
        ...
