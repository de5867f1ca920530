"""Irradiance that a closed surface keeps from points, block by block of neighbouring points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..bvh import morton
from ..common_visibility import CommonVisibility
from ..geometry import Ints
from ..needs import Source
from ..scene import QuadLight
from ..vectors import Floats, column, dot
from .contour import layers, pieces
from .light_frame import Candidates, LightFrame
from .overlap import extra_layers

LEVELS = (2048, 256, 64)
"""Points in the blocks for which candidate edges are sought, each within the one before."""

PAIRS = 1 << 19
"""Edge-point pairs looked at at once."""


def hidden_irradiance(source: Source, x: Floats, n: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """What the surface in the source's hierarchy keeps from points, for unit radiance.

    Parameters
    ----------
    source : Source
        A quad light, and blockers whose hierarchy is a closed surface wholly on the light's shining side.
    x, n : (3, m) float64
        Points, and unit normals.

    Returns
    -------
    hidden : (m,) float64
        Irradiance, relative to radiance 1; 0 where not known.
    known : (m,) bool
        Points before the light that have all of it above their horizon.

    Raises
    ------
    ValueError
        If the source is not of that kind.
    """
    view = CommonVisibility.of(source)
    if view.outline is None or not isinstance(source.light, QuadLight):
        raise ValueError("a quad light and a closed surface before it are needed")
    frame = LightFrame.of(source.light)
    everything = Candidates.of(view.outline, frame)
    if min(everything.local_start[2].min(), everything.local_end[2].min()) <= 0:
        raise ValueError("the surface reaches behind the light")
    local = frame.point(x)
    above = dot(n[:, :, None], frame.rim[:, None, :] - x[:, :, None]).min(axis=1) > 0
    known = above & (local[2] > 0)
    out = np.zeros(x.shape[1])
    k = np.flatnonzero(known)
    if k.size == 0:
        return out, known
    low, high = x[:, k].min(axis=1, keepdims=True), x[:, k].max(axis=1, keepdims=True)
    span = np.where(high > low, high - low, 1.0)
    k = k[np.argsort(morton(2 * (x[:, k] - low) / span - 1), kind="stable")]
    start = first_corner_layers(view, x[:, k], frame)
    _blocks(everything, x[:, k], n[:, k], local[:, k], start, frame, LEVELS, k, out)
    return out, known


def first_corner_layers(view: CommonVisibility, x: Floats, frame: LightFrame) -> Ints:
    """How many layers lie between points and the light's first corner, (m,)."""
    eye = column(frame.light.corner)
    return view.layers(x, eye - x, eye)


def _blocks(
    edges: Candidates,
    x: Floats,
    n: Floats,
    local: Floats,
    start: Ints,
    frame: LightFrame,
    levels: tuple[int, ...],
    names: Ints,
    out: Floats,
) -> None:
    """Blocks within blocks; a block that no edge reaches has one number of layers, and no strips."""
    size = levels[0]
    for first in range(0, x.shape[1], size):
        s = slice(first, first + size)
        near = edges.near(x[:, s], local[:, s])
        if len(levels) > 1 and near.count:
            _blocks(near, x[:, s], n[:, s], local[:, s], start[s], frame, levels[1:], names[s], out)
            continue
        step = max(1, PAIRS // max(near.count, 1))
        for begin in range(first, min(first + size, x.shape[1]), step):
            t = slice(begin, min(begin + step, first + size))
            cut = pieces(near, x[:, t], local[:, t], frame)
            value, at, jump = layers(cut, x[:, t], n[:, t], start[t], frame)
            out[names[t]] = value - extra_layers(cut, x[:, t], n[:, t], start[t], at, jump, frame)

