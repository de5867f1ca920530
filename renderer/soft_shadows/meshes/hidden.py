"""Irradiance that a closed surface keeps from points, block by block of neighbouring points."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.lights import QuadLight
from nusselt.renderer.needs import Source
from nusselt.renderer.vectors import Floats, Ints, column, distinct, dot
from nusselt.renderer.visibility.bvh import morton
from nusselt.renderer.visibility.shared_points import CommonVisibility
from nusselt.renderer.visibility.silhouette import Outline

from .contour import Rim, before_corner, layers, on_left, pieces
from .light_frame import Candidates, LightFrame
from .overlap import Merging, extra_layers
from .rounding import on_folds, rounding

LEVELS = (2048, 256, 64)
"""Points in the blocks for which candidate edges are sought, each within the one before."""

SPOT = (0.3819660112501051, 0.2763932022500210)
"""A point of the light, where it is seen whether anything is in the way: one that nobody's coordinates meet."""

NEARER = (1.0, 2.0**-8, 2.0**-16, 2.0**-24, 0.0)
"""How much nearer to its first corner for points whose horizon hides that."""

PAIRS = 1 << 19
"""Edge-point pairs looked at at once."""

ROUGH = (
    (7e-3, 0, Merging(32, 32)),
    (3e-3, 0, Merging(16, 64)),
    (9e-4, 1 << 15, Merging(8, 128)),
    (9e-5, 1 << 15, Merging(4, 128)),
)
"""From which tolerance of an image and for how many edges, which make strips narrow, strips of overlapping layers are
merged: the tolerance is six times what that changes, or more."""

WORTH = 1 << 18
"""Edge-point pairs in a block up to which it costs less to look at all than to divide it, where bits do not matter."""


def shines_clear(source: Source) -> bool:
    """Whether there is nothing in a quad light's way, or a closed surface wholly on its shining side."""
    if source.blockers.hierarchy is None:
        return True
    outline, light = CommonVisibility.of(source.blockers, source.light).outline, source.light.parallelogram()
    if outline is None or light is None:
        return False
    frame = LightFrame.of(light)
    return bool(min(frame.point(ends)[2].min(initial=1) for ends in (outline.start, outline.end)) > 0)


def hidden_irradiance(
    source: Source,
    x: Floats,
    n: Floats,
    outside: NDArray[np.bool_] | None = None,
    tolerance: float = 0.0,
) -> tuple[Floats, Floats]:
    """What the surface in the source's hierarchy keeps from points, for unit radiance, and a bound of its error.

    Parameters
    ----------
    source : Source
        A quad light, and blockers whose hierarchy is a closed surface wholly on the light's shining side.
    x, n : (3, m) float64
        Points, outside the surface or on it, and unit normals.
    outside : (m,) bool, optional
        See `ShadingPoints`.
    tolerance : float
        Of an image: what takes less time and changes that by much less is done (see `ROUGH`, `WORTH`); 0 for none.

    Returns
    -------
    value, bound : (m,) float64
        Irradiance, relative to radiance 1, and a bound of its absolute error: see `rounding`; infinite with a
        tolerance, where nobody asks for it.

    Raises
    ------
    ValueError
        If the source is not of that kind.
    """
    view, light = CommonVisibility.of(source.blockers, source.light), source.light.parallelogram()
    if view.outline is None or light is None:
        raise ValueError("a quad light and a closed surface before it are needed")
    if not shines_clear(source):
        raise ValueError("the surface reaches behind the light")
    out = np.zeros((2, x.shape[1]))
    own = LightFrame.of(light)
    height = dot(n[:, None, :], own.rim[:, :, None] - x[:, None, :])
    highest = np.where((height.max(axis=0) > 0) & (own.point(x)[2] > 0), height.argmax(axis=0), -1)
    for corner in distinct(highest[highest >= 0]).tolist():
        # The rim is walked from the corner that is highest over the point's horizon.
        k = np.flatnonzero(highest == corner)
        around = None if outside is None else outside[k]
        out[:, k] = _from_corner(view, LightFrame.turned(light, corner), x[:, k], n[:, k], around, tolerance)
    return out[0], out[1]


@dataclass(frozen=True, eq=False)
class Points:
    """Receivers, neighbours next to each other.

    Parameters
    ----------
    x, n, local : (3, m) float64
        Points, unit normals, and the points in the light's frame.
    spot : (2, m) float64
        A point of the light above the horizon.
    within : (m,) int64
        Layers before that.
    """

    x: Floats
    n: Floats
    local: Floats
    spot: Floats
    within: Ints

    def part(self, s: slice) -> Points:
        return Points(self.x[:, s], self.n[:, s], self.local[:, s], self.spot[:, s], self.within[s])


