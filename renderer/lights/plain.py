"""What most kinds of light answer alike."""

from __future__ import annotations

from typing import ClassVar, Self

import numpy as np

from nusselt.renderer.vectors import Bools, Floats


class Plain:
    """No parallelogram, nor part of one, and of no rim.

    Where such a light ends, something stands before it, or it sinks below a plane.
    """

    surrounds: ClassVar[bool] = False

    @property
    def hides_itself(self) -> bool:
        return False

    def parallelogram(self) -> None:
        return None

    def half_of(self) -> None:
        return None

    def rim_within(self, points: Floats, radius: Floats) -> Bools:
        return np.zeros(radius.shape, dtype=bool)

    def without_rim(self) -> Self:
        return self
