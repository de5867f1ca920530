"""Irradiance that a closed surface keeps from points, block by block of neighbouring points."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.geometry.ragged import take
from nusselt.renderer.lights import QuadLight
from nusselt.renderer.needs import Source
from nusselt.renderer.vectors import Floats, Ints, column, dot
from nusselt.renderer.visibility.bvh import morton
from nusselt.renderer.visibility.shared_points import CommonVisibility
from nusselt.renderer.visibility.silhouette import Outline

from .contour import Pieces, Rim, Silhouettes, before_corner, layers, on_left, pieces
from .light_frame import Candidates, LightFrame
from .overlap import Merging, extra_layers
from .rounding import on_folds, rounding

LEVELS = (2048, 256, 64)
"""Points in the blocks for which candidate edges are sought, each within the one before."""

SPOT = (0.3819660112501051, 0.2763932022500210)
"""A point of the light, where it is seen whether anything is in the way: one that nobody's coordinates meet."""

NEARER = (1.0, 2.0**-8, 2.0**-16, 2.0**-24, 0.0)
"""How much nearer to its first corner for points whose horizon hides that."""

HIGH = 0.5
"""Of the highest corner's height, another's that serves as well."""

PAIRS = 1 << 19
"""Edge-point pairs looked at at once."""

EDGES = 1 << 15
"""Edges before the light that are looked at at once, where bits do not matter."""

ROUGH = (
    (7e-3, 0, Merging(32, 32)),
    (3e-3, 0, Merging(16, 64)),
    (9e-4, 1 << 15, Merging(8, 128)),
    (9e-5, 1 << 15, Merging(4, 128)),
)
"""From which tolerance of an image and for how many edges, which make strips narrow, strips of overlapping layers are
merged: the tolerance is five times what that changes an image by, or more."""

WORTH = 1 << 19
"""Edge-point pairs in a block up to which it costs less to look at all than to divide it, where bits do not matter."""


def shines_clear(source: Source) -> bool:
    """Whether there is nothing in a quad light's way, or a closed surface wholly on its shining side."""
    if source.blockers.hierarchy is None:
        return True
    outline, light = CommonVisibility.of(source.blockers, source.light).outline, source.light.parallelogram()
    if outline is None or light is None:
        return False
    return _before(outline, light)


@lru_cache(maxsize=8)
def _before(outline: Outline, light: QuadLight) -> bool:
    """Whether all of an outline lies on a light's shining side."""
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
        Irradiance, relative to radiance 1, and a bound of its absolute error: see `rounding`. With a tolerance there
        is no bound, inf.

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
    first = np.where((height.max(axis=0) > 0) & (own.point(x)[2] > 0), _first_corner(height, tolerance), -1)
    frames = [LightFrame.turned(light, corner) for corner in range(4)]
    mine = [np.flatnonzero(first == corner) for corner in range(4)]
    spot, within = _layers(view, frames, mine, x, n, outside)
    for frame, k in zip(frames, mine, strict=True):
        if k.size:
            points = Points(x[:, k], n[:, k], frame.point(x[:, k]), spot[:, k], within[k])
            out[:, k] = _from_corner(_candidates(view.outline, frame.light), frame, points, tolerance)
    return out[0], out[1]


def _first_corner(height: Floats, tolerance: float) -> Ints:
    """From which corner of the light each point's rim is walked (m,): the highest over its horizon, (4, m), or, where
    bits do not matter, one of few that are at least HIGH of that.
    """
    found: Ints = height.argmax(axis=0)
    if not tolerance:
        return found
    left = height >= HIGH * height.max(axis=0)
    while left.any():
        corner = int(left.sum(axis=1).argmax())
        mine = left[corner].copy()
        found[mine] = corner
        left[:, mine] = False
    return found


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

    def part(self, s: slice | Ints) -> Points:
        return Points(self.x[:, s], self.n[:, s], self.local[:, s], self.spot[:, s], self.within[s])


@lru_cache(maxsize=8)
def _candidates(outline: Outline, light: QuadLight) -> Candidates:
    return Candidates.of(outline, LightFrame.of(light))


def _from_corner(edges: Candidates, frame: LightFrame, points: Points, tolerance: float) -> Floats:
    """For points whose horizon is below the frame's first corner."""
    x = points.x
    low, high = x.min(axis=1, keepdims=True), x.max(axis=1, keepdims=True)
    span = np.where(high > low, high - low, 1.0)
    order = np.argsort(morton(2 * (x - low) / span - 1), kind="stable")
    points, out, plan = points.part(order), np.zeros((2, order.size)), _Plan.of(tolerance, edges.count)
    blocks = _blocks(edges, points, plan)
    if tolerance:
        out[:, order] = _roughly(blocks, points, frame, plan.merging), np.full(order.size, np.inf)
        return out
    for near, s in blocks:
        out[:, order[s]] = _block(near, points.part(s), frame)
    return out


