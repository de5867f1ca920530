"""Where a difference is: single pixels, a row, a tile; a thing, a light's shadow, lights and background, edges."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import ndimage

from nusselt.renderer.vectors import Bools, Floats
from nusselt.renderer.words import count

from .case import Case
from .objects import bodies
from .transport import said

Kind = Literal["thing", "tile", "else"]

MOST = 0.8
"""Share of the difference from which a place holds it."""
PART = 0.4
"""Share from which a place is worth telling."""
LIFT = 1.5
"""Times the place's share of the pixels, at least."""
ALONE = 8.0
"""Deviations from which a pixel is off, and the others around it are not half as far."""
FEW = 0.02
"""Share of the pixels, at most, that are single ones."""
BLOCK = 16
"""Pixels a side of the tiles that are looked at alone."""
BESIDE = 2
"""Pixels about a thing."""
NAMED = 5
"""Pixels that are named."""


@dataclass(frozen=True)
class Region:
    """Pixels (n,), and words for them."""

    words: str
    mask: Bools
    kind: Kind = "else"


@dataclass(frozen=True)
class Place:
    """Where a difference is.

    Parameters
    ----------
    where : str
        In words.
    share : float
        Of the difference beyond noise.
    pixels : float
        Share of the compared pixels.
    change : float
        Mean difference there over the truth's mean there; NaN where that is black.
    kind : {"thing", "tile", "else"}
        What it is a place of.
    """

    where: str
    share: float
    pixels: float
    change: float
    kind: Kind = "else"

    @property
    def said(self) -> str:
        """In a sentence."""
        changed = "" if not np.isfinite(self.change) or abs(self.change) < 5e-4 else f", {self.change:+.1%} on average"
        return f"{self.share:.0%} of the difference is {self.where}: {self.pixels:.1%} of the pixels{changed}"


def places(case: Case) -> tuple[Place, ...]:
    """The smallest places that hold the difference, or much of it; none where it is everywhere.

    Where values are no numbers, their pixels alone.
    """
    single = _single_pixels(case)
    if single is not None:
        return (single,)
    left, error = _beyond_noise(case)
    total = float(left[case.valid].sum())
    if total <= 4 * error:
        return ()
    valid = max(int(case.valid.sum()), 1)
    found = []
    for region in _regions(case):
        some = region.mask & case.valid
        share, pixels = float(left[some].sum()) / total, float(some.sum()) / valid
        if pixels and share > PART and share > LIFT * pixels:
            found.append(Place(region.words, min(share, 1.0), pixels, _change(case, some), region.kind))
    tiles, things = ([one for one in found if one.kind == kind] for kind in ("tile", "thing"))
    holding = sorted((one for one in found if one.share >= MOST and one not in tiles), key=lambda one: one.pixels)[:2]
    held = [one for one in tiles if one.share >= MOST]
    if held and not (holding and holding[0].pixels < 2 * held[0].pixels):
        holding.insert(0, held[0])
    if not any(one in things for one in holding):  # and the thing that most of it is on
        holding += sorted(things, key=lambda one: one.pixels - one.share)[:1]
    return tuple(holding) or tuple(sorted(found, key=lambda one: one.pixels - one.share)[:2])


def _change(case: Case, some: Bools) -> float:
    right = float(case.truth[:, some].mean())
    return float((case.observed - case.truth)[:, some].mean()) / right if right > 0 else float("nan")


def _beyond_noise(case: Case) -> tuple[Floats, float]:
    """Squared differences (n,) over the square of a usual radiance, without noise; and the sum's standard error."""
    one, other = case.right.halves
    scale = case.floor**2 + np.median(case.variance[case.shaded]) if case.shaded.any() else case.floor**2
    product = (one * other).mean(axis=0)
    if len(case.images) == 1:
        product = product - case.variance
    error = np.sqrt(float(((2 * case.variance / scale)[case.valid] ** 2).sum()))
    return np.asarray(product / scale), float(error)


