"""Centres of pixels: which plane each shows, and what they reflect."""

from __future__ import annotations

import math
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from nusselt.renderer.camera.view import View
from nusselt.renderer.chunks import STRIP, pieces
from nusselt.renderer.estimators.protocol import Estimator
from nusselt.renderer.prepared import prepare
from nusselt.renderer.radiance import reflected, still
from nusselt.renderer.scene import Scene
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats, Ints, dot

from .faces import PLANE

SMALLEST = 2048
"""Pixels in a piece of work, at least: half the time of a piece of five hundred goes by whatever their number."""

SPAN = 7 * 7
"""Pixels of the least square between whose 4 x 4 nodes something is interpolated."""


@dataclass(frozen=True)
class _Work:
    scene: Scene
    estimator: Estimator

    def __call__(self, points: ShadingPoints) -> Floats:
        """Reflected radiance (3, n)."""
        return reflected(points, prepare(self.scene).needs, still(self.estimator))


def planes(view: View) -> Ints:
    """A number (n,) for each plane of each surface that reflects; -1 for pixels that do not."""
    found = np.full(view.background.size, -1)
    points, k = view.points, view.lit
    if k.size == 0:
        return found
    one, of = _standing_for(view.hits.triangle[k])
    position, normal, surface = points.position[:, one], points.normal[:, one], view.hits.surface[k[one]]
    size = max(float(np.abs(points.position).max()), np.finfo(float).tiny)
    keys = np.rint(np.vstack((normal, dot(normal, position) / size)) / PLANE + 0.1234)
    order = np.lexsort((surface, *keys))
    apart = (np.diff(keys[:, order]) != 0).any(axis=0) | (np.diff(surface[order]) != 0)
    number = np.empty(one.size, dtype=np.int64)
    number[order] = np.append(0, np.cumsum(apart))
    found[k] = number[of]
    return found


def _standing_for(triangle: Ints) -> tuple[Ints, Ints]:
    """One hit (m,) of each of the triangles (n,), and every one of none (-1); and which of those stands for each."""
    most = int(triangle.max()) + 1
    group = np.where(triangle >= 0, triangle, np.arange(most, most + triangle.size))
    stands = np.full(most + triangle.size, -1)
    stands[group] = np.arange(triangle.size)
    some = np.flatnonzero(stands >= 0)
    one = stands[some]
    stands[some] = np.arange(some.size)
    return one, stands[group]


def on_small_planes(plane: Ints) -> Ints:
    """Pixels (k,) of planes (n,) that are seen in so few that nothing can be interpolated; see `planes`."""
    count = np.bincount(plane[plane >= 0], minlength=1)
    return np.flatnonzero((plane >= 0) & (count[plane] < SPAN))


def allowed(share: float, known: float, count: int, first: Floats) -> float:
    """RMS error that ``count`` values may have for a share of all values' RMS.

    Parameters
    ----------
    known : float
        Sum of squares of others.
    first : (3, n) float64
        Some of them.
    """
    return share * math.sqrt(known / count + float((first**2).sum()) / max(first.shape[1], 1))


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
    view : View
        Of all centres, row by row.
    evaluations : int
        Pixels shaded so far.
    """

    scene: Scene
    estimator: Estimator
    executor: Executor | None
    tolerance: float
    view: View
    evaluations: int = 0

    def __call__(self, index: Ints) -> Floats:
        """Reflected radiance (3, n) at the centres of pixels (n,) that reflect."""
        self.evaluations += index.size
        row, column = np.divmod(index, self.scene.width)
        parts = pieces(np.lexsort((column, row // STRIP)), SMALLEST)
        lit = np.searchsorted(self.view.lit, index)
        points = (self.view.points.take(lit[part]).as_exact_as(self.tolerance) for part in parts)
        work, far = _Work(self.scene, self.estimator), self.executor if len(parts) > 1 else None
        value = np.empty((3, index.size))
        for part, found in zip(parts, far.map(work, points) if far else map(work, points), strict=True):
            value[:, part] = found
        return value