def _layers(
    view: CommonVisibility,
    frames: Sequence[LightFrame],
    mine: Sequence[Ints],
    x: Floats,
    n: Floats,
    outside: NDArray[np.bool_] | None,
) -> tuple[Floats, Ints]:
    """A point of the light (2, m) above each horizon, in the frame that each is ``mine`` of; how many layers lie before
    it, (m,).
    """
    spot, eye = np.zeros((2, x.shape[1])), np.zeros(x.shape[1], dtype=np.int64)
    eyes: list[Floats] = []
    for frame, left in zip(frames, mine, strict=True):
        for share in NEARER:
            at = share * column((*SPOT, 0))[:2]
            place = frame.rim[:, :1] + at[0] * column(frame.light.ab) + at[1] * column(frame.light.ac)
            above = dot(n[:, left], place - x[:, left]) > 0 if share > 0 else np.ones(left.size, dtype=bool)
            k, left = left[above], left[~above]
            spot[:, k], eye[k] = at, len(eyes)
            eyes.append(place)
    within, k, places = np.zeros(x.shape[1], dtype=np.int64), np.concatenate(mine), np.hstack(eyes)
    p, around = x[:, k], None if outside is None else outside[k]
    within[k] = view.layers(p, places[:, eye[k]] - p, places, eye[k], around)
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
    sizes : tuple of int
        Points in blocks, level by level.
    """

    worth: int
    merging: Merging | None
    sizes: tuple[int, ...] = LEVELS

    @classmethod
    def of(cls, tolerance: float, edges: int) -> _Plan:
        """For an image of that tolerance, and so many edges."""
        merging = next((one for rough, many, one in ROUGH if tolerance >= rough and edges >= many), None)
        return cls(WORTH if tolerance else 0, merging)


def _blocks(edges: Candidates, points: Points, plan: _Plan, start: int = 0) -> Iterator[tuple[Candidates, slice]]:
    """Blocks within blocks, and the edges that reach each; ``start`` points lie before these."""
    size, count = plan.sizes[0], points.within.size
    for first in range(0, count, size):
        some = points.part(slice(first, first + size))
        near = edges.near(some.x, some.local)
        if len(plan.sizes) > 1 and near.count * some.within.size > plan.worth:
            yield from _blocks(near, some, replace(plan, sizes=plan.sizes[1:]), start + first)
            continue
        step = max(1, PAIRS // max(near.count, 1))
        for begin in range(first, min(first + size, count), step):
            yield near, slice(start + begin, start + min(begin + step, first + size, count))


def _block(edges: Candidates, points: Points, frame: LightFrame) -> tuple[Floats, Floats]:
    """Hidden irradiance, and a bound of its error; where no edge reaches there is one number of layers, no strips."""
    x, n = points.x, points.n
    size, height = edges.size + np.abs(x).max(axis=0), edges.heights(x)
    cut = pieces(Silhouettes.of(edges, height, points.local), x, n, points.local, frame)
    value, doubt, lengths = _kept(cut, points, frame, size)
    error = rounding(cut, x, n, size, frame, doubt, lengths)
    return value, np.where(on_folds(edges, height, x, n, size), np.inf, error)


def _roughly(
    blocks: Iterator[tuple[Candidates, slice]], points: Points, frame: LightFrame, merging: Merging | None
) -> Floats:
    """Hidden irradiance: of many blocks at once, and without looking at points that nothing hides."""
    value = np.zeros(points.within.size)
    held: list[Silhouettes] = []
    begin = count = 0
    for near, s in blocks:
        some = points.part(s)
        edges = Silhouettes.of(near, near.heights(some.x), some.local)
        held.append(replace(edges, owner=edges.owner + (s.start - begin)))
        count += edges.owner.size
        if count > EDGES or s.stop == value.size:
            some = points.part(slice(begin, s.stop))
            cut = pieces(Silhouettes.joined(held), some.x, some.n, some.local, frame)
            value[begin : s.stop] = _of_busy(cut, some, frame, merging)
            held, begin, count = [], s.stop, 0
    return value


def _of_busy(cut: Pieces, points: Points, frame: LightFrame, merging: Merging | None) -> Floats:
    busy = points.within > 0
    busy[cut.owner] = True
    k, value = np.flatnonzero(busy), np.zeros(busy.size)
    if k.size:
        number = np.cumsum(busy) - 1
        value[k] = _kept(replace(cut, owner=take(number, cut.owner)), points.part(k), frame, None, merging)[0]
    return value


def _kept(
    cut: Pieces, points: Points, frame: LightFrame, size: Floats | None, merging: Merging | None = None
) -> tuple[Floats, Floats, Floats]:
    """Hidden irradiance, and the doubts and lengths that `rounding` asks for; see `extra_layers` for ``merging``."""
    x, n = points.x, points.n
    rim = Rim.of(x, n, frame, size)
    at, jump = on_left(cut, rim)
    start = before_corner(cut, at, jump, points.spot, points.within)
    value, doubt = layers(cut, rim, n, start, size)
    extra, more, lengths = extra_layers(cut, rim, x, n, start, at, jump, frame, merging)
    return value - extra, doubt + more, lengths
