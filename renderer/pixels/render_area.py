"""The image whose pixels are averages over their areas, from an estimator without noise, to a tolerance.

Where the edges run is one question, how bright it is between them another. The first is answered exactly (see
`edge_fragments`, `moments`), the second by as few evaluations as the tolerance allows (see `interpolation`,
`shadow_fits`, `refine`).
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

from .candidate_edges import find_lines, searched
from .doubt import doubtful
from .edge_fragments import bits_of, cut_at_crossings
from .first_estimates import first_estimates, means
from .interpolation import WITHIN, error_bound, fill_centres, shifted
from .moments import Edges, Pieces, pieces_of, visible_edges
from .refine import Items, refine
from .regions import Regions
from .render_centre import refuse_noise
from .render_crowded import render_crowded
from .sampled import HALF_PLANE, Sampled, rays_in, resampled, shares_error
from .shade import Palette, Shader, Work, palette_of, regions_of, surface_of, unshadowed
from .small_faces import bodies, fitted, on_small_faces
from .supersampling import is_crowded

EDGE = -2
"""Region of a pixel that an edge crosses."""
RUN = 16
"""Pixels of a row that one ray may speak for."""
SHARE = 0.5
"""Of the tolerance, that interpolated centres may spend."""
FITTED = 0.25
"""The same, that values on small faces may be fitted to."""
UNSEEN = 0.25
"""Of the unshadowed radiance, that a shadow which fits in a pixel may be worth."""
DEEP = 1 / 64
"""Of the unshadowed radiance, below which nothing follows from what is around: how much of a light is seen grows with
the square of the way into the penumbra, or its cube, from nothing."""
ROOM = 0.8
"""Of the tolerance, that estimates may add up to: they are no bounds. Without room the error was 0.2 of the tolerance
at the median and 1.09 at worst, over 75 images of 15 views 64 pixels high."""


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
    refuse_noise(estimator, needs, tolerance, "pixels by area")
    if is_crowded(geometry):
        image, error, evaluations, busy = render_crowded(scene, estimator, tolerance, executor)
        return AreaImage(image, error, tolerance, evaluations, 0, busy)
    _, _, regions = regions_of(scene, scene.digest(), everything)
    shade = Shader(Work(scene, scene.digest(), estimator, everything, tolerance), executor)
    palette = palette_of(scene, regions, needs)
    edges, region, pieces, sampled = _cut(regions, tolerance)
    shadows = Needs((), ()) if estimator.claim(needs) == "biased" else needs  # who leaves them out has none
    base = _base(regions, palette, region, pieces, sampled, shade, tolerance, shadows)
    jumps = any(not source.has_extent and not source.blockers.none for source in needs.sources)
    budget = (ROOM * tolerance) ** 2 * base.square
    budget = max(budget - base.settled, budget / 4)  # what cannot be mended is said, and the rest done

    def doubt(x: Floats, y: Floats, region: Ints, size: float) -> Bools:
        return doubtful(regions, shadows.sources, x, y, region, size)

    rest = base.settled + refine(base.items, edges, regions, shade, budget, jumps, doubt)
    image = _assemble(scene, regions, palette, region, pieces, base, needs.left_out)
    square = max(base.square, float((image.mean[:, image.shaded] ** 2).sum()))  # what was first found may be nothing
    error = min(math.sqrt(rest / square), 1.0) if square > 0 else float(rest > 0)
    parts = int((~base.items.whole).sum())
    return AreaImage(image, error, tolerance, shade.evaluations, parts, int(sampled.pixel.size))


@dataclass(frozen=True)
class _Base:
    """First values.

    Parameters
    ----------
    items : Items
        What may be refined.
    image : (3, h, w) float64
        Means of the whole pixels.
    square, settled : float
        Sum of all squared radiance; and of the squared errors allowed to what is not refined.
    """

    items: Items
    image: Floats
    square: float
    settled: float


def _cut(regions: Regions, tolerance: float) -> tuple[Edges, Ints, Pieces, Sampled]:
    """Visible edges; the region of every pixel (EDGE where one passes); pieces; pixels found by rays."""
    width, height = regions.lens.width, regions.lens.height
    lines = find_lines(regions.geometry, regions.faces, regions.planes, regions.lens)
    bits, crowded = cut_at_crossings(bits_of(lines, width, height))
    edges = visible_edges(bits, regions)
    pieces, bad = pieces_of(edges, width, 1, regions)
    crossed = np.unique(pieces.cell)
    region = _whole_regions(regions, crossed, searched(regions.geometry) and not bad.size and not crowded.size)
    if _missed(region.reshape(height, width)).size:
        region = _whole_regions(regions, crossed, False)
    sampled = np.unique(np.concatenate((bad, crowded, _missed(region.reshape(height, width)))))
    rays = rays_in(sampled, width * height, tolerance)
    pieces = resampled(pieces, sampled, rays, regions)
    region[sampled] = EDGE
    return edges, region, pieces, Sampled(sampled, HALF_PLANE * rays.shape[1] ** -0.75)


def _whole_regions(regions: Regions, crossed: Ints, runs: bool) -> Ints:
    """Regions (h w,) of all pixels, EDGE for those that an edge crosses.

    Rays for both ends of each run of pixels between edges in a row and now and then between, where all lines were
    looked for; else one for each pixel. A lost edge has an end, where some pixel's books do not balance, or parts a
    run, whose ends then differ.
    """
    width, height = regions.lens.width, regions.lens.height
    start = np.zeros(width * height, dtype=bool)
    start[:: RUN if runs else 1] = True
    for pixel in (np.arange(0, start.size, width), crossed + 1, crossed):
        start[np.minimum(pixel, start.size - 1)] = True
        start[np.maximum(pixel - 1, 0)] = True
    first = np.flatnonzero(start)
    seen = regions.seen(first % width + 0.5, first // width + 0.5)
    region = np.repeat(seen, np.diff(np.append(first, start.size)))
    region[crossed] = EDGE
    return region


def _missed(region: Ints) -> Ints:
    """Pixels whose neighbour shows another region though no edge was found in either."""
    wrong = np.zeros(region.shape, dtype=bool)
    for dy, dx in ((0, 1), (1, 0)):
        beside = shifted(region, dy, dx, EDGE)
        apart = (region != beside) & (region != EDGE) & (beside != EDGE)
        wrong |= apart | shifted(apart, -dy, -dx, False).astype(bool)
    return np.flatnonzero(wrong)


def _base(
    regions: Regions,
    palette: Palette,
    region: Ints,
    pieces: Pieces,
    sampled: Sampled,
    shade: Shader,
    tolerance: float,
    needs: Needs,
) -> _Base:
    """First values of all pixels and pieces, and those that may be refined."""
    width, height = regions.lens.width, regions.lens.height
    surface = surface_of(np.maximum(region, -1), regions.surfaces)
    fillable = np.where((region != EDGE) & palette.reflects[surface], region, EDGE).reshape(height, width)
    mine = np.flatnonzero(palette.reflects[surface_of(pieces.region, regions.surfaces)])
    every = np.flatnonzero(fillable != EDGE)
    place = (
        np.concatenate((every % width + 0.5, pieces.x[mine])),
        np.concatenate((every // width + 0.5, pieces.y[mine])),
        np.concatenate((region[every], pieces.region[mine])),
        np.concatenate((np.ones(every.size), pieces.area[mine])),
    )
    doubt = doubtful(regions, needs.sources, *place[:3])
    body = bodies(regions, place[2])
    small = on_small_faces(place[2], body) & bool(needs.sources)
    alone = np.zeros(fillable.shape, dtype=bool)
    alone.reshape(-1)[every] = doubt[: every.size]
    tiny, bits = every[small[: every.size]], small[every.size :]
    fillable.reshape(-1)[tiny] = EDGE

    def evaluate(pixel: Ints) -> Floats:
        return shade(pixel % width + 0.5, pixel // width + 0.5, region[pixel])

    def allowed(first: Floats) -> float:
        return SHARE * tolerance * math.sqrt(float((first**2).sum()) / max(first.shape[1], 1))

    centre, bound, smooth = fill_centres(fillable, evaluate, allowed, alone)
    piece_value, others = np.zeros((3, mine.size)), mine[~bits]
    piece_value[:, ~bits] = shade(pieces.x[others], pieces.y[others], pieces.region[others])
    image = means(centre, fillable)
    image[:, fillable == EDGE] = 0
    square = float(np.einsum("chw,chw->", image, image)) + float(((piece_value * pieces.area[mine]) ** 2).sum())
    on_faces = place[0][small], place[1][small], place[2][small], place[3][small]
    places = fitted(regions, needs, shade, on_faces, UNSEEN * doubt[small], (FITTED * tolerance, square))
    piece_value[:, bits] = places.value[:, tiny.size :]
    full = np.flatnonzero((fillable != EDGE) & ~smooth)  # the others are done: their errors are bounded
    whole = np.concatenate((full, tiny))
    pixel = np.concatenate((whole, pieces.cell[mine]))
    x = np.concatenate((whole % width + 0.5, pieces.x[mine]))
    y = np.concatenate((whole // width + 0.5, pieces.y[mine]))
    mean = np.hstack((image.reshape(3, -1)[:, full], places.value[:, : tiny.size], piece_value))
    which = np.concatenate((region[whole], pieces.region[mine]))
    total = centre.sum(axis=0)
    estimate = np.full(pixel.size, np.inf)
    estimate[: full.size] = error_bound(total, fillable, WITHIN, full)
    from_fits = np.concatenate((np.zeros(full.size, dtype=bool), np.ones(tiny.size, dtype=bool), bits))
    estimate[from_fits] = places.error / np.where(places.known, 1.0, np.sqrt(places.area))
    lone = np.flatnonzero(~np.isfinite(estimate))
    brightest = np.zeros(pixel.size)
    estimate[lone], brightest[lone] = first_estimates(
        total, fillable, pixel[lone], which[lone], x[lone], y[lone], mean.sum(axis=0)[lone]
    )
    hidden = regions.seen(pieces.x[mine], pieces.y[mine]) != pieces.region[mine]
    label = np.where(small, -2 - body, place[2])[every.size :]  # all small faces of a body are one
    uncut = hidden | np.isin(pieces.cell[mine], sampled.pixel) | _junction(pieces, mine, label)
    rough = np.concatenate((np.zeros(whole.size, dtype=bool), uncut)) & ~from_fits
    area = np.concatenate((np.ones(whole.size), pieces.area[mine]))
    # A dark value proves nothing where it is doubtful: what is beside it may be the truth of half the piece.
    estimate = np.where(rough, np.maximum(np.sqrt((mean**2).sum(axis=0)), brightest / math.sqrt(3)), estimate)
    most, size = np.zeros(pixel.size), np.sqrt((mean**2).sum(axis=0))
    unsure = np.concatenate((alone.reshape(-1)[whole], doubt[every.size :]))
    some = np.union1d(np.flatnonzero(unsure), lone)
    most[some] = np.sqrt((unshadowed(regions, needs, x[some], y[some], which[some]) ** 2).sum(axis=0))
    lost = UNSEEN * most * np.where(from_fits, places.worth, 1.0)
    estimate = np.where(unsure, np.maximum(estimate, lost), estimate) * area
    dark = (size < DEEP * most) & (estimate < lost) & ~from_fits
    items = Items(
        pixel=pixel,
        region=which,
        area=area,
        x=x,
        y=y,
        covariance=np.hstack((np.zeros((3, whole.size)), pieces.covariance[:, mine])),
        value=mean,
        estimate=estimate,
        level=np.zeros(pixel.size, dtype=np.int64),
        whole=np.arange(pixel.size) < whole.size,
        dark=dark,
        lost=np.where(unsure, lost, 0.0) * area,
    )
    square = float(np.einsum("chw,chw->", image, image)) + float(
        (mean[:, full.size :] ** 2 * area[full.size :] ** 2).sum()
    )
    settled = float((bound[smooth] ** 2).sum()) + shares_error(pieces.cell[mine], piece_value, sampled)
    return _Base(items, image, square, settled)


def _junction(pieces: Pieces, mine: Ints, label: Ints) -> Bools:
    """Pieces ``mine`` of pixels that show three regions or more: where a solid's corner stands, its shadow starts.

    Those labelled alike are one.
    """
    region = pieces.region.copy()
    region[mine] = label
    pair = np.unique(np.stack((pieces.cell, region)), axis=1)
    cell, count = np.unique(pair[0], return_counts=True)
    return np.asarray(count[np.searchsorted(cell, pieces.cell[mine])] > 2)


def _assemble(
    scene: Scene,
    regions: Regions,
    palette: Palette,
    region: Ints,
    pieces: Pieces,
    base: _Base,
    left_out: tuple[LeftOut, ...],
) -> Image:
    """Sum of all items in each pixel, and what is seen without being shaded."""
    height, width = scene.height, scene.width
    count = height * width
    items, mean = base.items, base.image.reshape(3, -1).copy()
    mean[:, items.pixel[items.whole]] = items.value[:, items.whole]
    parts = np.flatnonzero(~items.whole)
    for out, channel in zip(mean, items.value, strict=True):
        out += np.bincount(items.pixel[parts], items.area[parts] * channel[parts], count)
    surface, split = surface_of(region, regions.surfaces), surface_of(pieces.region, regions.surfaces)
    whole = region != EDGE
    surface[~whole] = regions.surfaces

    def share(kind: Floats | Bools) -> Floats:
        """Of each pixel, summed over its pieces."""
        return kind[surface] * whole + np.bincount(pieces.cell, pieces.area * kind[split], count)

    for out, seen in zip(mean, palette.seen, strict=True):
        if seen.any():
            out += share(seen)
    image: Floats = mean.reshape(3, height, width)
    nothing = np.arange(regions.surfaces + 1) == regions.surfaces
    emitter, background = (_snapped(share(kind)).reshape(height, width) for kind in (palette.emitter, nothing))
    back_faces = int((_snapped(share(palette.back)) > 0).sum())
    return Image.without_noise(image, emitter, background, back_faces, left_out)


def _snapped(share: Floats) -> Floats:
    """Shares of a pixel; within 1e-6 of nothing or all they are that."""
    return np.where(share < 1e-6, 0.0, np.where(share > 1 - 1e-6, 1.0, share))
