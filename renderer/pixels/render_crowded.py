"""Pixels by area in scenes of big meshes: sampled where small triangles are seen, interpolated everywhere else."""

from __future__ import annotations

import math
from concurrent.futures import Executor
from functools import partial

import numpy as np

from nusselt.renderer.camera.rays import pixel_centres
from nusselt.renderer.camera.view import look
from nusselt.renderer.estimators.protocol import Estimator
from nusselt.renderer.image import Image
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene

from .fill import fill_centres
from .first_estimates import means
from .render_centre import CentreShader, planes, share_of_rms
from .supersampling import around_agrees, sample_crowd, touched

SHARE = 0.5
"""Of the tolerance, that interpolated centres may spend."""
ROOM = 0.8
"""Of the tolerance, that estimates may add up to: they are no bounds."""


def render_crowded(
    scene: Scene, estimator: Estimator, tolerance: float, executor: Executor | None
) -> tuple[Image, float, int, int]:
    """The image, its estimated error, points shaded, and pixels sampled; see `render_area`.

    What a large triangle shows between the centres of nine pixels of one plane, thinner than a pixel, is lost.
    """
    near, geometry, _ = prepare(scene)
    height, width = scene.height, scene.width
    view = look(near, geometry, *pixel_centres(range(width), range(height)))
    plane = planes(view)
    label = np.where(plane >= 0, plane, -1 - view.hits.surface.astype(np.int64) - 1).reshape(height, width)
    plain = around_agrees(label) & ~touched(near, geometry)
    region = np.where(plain, plane.reshape(height, width), -1)
    shade = CentreShader(scene, estimator, executor, tolerance)
    centre, bound, _ = fill_centres(region, shade, partial(share_of_rms, SHARE * tolerance))
    image = means(centre, region)
    image[:, region < 0] = 0
    image += np.where(plain, view.emission.reshape(3, height, width), 0)
    lit = image[:, region >= 0]
    # The mean square of what is sampled is not known yet: that of what is not stands for it.
    square = float((lit**2).mean()) * 3 * height * width if lit.size else 0.0
    settled = float((bound**2).sum())
    busy = np.flatnonzero(~plain)
    crowd, left = sample_crowd(scene, busy, (ROOM * tolerance) ** 2 * square - settled, tolerance, executor)
    found = crowd.mean
    image.reshape(3, -1)[:, busy] = found[:3]
    emitter, background = (v.reshape(height, width).astype(float) for v in (view.emitter, view.background))
    for share, part in ((emitter, found[3]), (background, found[4])):
        share.reshape(-1)[busy] = part
    shaded = (emitter == 0) & (background < 1)
    square = float((image[:, shaded] ** 2).sum())
    error = math.sqrt((settled + left) / square) if square > 0 else 0.0
    back = int(view.back.sum())
    still = Image.without_noise(image, emitter, background, back)
    return still, error, shade.evaluations + crowd.evaluations, int(busy.size)
