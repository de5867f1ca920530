"""What most kinds of light answer alike."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar, Self

import numpy as np

from nusselt.renderer.vectors import Bools, Floats


class Plain(ABC):
    """No parallelogram, nor part of one, of no rim, and with one way to sample it.

    Where such a light ends, something stands before it, or it sinks below a plane.
    """

    surrounds: ClassVar[bool] = False

    @property
    def hides_itself(self) -> bool:
        return False

    @abstractmethod
    def beams(self, points: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats]: ...

    def solid_beams(self, points: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        return self.beams(points, u, v)

    def parallelogram(self) -> None:
        return None

    def half_of(self) -> None:
        return None

    def rim_within(self, points: Floats, radius: Floats) -> Bools:
        return np.zeros(radius.shape, dtype=bool)

    def without_rim(self) -> Self:
        return self