@lru_cache(maxsize=8)
def _candidates(outline: Outline, light: QuadLight) -> Candidates:
    return Candidates.of(outline, LightFrame.of(light))


def _from_corner(
    view: CommonVisibility,
    frame: LightFrame,
    x: Floats,
    n: Floats,
    outside: NDArray[np.bool_] | None,
    tolerance: float,
) -> Floats:
    """For points whose horizon is below the frame's first corner."""
    out = np.zeros((2, x.shape[1]))
    if view.outline is None:
        return out
    everything = _candidates(view.outline, frame.light)
    low, high = x.min(axis=1, keepdims=True), x.max(axis=1, keepdims=True)
    span = np.where(high > low, high - low, 1.0)
    order = np.argsort(morton(2 * (x - low) / span - 1), kind="stable")
    x, n = x[:, order], n[:, order]
    points = Points(x, n, frame.point(x), *_layers(view, frame, x, n, None if outside is None else outside[order]))
    _blocks(
        everything,
        points,
        frame,
        _Plan(WORTH if tolerance else 0, _merging(tolerance, everything.count), not tolerance),
        order,
        out,
    )
    return out


def _layers(
    view: CommonVisibility, frame: LightFrame, x: Floats, n: Floats, outside: NDArray[np.bool_] | None
) -> tuple[Floats, Ints]:
    """A point of the light (2, m) above each horizon, and how many layers lie before it, (m,)."""
    spot, within = np.zeros((2, x.shape[1])), np.zeros(x.shape[1], dtype=np.int64)
    left = np.arange(x.shape[1])
    for share in NEARER:
        at = share * column((*SPOT, 0))[:2]
        eye = frame.rim[:, :1] + at[0] * column(frame.light.ab) + at[1] * column(frame.light.ac)
        above = dot(n[:, left], eye - x[:, left]) > 0 if share > 0 else np.ones(left.size, dtype=bool)
        k, left = left[above], left[~above]
        if k.size:
            spot[:, k] = at
            within[k] = view.layers(x[:, k], eye - x[:, k], eye, None if outside is None else outside[k])
    return spot, within


@dataclass(frozen=True)
class _Plan:
    """Which blocks are divided, and how their layers are looked at.

    Parameters
    ----------
    worth : int
        Pairs of an edge and a point in a block beyond which it is divided.
    merging : Merging or None
        Of strips.
    bounded : bool
        Whether errors are.
    sizes : tuple of int
        Points in blocks, level by level.
    """

    worth: int
    merging: Merging | None
    bounded: bool
    sizes: tuple[int, ...] = LEVELS


def _merging(tolerance: float, edges: int) -> Merging | None:
    """Which strips may be taken as one."""
    return next((merging for rough, many, merging in ROUGH if tolerance >= rough and edges >= many), None)


def _blocks(edges: Candidates, points: Points, frame: LightFrame, plan: _Plan, names: Ints, out: Floats) -> None:
    """Blocks within blocks; one that no edge reaches has one number of layers, and no strips."""
    size, count = plan.sizes[0], points.within.size
    for first in range(0, count, size):
        s = slice(first, first + size)
        some = points.part(s)
        near = edges.near(some.x, some.local)
        if len(plan.sizes) > 1 and near.count * some.within.size > plan.worth:
            _blocks(near, some, frame, replace(plan, sizes=plan.sizes[1:]), names[s], out)
            continue
        step = max(1, PAIRS // max(near.count, 1))
        for begin in range(first, min(first + size, count), step):
            t = slice(begin, min(begin + step, first + size))
            out[:, names[t]] = _block(near, points.part(t), frame, plan)


def _block(edges: Candidates, points: Points, frame: LightFrame, plan: _Plan) -> tuple[Floats, Floats]:
    """Hidden irradiance, and a bound of its error if it is asked for."""
    x, n = points.x, points.n
    size = edges.size + np.abs(x).max(axis=0)
    height = edges.heights(x)
    cut = pieces(edges, height, x, n, points.local, frame)
    rim = Rim.of(x, n, frame, size)
    at, jump = on_left(cut, rim)
    start = before_corner(cut, at, jump, points.spot, points.within)
    value, doubt = layers(cut, rim, n, start, size)
    extra, more, lengths = extra_layers(cut, rim, x, n, start, at, jump, frame, plan.merging)
    if not plan.bounded:
        return value - extra, np.full(value.size, np.inf)
    error = rounding(cut, x, n, size, frame, doubt + more, lengths)
    return value - extra, np.where(on_folds(edges, height, x, n, size), np.inf, error)
