"""Centres of pixels: which plane each shows, and what they reflect."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from nusselt.renderer.camera.view import View, look
from nusselt.renderer.chunks import STRIP, gathered, pieces
from nusselt.renderer.estimators.protocol import Estimator
from nusselt.renderer.prepared import prepare
from nusselt.renderer.radiance import reflected, still
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats, Ints, dot

from .faces import PLANE

SMALLEST = 512
"""Pixels in a piece of work, at least."""

MIXERS = np.array([0x1B873593, 0x2545F4914F6CDD1D, 0x369DEA0F31A53F85, 0x106689D45497FDB5, 0x5851F42D4C957F2D])
"""Odd numbers whose multiples, modulo 2^64, are hardly ever equal sums."""


@dataclass(frozen=True)
class _Work:
    scene: Scene
    estimator: Estimator
    tolerance: float

    def __call__(self, index: Ints) -> Floats:
        """Reflected radiance (3, n) at the centres of pixels that reflect."""
        scene, geometry, needs = prepare(self.scene)
        row, column = np.divmod(index, scene.width)
        points = look(scene, geometry, column + 0.5, row + 0.5).points.as_exact_as(self.tolerance)
        return reflected(points, needs, still(self.estimator))


def planes(view: View) -> Ints:
    """A number (n,) for each plane of each surface that reflects; -1 for pixels that do not."""
    found = np.full(view.background.size, -1)
    points, k = view.points, view.lit
    if k.size == 0:
        return found
    size = max(float(np.abs(points.position).max()), np.finfo(float).tiny)
    offset = dot(points.normal, points.position) / size
    keys = np.rint(np.vstack((points.normal, offset)) / PLANE + 0.1234)
    keys = np.vstack((keys, view.hits.surface[k])).astype(np.int64)
    mixed: Ints = (keys * MIXERS[:, None]).sum(axis=0)  # one number is sorted many times as fast as five
    _, first, number = np.unique(mixed, return_index=True, return_inverse=True)
    if (keys != keys[:, first[number]]).any():
        _, number = np.unique(keys, axis=1, return_inverse=True)
    found[k] = number.reshape(-1)
    return found


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
    evaluations : int
        Pixels shaded so far.
    """

    scene: Scene
    estimator: Estimator
    executor: Executor | None
    tolerance: float
    evaluations: int = 0

    def __call__(self, index: Ints) -> Floats:
        """Reflected radiance (3, n) at the centres of pixels (n,) that reflect."""
        self.evaluations += index.size
        row, column = np.divmod(index, self.scene.width)
        order = np.lexsort((column, row // STRIP))
        return gathered(
            _Work(self.scene, self.estimator, self.tolerance), self.executor, pieces(order, SMALLEST), index
        )
