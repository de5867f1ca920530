"""How much of the squared error an image may have is spent on which squares."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nusselt.renderer.vectors import Bools, Floats

SQUARES = 1024
"""Squares, of those that err most, that may spend what all may."""
CAREFUL = 3.0
"""How much less than differences allow is believed where one point was tried."""
MOST = 8.0
"""Of what values may err by in the mean, that one may."""


@dataclass
class Budget:
    """Of the sum of squared errors.

    Parameters
    ----------
    left : float
    each : float
        What one square may take: a square of any size costs as much to divide.
    most : float
        Error that no value may have.
    """

    left: float
    each: float
    most: float

    @classmethod
    def of(cls, limit: float, values: int, squares: int = SQUARES) -> Budget:
        square = limit**2 * values
        return cls(square, square / squares, MOST * limit)

    def takes(self, error: Floats, count: Floats | int) -> Bools:
        """Which errors of ``count`` values each are accepted; they are spent."""
        square = error**2 * count
        order = np.argsort(square, kind="stable")
        spent = np.cumsum(square[order])
        good = np.zeros(error.size, dtype=bool)
        good[order] = (spent <= self.left) & (square[order] <= self.each)
        good &= error <= self.most
        self.left -= float(square[good].sum())
        return good


def allowed(share: float, known: float, count: int, first: Floats) -> float:
    """RMS error that ``count`` values may have for a share of all values' RMS.

    Parameters
    ----------
    known : float
        Sum of squares of others.
    first : (c, n) float64
        Some of them.
    """
    return share * math.sqrt(known / count + float((first**2).sum()) / max(first.shape[1], 1))
