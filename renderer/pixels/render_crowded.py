"""Scenes of big meshes: sampled where small triangles are seen, interpolated everywhere else."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import Executor
from functools import partial

import numpy as np

from nusselt.renderer.estimators.exact import Exact
from nusselt.renderer.estimators.protocol import Estimator
from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.image import Image
from nusselt.renderer.needs import Needs
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats, Ints
from nusselt.renderer.visibility.segments import small_triangles

from .centre_view import CentreView
from .centres import CentreShader
from .error_budget import allowed
from .face_means import unshadowed_means
from .fill import fill_centres
from .first_estimates import means
from .supersampling import CentreFrames, Crowd, Frames, around_agrees, is_crowded, touched

SHARE = 0.7
"""Of the tolerance, that interpolated centres may spend."""
ROOM = 0.8
"""Of the tolerance, that estimates may add up to: they are no bounds."""
CENTRES = 32
"""Light points of each copy, after which a pixel's centre is evaluated instead."""
ROUGH = 3e-3
"""Tolerance below which it takes less to evaluate all of them."""


def render_crowded(
    scene: Scene, estimator: Estimator, tolerance: float, executor: Executor | None
) -> tuple[Image, float, int, int]:
    """The image, its estimated error, points shaded, and pixels sampled; see `render_area`.

    What a large triangle shows between the centres of nine pixels of one plane, thinner than a pixel, is lost.
    """
    near, geometry, needs = prepare(scene)
    height, width = scene.height, scene.width
    view = CentreView.of(near, geometry)
    plane = view.planes()
    label = np.where(plane >= 0, plane, -2 - view.surface).reshape(height, width)
    plain = around_agrees(label) & ~touched(near, geometry)
    region = np.where(plain, plane.reshape(height, width), -1)
    shade = CentreShader(scene, estimator, executor, tolerance, view)
    busy = np.flatnonzero(~plain)
    crowd = Crowd.begun(Frames(scene, tolerance), busy, executor)
    if tolerance < ROUGH:
        crowd.know(unshadowed_means(near, geometry, needs, busy, tolerance))
    centre, settled, budget = fill_beside(crowd, region, shade, tolerance)
    left = float(crowd.refine(budget).sum())
    image = means(centre, region)
    image[:, region < 0] = 0
    image += np.where(plain, view.emission.reshape(3, height, width), 0)
    image.reshape(3, -1)[:, busy] = crowd.mean
    emitter, background = (v.reshape(height, width).astype(float) for v in (view.emitter, view.background))
    for share, part in zip((emitter, background), crowd.share, strict=True):
        share.reshape(-1)[busy] = part
    shaded = (emitter == 0) & (background < 1)
    square = float((image[:, shaded] ** 2).sum())
    error = math.sqrt((settled + left) / square) if square > 0 else 0.0
    back = int(view.back.sum())
    still = Image.without_noise(image, emitter, background, back)
    return still, error, shade.evaluations + crowd.evaluations, int(busy.size)


def fill_beside(
    crowd: Crowd, region: Ints, shade: Callable[[Ints], Floats], tolerance: float
) -> tuple[Floats, float, float]:
    """Centres (3, h, w) of regions beside a crowd, the sum of their squared errors, and what the crowd's may be."""
    known, count = crowd.square, max(int(np.count_nonzero(region >= 0)), 1)
    centre, bound, _ = fill_centres(region, shade, partial(allowed, SHARE * tolerance, known, count))
    settled = float((bound**2).sum())
    square = known + float(np.nansum(centre**2))
    return centre, settled, (ROOM * tolerance) ** 2 * square - settled


def crowded_centres(view: CentreView, geometry: Geometry, estimator: Estimator, needs: Needs, tolerance: float) -> Ints:
    """Pixels (n,) whose centres show a triangle of many, if it takes less to sample their shadows."""
    tree = small_triangles(geometry)
    shadows = needs.random and needs.visibility and not needs.without_form and isinstance(estimator, Exact)
    if tree is None or tolerance < ROUGH or not shadows or not is_crowded(geometry):
        return np.zeros(0, dtype=np.int64)
    lit = np.flatnonzero(view.reflects)
    return lit[np.isin(view.seen.triangle[lit], tree.triangles)]


def sampled_centres(region: Ints, busy: Ints, shade: CentreShader) -> tuple[Floats, float]:
    """Radiance (3, h, w) at all centres, those of some pixels (n,) sampled; and the sum of their squared errors."""
    crowd = Crowd.begun(CentreFrames(shade.scene, shade.tolerance), busy, shade.executor)
    beside = region.copy()
    beside.ravel()[busy] = -1
    centre, settled, budget = fill_beside(crowd, beside, shade, shade.tolerance)
    variance = crowd.refine(budget, CENTRES)
    order = np.argsort(variance, kind="stable")
    sums = np.append(0.0, np.cumsum(variance[order]))
    kept = int(np.searchsorted(sums, budget, side="right")) - 1
    value, worst = crowd.mean, order[max(kept, 0) :]
    value[:, worst] = shade(busy[worst])
    centre.reshape(3, -1)[:, busy] = value
    return centre, settled + float(sums[max(kept, 0)])
