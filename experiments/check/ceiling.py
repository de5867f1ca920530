"""The most that one light sample can bring to a pixel: what rare events are bounded by where none were seen."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from nusselt.renderer.camera.rays import pixel_centres
from nusselt.renderer.camera.view import View, look
from nusselt.renderer.estimators.protocol import BLOCK
from nusselt.renderer.lights import colour
from nusselt.renderer.needs import Source
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene
from nusselt.renderer.shading import reflect
from nusselt.renderer.vectors import Floats

SIDE = 6
"""Light points a side of the grid, its border included, whose brightest is taken."""


def sample_ceilings(scene: Scene) -> Floats:
    """The largest radiance, channels averaged, that one sample of each light's area can bring to each pixel.

    Found on a grid over the light, its border included, and doubled: a lobe narrower than the grid is missed. Where a
    pixel is its box, a sample may also meet whatever its neighbours show.

    Returns
    -------
    (l, h, w) float64
        0 for a light without extent, or one that lights nothing.
    """
    scene, geometry, needs = prepare(scene)
    rows = max(1, BLOCK // (SIDE**2 * scene.width))
    out = np.zeros((len(scene.lights), scene.height, scene.width))
    shows = np.zeros((scene.height, scene.width))
    for start in range(0, scene.height, rows):
        block = range(start, min(start + rows, scene.height))
        view = look(scene, geometry, *pixel_centres(range(scene.width), block))
        shows[block] = view.emission.mean(axis=0).reshape(len(block), -1)
        for source in needs.sources:
            if source.has_extent and view.lit.size:
                out[source.index, block] = _brightest(view, source).reshape(len(block), -1)
    if scene.spp == 1:
        return out
    return np.asarray(ndimage.maximum_filter(np.maximum(out, shows), (0, 3, 3)))


def _brightest(view: View, source: Source) -> Floats:
    """Of the pixels of a view, (n,): twice the brightest light point of the grid, nothing in its way."""
    points, places = view.points, np.linspace(0, 1, SIDE)
    u, v = (grid.reshape(1, -1) for grid in np.meshgrid(places, places))
    d, weight = source.light.beams(points.position, u, v)
    each = points.take(np.repeat(np.arange(points.count), u.size))
    alone = reflect(each, d.reshape(3, -1, 1), (weight * u.size).reshape(-1, 1), source.glossy) * colour(source.light)
    out = np.zeros(view.background.size)
    out[view.lit] = 2 * alone.mean(axis=0).reshape(points.count, u.size).max(axis=1)
    return out
