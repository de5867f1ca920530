"""Shadows on many small faces, fitted over patches of the image as far as measured errors allow.

Radiance jumps from one facet of a mesh to the next, but what share of a light is hidden hardly does. So the unshadowed
radiance is found of every place, which is cheap, and the hidden share of a few in each patch: a plane over the image
is fitted to it. Then the patches are divided, and the places asked in the smaller ones measure what the plane before
missed. Where that is little enough, nothing more is asked, and the plane of the smaller patches, fitted to what was
left, is the better one that is used. Last come the faces themselves, and then each place.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nusselt.renderer.vectors import Bools, Floats, Ints, distinct

SIDES = (32, 16, 8, 4)
"""Pixels a side of the patches, level by level; faces are the level after them."""
FACES = 3
"""In a patch, on average, below which faces are taken instead."""
MANY, FEW = 4, 3
"""Places asked along each diagonal of a patch, and of a face."""
PRIOR = 1.0
"""Places with the mean squared miss of all patches, added to those of each: one without a miss may have been lucky."""
RIDGE = 0.1
"""Places, of a patch's mean weight, that hold a plane's coefficients at 0: few places do not tilt it."""
BESIDE = 1 / 8
"""Of what a place's own value misses the plane around it by: how far its mean may be from it."""

TRIED = 512
"""Places that are asked to find what shadows that fit in a pixel are worth."""

Shade = Callable[[Ints], Floats]
"""From numbers of places (k,) to their radiance (c, k)."""


@dataclass
class Places:
    """Places in the image that show small faces, and what is known of their radiance.

    Parameters
    ----------
    x, y, area : (n,) float64
        Pixels; share of the pixel.
    face, body : (n,) int64
        Which face each shows, and what that is part of: nothing is fitted across bodies.
    free : (c, n) float64
        Unshadowed radiance; see `shade.Palette.told`.
    lost : (n,) float64
        What shadows that fit in a pixel somewhere on its face may be worth, radiance: no plane tells of them.
    value : (c, n) float64
        Radiance: evaluated, or fitted.
    known : (n,) bool
        Evaluated.
    error : (n,) float64
        Estimated: of a fitted value, over its patch; of an evaluated one, how far the mean around it may be from it.
    worth : float
        What ``lost`` was lessened by, as far as it was measured.
    """

    x: Floats
    y: Floats
    area: Floats
    face: Ints
    body: Ints
    free: Floats
    lost: Floats
    value: Floats
    known: Bools
    error: Floats
    worth: float = 1.0

    @classmethod
    def of(cls, x: Floats, y: Floats, area: Floats, face: Ints, body: Ints, free: Floats, lost: Floats) -> Places:
        """Before anything is asked: unshadowed, and known where that is nothing."""
        dark: Bools = (free == 0).all(axis=0)
        return cls(x, y, area, face, body, free, lost, free.copy(), dark, np.zeros(x.size))

    @property
    def brightest(self) -> float:
        """Sum of squared radiance, where nothing is hidden."""
        return float((self.area * self.free**2).sum())

    def ask(self, index: Ints, shade: Shade) -> Floats:
        """Evaluate places (k,); the squared misses (k,) of what was fitted there."""
        value = shade(index)
        miss: Floats = ((value - self.value[:, index]) ** 2).sum(axis=0)
        self.value[:, index], self.known[index] = value, True
        self.error[index] = BESIDE * np.sqrt(miss)
        return miss


def fit_shadows(places: Places, shade: Shade, tolerance: float, others: float) -> None:
    """Evaluate as few places as are needed.

    Parameters
    ----------
    tolerance : float
        What the root of the sum of squared errors of all, weighted by their areas, is to be near: relative to that of
        the radiance, ``others`` included.
    others : float
        Sum of squared radiance of what is no place.
    """
    active: Ints = np.flatnonzero(~places.known)
    if active.size == 0:
        return
    before, budget, levels = places.body, np.inf, _levels(places, active)
    first = [active[_spread(places, patch[active], active, across)] for patch, across in levels[:2]]
    shade = _asked_at_once(places, shade, first, tolerance**2 * (others + places.brightest))
    for level, (patch, across) in enumerate(levels):
        asked = first[level] if level < 2 else active[_spread(places, patch[active], active, across)]
        asked = asked[~places.known[asked]]
        fitted = places.value[:, asked].copy()
        miss = places.ask(asked, shade)
        if level == 0:
            square = float((places.value[:, asked] ** 2).sum()) / max(asked.size, 1)
            budget = tolerance**2 * (others + square * float(places.area.sum()))
        if level == 1:
            _try_doubt(places, shade, budget)
        going, spent = _unsure(places, before, active, asked, miss, budget / 2) if level else (active, 0.0)
        _fit(places, patch, active, asked, fitted)
        budget, active, before = budget - spent, going, patch
    places.ask(active, shade)


def _asked_at_once(places: Places, shade: Shade, levels: list[Ints], budget: float) -> Shade:
    """The same, with what is asked in any case evaluated at once: of some levels, and doubt beyond that budget."""
    first = distinct(np.concatenate(levels))
    known = places.known.copy()
    known[first] = True
    first = np.append(first, _tried(places, known, budget))
    row = np.full(known.size, -1)
    row[first] = np.arange(first.size)
    value = shade(first)

    def remembered(index: Ints) -> Floats:
        new = row[index] < 0
        found = value[:, row[index]]
        if new.any():
            found[:, new] = shade(index[new])
        return found

    return remembered


