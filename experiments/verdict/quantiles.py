"""Quantiles of the laws that intervals rest on, upper ones: the chance to lie beyond them.

From `scipy.special`: `scipy.stats` gives the same numbers, and takes longer to import than a small image to render.
"""

from __future__ import annotations

import numpy as np
from scipy import special

from nusselt.renderer.vectors import Floats


def normal_quantile(level: float) -> float:
    """What a standard normal number exceeds with chance ``level`` in (0, 1)."""
    return -float(special.ndtri(level))


def student_quantile(level: Floats | float, freedom: Floats | float) -> Floats:
    """What Student's t of ``freedom`` > 0 degrees exceeds with chance ``level`` in (0, 1); broadcast."""
    return np.asarray(-special.stdtrit(freedom, level))


def student_tail(t: Floats | float, freedom: Floats | float) -> Floats:
    """The chance that Student's t of ``freedom`` > 0 degrees exceeds ``t``; broadcast."""
    return np.asarray(special.stdtr(freedom, -np.asarray(t)))
