"""Pixel centres to a tolerance: evaluated where they must be, interpolated where neighbours' differences allow it.

The same lattice and the same checked bounds as between the edges of pixels by area (see `interpolation`). Interpolation
stays within one plane of one surface: where every pixel shows another triangle, every pixel is evaluated, or its
shadow sampled where that takes less (see `supersampling`).
"""

from __future__ import annotations

import math
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators.protocol import Estimator
from nusselt.renderer.image import Image
from nusselt.renderer.needs import Needs
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats, Ints

from .centre_view import CentreView, on_small_planes
from .centres import CentreShader
from .error_budget import allowed
from .fill import fill_centres
from .render_crowded import crowded_centres, sampled_centres


@dataclass(frozen=True)
class CentreImage:
    """An image and what it took.

    Parameters
    ----------
    image : Image
    error : float
        Bound of the RMS error due to interpolation over shaded pixels, relative to their RMS: measured where the
        function is smooth at the scale of what was evaluated, or kinked. Estimated where shadows were sampled.
    tolerance : float
        What was asked.
    evaluations : int
        Pixels evaluated, or whose shadows were sampled.
    """

    image: Image
    error: float
    tolerance: float
    evaluations: int


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
    view = CentreView.of(near, geometry)
    shade = CentreShader(scene, estimator, executor, tolerance, view)
    region, rough = view.planes().reshape(height, width), crowded_centres(view, geometry, estimator, needs, tolerance)
    if rough.size:
        centre, left = sampled_centres(region, rough, shade)
    else:
        centre, left = filled_centres(region, shade)
    reflected = np.where(region >= 0, centre, 0.0)
    mean, square = reflected + view.emission.reshape(3, height, width), float((reflected**2).sum())
    error = math.sqrt(left / square) if square > 0 else 0.0
    back = int(view.back.sum())
    emitter, background = (v.reshape(height, width).astype(float) for v in (view.emitter, view.background))
    evaluations = shade.evaluations + int(rough.size)
    return CentreImage(Image.without_noise(mean, emitter, background, back), error, tolerance, evaluations)


def filled_centres(region: Ints, shade: CentreShader) -> tuple[Floats, float]:
    """Radiance (3, h, w) at all centres, and the sum of their squared errors."""
    small, beside = on_small_planes(region.ravel()), region.copy()
    value = shade(small)
    beside.ravel()[small] = -1
    count = max(int(np.count_nonzero(beside >= 0)), 1)
    centre, bound, _ = fill_centres(beside, shade, partial(allowed, shade.tolerance, float((value**2).sum()), count))
    centre.reshape(3, -1)[:, small] = value
    return centre, float((bound**2).sum())
