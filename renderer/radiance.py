"""The rendering equation of direct light, once: what every source sends to the eye, summed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias, cast

import numpy as np

from .estimators.protocol import Estimator
from .needs import Needs, Source
from .shading import ShadingPoints
from .vectors import Floats

Rule: TypeAlias = Callable[[ShadingPoints, Source], Floats]
"""Reflected radiance (3, n) of points due to one source."""


def reflected(points: ShadingPoints, needs: Needs, rule: Rule, around: Floats | None = None) -> Floats:
    """Reflected radiance (3, n), W m^-2 sr^-1: a rule's shares of all sources, each with what may block it here.

    Parameters
    ----------
    around : (3, m) float64, optional
        Whose convex hull holds all points, if they are not to be looked at one by one for that.
    """
    out = np.zeros((3, points.count))
    for source in needs.sources:
        out += rule(points, source.seen_from(points.position if around is None else around))
    return out


def still(estimator: Estimator) -> Rule:
    """An estimator without noise as a rule: its random numbers are not used, and not loaded unless it asks for some."""
    unused = cast("np.random.Generator", _Unused())
    return lambda points, source: estimator(points, source, unused)


class _Unused:
    """A generator, once something is asked of it."""

    def __getattr__(self, name: str) -> Any:
        return getattr(np.random.default_rng(0), name)
