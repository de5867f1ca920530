"""The image whose pixels are averages over their areas, from an estimator without noise, to a tolerance.

Where the edges run is one question, how bright it is between them another. The first is answered exactly (see
`edge_fragments`, `moments`), the second by as few evaluations as the tolerance allows (see `fill`, `shadow_fits`,
`refine`).
Where pixels show many faces each, both are sampled (see `supersampling`).
"""

from __future__ import annotations

import math
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from nusselt.renderer.estimators.protocol import Estimator
from nusselt.renderer.image import Image
from nusselt.renderer.needs import LeftOut, Needs
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Bools, Floats, Ints

from .doubt import doubtful
from .first_values import First, first_values
from .refine import refine
from .regions import Regions
from .render_centre import refuse_noise
from .render_crowded import render_crowded
from .shade import Palette, Shader, Work, palette_of, regions_of, surface_of
from .supersampling import is_crowded
from .whole_pixels import Shown, shown_by

ROOM = 0.8
"""Of the tolerance, that estimates may add up to: they are no bounds. Without room the error was 0.2 of the tolerance
at the median and 1.09 at worst, over 75 images of 15 views 64 pixels high."""
SURE = 1e-6
"""Share of a pixel that is none, and what lacks of all of it that is all."""


@dataclass(frozen=True)
class AreaImage:
    """An image and what it took.

    Parameters
    ----------
    image : Image
    error : float
        Estimated RMS error over shaded pixels, relative to their RMS.
    tolerance : float
        What was asked.
    evaluations : int
        Points shaded.
    pieces, sampled : int
        Pieces of pixels with an edge; pixels whose regions were found by rays, or that were sampled (`supersampling`).
    """

    image: Image
    error: float
    tolerance: float
    evaluations: int
    pieces: int
    sampled: int


def render_area(
    scene: Scene,
    estimator: Estimator,
    *,
    tolerance: float = 1e-3,
    executor: Executor | None = None,
    everything: bool = False,
) -> AreaImage:
    """Render box-filtered pixels.

    Parameters
    ----------
    scene : Scene
        Its ``spp`` is not used.
    estimator : Estimator
        One without noise.
    tolerance : float
        RMS error over the shaded pixels, relative to their RMS, in (0, 1).
    executor : Executor, optional
        Where points are shaded. The image does not depend on it.
    everything : bool
        Leave nothing out (see `needs`).

    Raises
    ------
    InputError
        If the estimator is random, or the tolerance is not in (0, 1).
    """
    _, geometry, needs = prepare(scene, everything)
    refuse_noise(scene, estimator, needs, tolerance, "an image of pixels by area")
    if is_crowded(geometry):
        image, error, evaluations, busy = render_crowded(scene, estimator, tolerance, executor)
        return AreaImage(image, error, tolerance, evaluations, 0, busy)
    digest = scene.digest()
    _, _, regions = regions_of(scene, digest, everything)
    palette = palette_of(scene, regions, needs)
    shade = Shader(Work(scene, digest, estimator, everything, tolerance), executor, palette)
    shown = shown_by(regions, tolerance)
    shadows = Needs((), ()) if estimator.claim(needs) == "biased" else needs  # who leaves them out has none
    first = first_values(regions, palette, shown, shade, tolerance, shadows, needs)
    jumps = any(not source.has_extent and not source.blockers.none for source in needs.sources)
    others = first.square - first.items.square

    def budget(square: float) -> float:
        all_ = (ROOM * tolerance) ** 2 * (others + square)
        return max(all_ - first.settled, all_ / 4)  # what cannot be mended is said, and the rest done

    def doubt(x: Floats, y: Floats, region: Ints, size: float) -> Bools:
        return doubtful(regions, shadows.sources, x, y, region, size) | (first.convergence.radius(x, y, region) < size)

    rest = first.settled + refine(first.items, shown.edges, regions, shade, budget, jumps, doubt)
    image = _assemble(scene, regions, palette, shown, first, needs.left_out)
    square = others + first.items.square
    error = min(math.sqrt(rest / square), 1.0) if square > 0 else float(rest > 0)
    parts = int(shown.pieces.cell.size)
    return AreaImage(image, error, tolerance, shade.evaluations, parts, int(shown.sampled.pixel.size))


def _assemble(
    scene: Scene, regions: Regions, palette: Palette, shown: Shown, first: First, left_out: tuple[LeftOut, ...]
) -> Image:
    """Sum of all items in each pixel, and what is seen without being shaded."""
    height, width = scene.height, scene.width
    items, value, pieces = first.items, first.image.reshape(first.image.shape[0], -1), shown.pieces
    whole, parts = np.flatnonzero(items.whole), np.flatnonzero(~items.whole)
    value[:, items.pixel[whole]] = items.value[:, whole]
    surface, split = first.surface.ravel(), surface_of(pieces.region, regions.surfaces)
    mean = palette.radiance(value, surface)
    for pixel, region, light in (
        (items.pixel[parts], items.region[parts], items.area[parts] * items.value[:, parts]),
        (first.pieces.cell, first.pieces.region, first.pieces.area * first.piece),
    ):
        _add(mean, pixel, palette.radiance(light, surface_of(region, regions.surfaces)))
    shines: Bools = np.asarray(palette.seen.any(axis=0))
    lit, cut = np.flatnonzero(np.take(shines, surface)), np.flatnonzero(shines[split])
    for out, seen in zip(mean, palette.seen, strict=True):
        out[lit] += seen[surface[lit]]
    _add(mean, pieces.cell[cut], pieces.area[cut] * palette.seen[:, split[cut]])

    def share(kind: Bools) -> Floats:
        """Of each pixel, summed over its pieces."""
        out = np.take(kind.astype(np.float64), surface)
        np.add.at(out, pieces.cell, pieces.area * kind[split])
        cut = out[pieces.cell]
        out[pieces.cell] = np.where(cut < SURE, 0.0, np.where(cut > 1 - SURE, 1.0, cut))
        return out.reshape(height, width)

    nothing = np.arange(regions.surfaces + 2) == regions.surfaces
    back = share(palette.back) if palette.back.any() else np.zeros(0)
    mean = mean.reshape(3, height, width)
    return Image.without_noise(mean, share(palette.emitter), share(nothing), int(np.count_nonzero(back)), left_out)


def _add(image: Floats, pixel: Ints, light: Floats) -> None:
    """Add light (c, k) to the pixels (k,) of an image (c, n)."""
    for out, channel in zip(image, light, strict=True):
        np.add.at(out, pixel, channel)