def _regions(case: Case) -> Iterator[Region]:
    probe = case.probe
    sight = probe.sight
    yield Region("in lights that are seen", sight.light >= 0)
    yield Region("on the background", sight.surface < 0)
    yield Region("at the edges of things", case.beside)
    lit = sight.lit

    def of_points(some: Bools) -> Bools:
        mask = np.zeros(case.truth.shape[1], dtype=bool)
        mask[lit[some]] = True
        return mask

    for thing in bodies(probe):
        yield Region(f"on {thing.said}", thing.shown & case.lit, "thing")
        near = ndimage.binary_dilation(probe.grid(thing.shown.astype(float)), iterations=BESIDE).ravel()
        yield Region(f"on and about {thing.said}", near, "thing")
        yield Region(f"at the edges of {thing.said}", near & case.beside, "thing")
    for path in probe.paths:
        bare = path.unshadowed
        would = (bare.worth * np.maximum(bare.cosine, 0)).max(axis=1) > 0
        seen = path.beams.seen.mean(axis=1)
        kinds = {"half shadow": (seen > 0) & (seen < 1), "full shadow": seen == 0, "open light": seen == 1}
        for kind, some in kinds.items():
            if kind != "open light":
                yield Region(f"in the {kind} of {said(path)}", of_points(some & would))
            elif len(probe.paths) > 1:
                yield Region(f"where {said(path)} is open", of_points(some & would))
        yield Region(f"in the shadows of {said(path)}", of_points((seen < 1) & would))
        yield Region(f"on what faces away from {said(path)}", of_points(~would))
    yield Region("on glossy things", of_points(sight.points.specular.max(axis=0, initial=0) > 0))
    yield from _stripes(case)


def _stripes(case: Case) -> Iterator[Region]:
    """The row, the column and the tile that are off most."""
    squares = np.where(case.valid, case.right.squares, 0.0)
    grid = case.probe.grid(squares)
    rows, columns = (
        case.probe.grid(v.ravel().astype(float)).astype(int) for v in (case.probe.rows, case.probe.columns)
    )
    row, column = int(grid.sum(axis=1).argmax()), int(grid.sum(axis=0).argmax())
    yield Region(f"in row {rows[row].min()}", _mask(grid.shape, (slice(row, row + 1), slice(None))))
    yield Region(f"in column {columns[:, column].min()}", _mask(grid.shape, (slice(None), slice(column, column + 1))))
    around = ndimage.uniform_filter(grid, BLOCK, mode="constant")
    y, x = np.unravel_index(int(around.argmax()), grid.shape)
    top, left = max(int(y) - BLOCK // 2, 0), max(int(x) - BLOCK // 2, 0)
    told = f"in the pixels about column {columns[0, x]}, row {rows[y, 0]}"
    yield Region(told, _mask(grid.shape, (slice(top, top + BLOCK), slice(left, left + BLOCK))), "tile")


def _mask(shape: tuple[int, ...], some: tuple[slice, slice]) -> Bools:
    mask = np.zeros(shape, dtype=bool)
    mask[some] = True
    return mask.ravel()


def _single_pixels(case: Case) -> Place | None:
    """Pixels of the whole image that are off alone, where they hold the difference."""
    given = case.given
    decoded = np.stack([given.quantiser.decode(raw) for raw in given.raws])
    finite = np.asarray(np.isfinite(decoded).all(axis=(0, 1)))
    step = np.where(finite & given.judged, np.nan_to_num(decoded).mean(axis=0) - given.mean, 0.0)
    usual = np.nan_to_num(case.variance)
    noise = case.probe.spread_out(np.sqrt(np.maximum(case.smooth(usual, case.shaded), 0)) + case.floor)
    worst = np.abs(step).max(axis=0) / noise
    around = ndimage.median_filter(worst, 5)
    lost = given.judged & ~finite
    off = lost if lost.any() else np.logical_and(given.judged, (worst > ALONE) & (worst > 4 * around))
    squares = np.where(finite, (step**2).mean(axis=0) / noise**2, 0.0)
    share = float(squares[off].sum()) / max(float(np.maximum(squares - 1 / len(decoded), 0).sum()), 1e-300)
    pixels = float(off.mean())
    if not lost.any() and (not off.any() or pixels > FEW or share < MOST):
        return None
    beside = ndimage.maximum_filter(given.mean.mean(axis=0), 3) - ndimage.minimum_filter(given.mean.mean(axis=0), 3)
    if not lost.any() and float((beside[off] > 0.3 * np.maximum(given.mean.mean(axis=0)[off], 1e-300)).mean()) > 0.5:
        return None  # an edge, not pixels
    y, x = np.nonzero(off)
    named = ", ".join(f"({a}, {b})" for a, b in zip(x[:NAMED], y[:NAMED], strict=False))
    more = f" and {off.sum() - NAMED} more" if off.sum() > NAMED else ""
    kind = "pixel" if lost.any() else "single pixel"
    words = f"in {count(int(off.sum()), kind)}{' not finite' if lost.any() else ''}, (column, row) {named}{more}"
    right = float(given.mean[:, off].mean())
    change = float(step[:, off].mean()) / right if right > 0 else float("nan")
    return Place(words, 1.0 if lost.any() else min(share, 1.0), pixels, change)
