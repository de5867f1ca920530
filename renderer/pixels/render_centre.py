"""Pixel centres to a tolerance: evaluated where they must be, interpolated where neighbours' differences allow it.

The same lattice and the same checked bounds as between the edges of pixels by area (see `interpolation`). Interpolation
stays within one plane of one surface: where every pixel shows another triangle, every pixel is evaluated.
"""

from __future__ import annotations

import math
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial

import numpy as np

from nusselt.renderer.camera.rays import pixel_centres
from nusselt.renderer.camera.view import View, look
from nusselt.renderer.chunks import STRIP, gathered, pieces
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators.protocol import Estimator
from nusselt.renderer.image import Image
from nusselt.renderer.needs import Needs
from nusselt.renderer.prepared import prepare
from nusselt.renderer.radiance import reflected, still
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats, Ints, dot

from .faces import PLANE
from .fill import fill_centres

SMALLEST = 512
"""Pixels in a piece of work, at least."""


@dataclass(frozen=True)
class CentreImage:
    """An image and what it took.

    Parameters
    ----------
    image : Image
    error : float
        Bound of the RMS error due to interpolation over shaded pixels, relative to their RMS: measured where the
        function is smooth at the scale of what was evaluated, or kinked.
    tolerance : float
        What was asked.
    evaluations : int
        Pixels evaluated.
    """

    image: Image
    error: float
    tolerance: float
    evaluations: int


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


def refuse_noise(scene: Scene, estimator: Estimator, needs: Needs, tolerance: float, what: str) -> None:
    """Refuse an estimator with noise in a scene of these needs, textures, or a tolerance outside (0, 1)."""
    scene.refuse_textures(what)
    if not 0 < tolerance < 1:
        raise InputError("tolerance", tolerance, "a number in (0, 1)")
    if estimator.is_random(needs):
        raise InputError("estimator", estimator.name, f"one without noise in this scene, for {what}")


def render_centre(
    scene: Scene, estimator: Estimator, *, tolerance: float = 1e-3, executor: Executor | None = None
) -> CentreImage:
    """Render pixel centres.

    Parameters
    ----------
    scene : Scene
        Its ``spp`` is not used.
    estimator : Estimator
        One without noise.
    tolerance : float
        RMS error of interpolation over the shaded pixels, relative to their RMS, in (0, 1).
    executor : Executor, optional
        Where points are shaded. The image does not depend on it.

    Raises
    ------
    InputError
        If the estimator is random, or the tolerance is not in (0, 1).
    """
    near, geometry, needs = prepare(scene)
    refuse_noise(scene, estimator, needs, tolerance, "an image with interpolation")
    height, width = scene.height, scene.width
    view = look(near, geometry, *pixel_centres(range(width), range(height)))
    shade = CentreShader(scene, estimator, executor, tolerance)
    centre, bound, _ = fill_centres(planes(view).reshape(height, width), shade, partial(share_of_rms, tolerance))
    mean = np.where(np.isfinite(centre), centre, 0.0) + view.emission.reshape(3, height, width)
    square = float((np.where(np.isfinite(centre), centre, 0.0) ** 2).sum())
    error = math.sqrt(float((bound**2).sum()) / square) if square > 0 else 0.0
    back = int(view.back.sum())
    emitter, background = (v.reshape(height, width).astype(float) for v in (view.emitter, view.background))
    return CentreImage(Image.without_noise(mean, emitter, background, back), error, tolerance, shade.evaluations)


def planes(view: View) -> Ints:
    """A number (n,) for each plane of each surface that reflects; -1 for pixels that do not."""
    found = np.full(view.background.size, -1)
    points, k = view.points, view.lit
    if k.size == 0:
        return found
    size = max(float(np.abs(points.position).max()), np.finfo(float).tiny)
    offset = dot(points.normal, points.position) / size
    keys = np.rint(np.vstack((points.normal, offset)) / PLANE + 0.1234)
    _, number = np.unique(np.vstack((keys, view.hits.surface[k])), axis=1, return_inverse=True)
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


def share_of_rms(share: float, first: Floats) -> float:
    """What a pixel may be off by, radiance, from the first that were evaluated (3, n)."""
    return share * math.sqrt(float((first**2).sum()) / max(first.shape[1], 1))
