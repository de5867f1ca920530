"""Irradiance that a closed surface keeps from points, block by block of neighbouring points."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..bvh import morton
from ..common_visibility import CommonVisibility
from ..geometry import Ints
from ..lights import QuadLight
from ..needs import Source
from ..silhouette import Outline
from ..vectors import Floats, column, dot
from .contour import Rim, layers, pieces
from .light_frame import Candidates, LightFrame
from .overlap import extra_layers

LEVELS = (2048, 256, 64)
"""Points in the blocks for which candidate edges are sought, each within the one before."""

PAIRS = 1 << 19
"""Edge-point pairs looked at at once."""


def shines_clear(source: Source) -> bool:
    """Whether there is nothing in a quad light's way, or a closed surface wholly on its shining side."""
    if source.blockers.hierarchy is None:
        return True
    outline = CommonVisibility.of(source).outline
    if outline is None or not isinstance(source.light, QuadLight):
        return False
    frame = LightFrame.of(source.light)
    return bool(min(frame.point(ends)[2].min(initial=1) for ends in (outline.start, outline.end)) > 0)


def hidden_irradiance(
    source: Source,
    x: Floats,
    n: Floats,
    detail: int = 1,
    merge: int = 1,
    outside: NDArray[np.bool_] | None = None,
) -> Floats:
    """What the surface in the source's hierarchy keeps from points, for unit radiance.

    Parameters
    ----------
    source : Source
        A quad light, and blockers whose hierarchy is a closed surface wholly on the light's shining side.
    x, n : (3, m) float64
        Points, outside the surface or on it, and unit normals.
    detail : int
        How much finer the strips are where layers overlap.
    merge : int
        How many of them are taken as one.
    outside : (m,) bool, optional
        See `ShadingPoints`.

    Returns
    -------
    (m,) float64
        Irradiance, relative to radiance 1.

    Raises
    ------
    ValueError
        If the source is not of that kind.
    """
    view = CommonVisibility.of(source)
    if view.outline is None or not isinstance(source.light, QuadLight):
        raise ValueError("a quad light and a closed surface before it are needed")
    if not shines_clear(source):
        raise ValueError("the surface reaches behind the light")
    out = np.zeros(x.shape[1])
    own = LightFrame.of(source.light)
    height = dot(n[:, None, :], own.rim[:, :, None] - x[:, None, :])
    highest = np.where((height.max(axis=0) > 0) & (own.point(x)[2] > 0), height.argmax(axis=0), -1)
    for corner in np.unique(highest[highest >= 0]).tolist():
        # The rim is walked from the corner that is highest over the point's horizon.
        k = np.flatnonzero(highest == corner)
        around = None if outside is None else outside[k]
        out[k] = _from_corner(view, LightFrame.turned(source.light, corner), x[:, k], n[:, k], detail, merge, around)
    return out


@lru_cache(maxsize=8)
def _candidates(outline: Outline, light: QuadLight) -> Candidates:
    return Candidates.of(outline, LightFrame.of(light))


def _from_corner(
    view: CommonVisibility,
    frame: LightFrame,
    x: Floats,
    n: Floats,
    detail: int,
    merge: int,
    outside: NDArray[np.bool_] | None,
) -> Floats:
    """For points whose horizon is below the frame's first corner."""
    if view.outline is None:
        return np.zeros(x.shape[1])
    everything = _candidates(view.outline, frame.light)
    low, high = x.min(axis=1, keepdims=True), x.max(axis=1, keepdims=True)
    span = np.where(high > low, high - low, 1.0)
    order = np.argsort(morton(2 * (x - low) / span - 1), kind="stable")
    x, n = x[:, order], n[:, order]
    eye = column(frame.light.corner)
    start = view.layers(x, eye - x, eye, None if outside is None else outside[order])
    out = np.zeros(x.shape[1])
    _blocks(everything, x, n, frame.point(x), start, frame, LEVELS, detail, merge, order, out)
    return out


def _blocks(
    edges: Candidates,
    x: Floats,
    n: Floats,
    local: Floats,
    start: Ints,
    frame: LightFrame,
    levels: tuple[int, ...],
    detail: int,
    merge: int,
    names: Ints,
    out: Floats,
) -> None:
    """Blocks within blocks; a block that no edge reaches has one number of layers, and no strips."""
    size = levels[0]
    for first in range(0, x.shape[1], size):
        s = slice(first, first + size)
        near = edges.near(x[:, s], local[:, s])
        if len(levels) > 1 and near.count:
            _blocks(near, x[:, s], n[:, s], local[:, s], start[s], frame, levels[1:], detail, merge, names[s], out)
            continue
        step = max(1, PAIRS // max(near.count, 1))
        for begin in range(first, min(first + size, x.shape[1]), step):
            t = slice(begin, min(begin + step, first + size))
            cut = pieces(near, x[:, t], n[:, t], local[:, t], frame)
            rim = Rim.of(x[:, t], n[:, t], frame)
            value, at, jump = layers(cut, rim, n[:, t], start[t])
            extra = extra_layers(cut, rim, x[:, t], n[:, t], start[t], at, jump, frame, detail, merge)
            out[names[t]] = value - extra