def _tried(places: Places, known: Bools, budget: float) -> Ints:
    """Places (k,) that tell what shadows that fit in a pixel are worth, if they may be worth half of the budget."""
    k = np.flatnonzero((places.lost > 0) & ~known)
    if (places.area[k] * places.lost[k] ** 2).sum() <= budget / 2:
        return k[:0]
    return k[:: max(1, k.size // TRIED)]


def _levels(places: Places, active: Ints) -> list[tuple[Ints, int]]:
    """Patches (n,), level by level, and how many places are asked along their diagonals; none that hold few faces."""
    faces = _count(places.face[active])
    levels: list[tuple[Ints, int]] = []
    for side in SIDES:
        patch = _patches(places, side)
        if len(levels) == 0 or FACES * _count(patch[active]) <= faces:
            levels.append((patch, MANY))
    return [*levels, (places.face, FEW)]


def _count(names: Ints) -> int:
    """How many different small numbers there are."""
    return int(np.count_nonzero(np.bincount(names)))


def _try_doubt(places: Places, shade: Shade, budget: float) -> None:
    """Lessen what shadows that fit in a pixel may be worth to what some of those places miss their planes by."""
    tried = _tried(places, places.known, budget)
    if tried.size == 0:
        return
    weight, square = places.area[tried], places.lost[tried] ** 2
    most = float((weight * square).sum())
    found = float((weight * places.ask(tried, shade)).sum()) + PRIOR * most / tried.size
    places.worth = min(1.0, float(np.sqrt(found / most)))
    places.lost *= places.worth


def _patches(places: Places, side: int) -> Ints:
    """The patch (n,) of each place, so many pixels a side."""
    down, across = (places.y // side).astype(np.int64), (places.x // side).astype(np.int64)
    return (places.body * (int(down.max(initial=0)) + 1) + down) * (int(across.max(initial=0)) + 1) + across


def _spread(places: Places, patch: Ints, active: Ints, across: int) -> Ints:
    """Which of the ``active`` places (k,) of patches (k,) are spread over their diagonals, ``across`` along each."""
    chosen = []
    for sign in (1, -1):
        order = np.lexsort((places.x[active] + sign * places.y[active], patch))
        first = np.flatnonzero(np.diff(patch[order], prepend=-1))
        last = np.append(first[1:], order.size) - 1
        chosen += [order[first + (last - first) * step // (across - 1)] for step in range(across)]
    return distinct(np.concatenate(chosen))


def _unsure(places: Places, patch: Ints, active: Ints, asked: Ints, miss: Floats, budget: float) -> tuple[Ints, float]:
    """The active places of patches that have to be looked at more closely, and what the others' errors sum to."""
    if miss.size == 0:  # nothing was measured
        return active[~places.known[active]], 0.0
    names, group = np.unique(patch[active], return_inverse=True)
    mine = np.searchsorted(names, patch[asked])
    pooled = float(miss.mean())
    square = (np.bincount(mine, miss, names.size) + PRIOR * pooled) / (np.bincount(mine, minlength=names.size) + PRIOR)
    rest = ~places.known[active]
    weight, lost = places.area[active] * rest, places.lost[active] ** 2
    total = square * np.bincount(group, weight, names.size) + np.bincount(group, weight * lost, names.size)
    order = np.argsort(total, kind="stable")
    sums = np.cumsum(total[order])
    count = int(np.searchsorted(sums, budget, side="right"))
    good = np.zeros(names.size, dtype=bool)
    good[order[:count]] = True
    places.error[active[rest]] = np.sqrt(square[group] + lost)[rest]
    return active[~good[group] & rest], float(sums[count - 1]) if count else 0.0


def _fit(places: Places, patch: Ints, active: Ints, asked: Ints, before: Floats) -> None:
    """Fit planes to the shares that are hidden but not fitted yet, patch by patch, and add them."""
    if asked.size == 0:
        return
    names, group = np.unique(patch[active], return_inverse=True)
    mine, count = np.searchsorted(names, patch[asked]), names.size
    size = np.bincount(group, minlength=count)
    middle = [np.bincount(group, v[active], count) / size for v in (places.x, places.y)]
    away = [v[active] - m[group] for v, m in zip((places.x, places.y), middle, strict=True)]
    spread = np.sqrt(sum(np.bincount(group, way**2, count) for way in away) / size) + 1e-300

    def basis(index: Ints, group: Ints) -> Floats:
        u, v = ((w[index] - m[group]) / spread[group] for w, m in zip((places.x, places.y), middle, strict=True))
        return np.stack((np.ones(index.size), u, v))

    rows = basis(asked, mine)
    weight = (places.free[:, asked] ** 2).sum(axis=0)
    left = np.divide(
        places.value[:, asked] - before,
        places.free[:, asked],
        out=np.zeros_like(before),
        where=places.free[:, asked] > 0,
    )
    normal, right = np.zeros((count, 3, 3)), np.zeros((count, 3, left.shape[0]))
    for i in range(3):
        for j in range(3):
            normal[:, i, j] = np.bincount(mine, weight * rows[i] * rows[j], count)
        for j, channel in enumerate(left):
            right[:, i, j] = np.bincount(mine, weight * rows[i] * channel, count)
    held = RIDGE * normal[:, 0, 0] / np.maximum(np.bincount(mine, minlength=count), 1)
    normal[:, range(3), range(3)] += np.where(held > 0, held, 1.0)[:, None]
    plane = np.linalg.solve(normal, right)
    rest = np.flatnonzero(~places.known[active])
    index, group = active[rest], group[rest]
    share = np.einsum("in,nij->jn", basis(index, group), plane[group])
    free = places.free[:, index]
    places.value[:, index] = np.clip(places.value[:, index] + free * share, 0, free)
