"""What centres of pixels reflect."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from nusselt.renderer.chunks import STRIP, pieces
from nusselt.renderer.estimators.protocol import Estimator
from nusselt.renderer.prepared import prepare
from nusselt.renderer.radiance import reflected, still
from nusselt.renderer.scene import Scene
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats, Ints

from .centre_view import CentreView

SMALLEST = 2048
"""Pixels in a piece of work, at least: half the time of a piece of five hundred goes by whatever their number."""


@dataclass(frozen=True)
class _Work:
    scene: Scene
    estimator: Estimator

    def __call__(self, points: ShadingPoints) -> Floats:
        """Reflected radiance (3, n)."""
        return reflected(points, prepare(self.scene).needs, still(self.estimator))


@dataclass
class CentreShader:
    """Shades centres of pixels on an executor, and counts.

    Parameters
    ----------
    scene : Scene
    estimator : Estimator
    executor : Executor or None
    tolerance : float
        The image's.
    view : CentreView
    evaluations : int
        Pixels shaded so far.
    """

    scene: Scene
    estimator: Estimator
    executor: Executor | None
    tolerance: float
    view: CentreView
    evaluations: int = 0

    def __call__(self, index: Ints) -> Floats:
        """Reflected radiance (3, n) at the centres of pixels (n,) that reflect."""
        self.evaluations += index.size
        row, column = np.divmod(index, self.scene.width)
        parts = pieces(np.lexsort((column, row // STRIP)), SMALLEST)
        points = (self.view.points(index[part]).as_exact_as(self.tolerance) for part in parts)
        work, far = _Work(self.scene, self.estimator), self.executor if len(parts) > 1 else None
        value = np.empty((3, index.size))
        for part, found in zip(parts, far.map(work, points) if far else map(work, points), strict=True):
            value[:, part] = found
        return value
