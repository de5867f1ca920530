"""Lights that end nowhere by themselves: where one fades, something stands before it, or it sinks below a plane."""

from __future__ import annotations

from typing import Self

import numpy as np

from nusselt.renderer.vectors import Bools, Floats


class Rimless:
    """The answers to `Light` about a rim that there is none of."""

    def rim_within(self, points: Floats, radius: Floats) -> Bools:
        return np.zeros(radius.shape, dtype=bool)

    def without_rim(self) -> Self:
        return self
