"""How much of every light reaches what the camera sees: the visible share of its irradiance, as layers."""

from __future__ import annotations

import numpy as np

from nusselt.renderer.camera.rays import pixel_centres
from nusselt.renderer.camera.view import look
from nusselt.renderer.estimators import Exact
from nusselt.renderer.estimators.analytic import without_shadows
from nusselt.renderer.lights.sampling import stratum_centres
from nusselt.renderer.needs import Needs, Source
from nusselt.renderer.prepared import prepare
from nusselt.renderer.radiance import still
from nusselt.renderer.scene import Scene
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats, dot

SAMPLES = 16
"""Places of a light, the centres of its strata, where the share is not taken exactly."""
ROWS = 1 << 14
"""Pixels at once."""


def visibility_layers(scene: Scene, is_exact: bool) -> tuple[dict[str, Floats], tuple[str, ...]]:
    """Shares `visibilityK` (1, h, w) of light K's irradiance on what a pixel's centre shows, and what was left out.

    In [0, 1]: 1 where nothing blocks; 0 where all is blocked, where the light is below the horizon or turned away, and
    where no reflecting surface is seen. Exact where ``is_exact`` and `Exact` has no noise; else from 16 places of the
    light. Lights that nothing can block have no layer.
    """
    near, geometry, needs = prepare(scene)
    blocked = [source for source in needs.sources if not source.blockers.none]
    shape = 1, scene.height, scene.width
    found: dict[str, Floats] = {f"visibility{source.index + 1}": np.zeros(shape) for source in blocked}
    step = max(1, ROWS // scene.width) if blocked else scene.height
    for first in range(0, scene.height if blocked else 0, step):
        rows = range(first, min(first + step, scene.height))
        view = look(near, geometry, *pixel_centres(range(scene.width), rows))
        reflects = geometry.reflects[view.hits.surface[view.lit]]
        points, at = view.points.take(np.flatnonzero(reflects)), view.lit[reflects]
        white = points.with_columns(diffuse=np.ones(points.position.shape))
        for source in blocked:
            share = np.zeros(view.background.size)
            share[at] = _visible(white, source, is_exact)
            found[f"visibility{source.index + 1}"][0, rows.start : rows.stop] = share.reshape(len(rows), -1)
    without = [str(k + 1) for k in range(len(scene.lights)) if f"visibility{k + 1}" not in found]
    said = f"visibility of light {', '.join(without)}: nothing stands in its way, or it lights nothing"
    return found, (said,) if without else ()


def _visible(points: ShadingPoints, whole: Source, is_exact: bool) -> Floats:
    """Visible over unshadowed irradiance (n,)."""
    light, source = whole.light, whole.seen_from(points.position)
    diffuse = Source(source.index, light.with_colour((1.0, 1.0, 1.0)), source.blockers, False)
    if is_exact and Exact().claim(Needs((whole,), ())) == "exact":
        visible, all_of_it = still(Exact())(points, diffuse)[0], without_shadows(points, diffuse)[0]
    else:
        d, weight = light.beams(points.position, *stratum_centres(SAMPLES))
        arriving = weight * np.maximum(dot(points.normal[:, :, None], d), 0) / np.sqrt(dot(d, d))
        seen = source.blockers.visible(points.position, points.ellipsoid, d, light.at_infinity, points.normal)
        visible, all_of_it = (arriving * seen).sum(axis=1), arriving.sum(axis=1)
    ratio = np.divide(visible, all_of_it, out=np.zeros(points.count), where=all_of_it > 0)
    return np.clip(ratio, 0, 1)
