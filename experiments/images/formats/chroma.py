"""Luminance and chroma (Y, RY, BY) as red, green and blue, as OpenEXR's own `RgbaInputFile` does it.

RY = (R - Y) / Y, BY = (B - Y) / Y. Of chroma at half the size every second value is there; the others are
interpolated by its filter of 14, and pixels more saturated than those around them are toned down as it does. Against
a transcription of its loops: equal to 1e-15 where sizes are even, but for such pixels in the first row (1 %).
"""

from __future__ import annotations

import numpy as np

from nusselt.renderer.vectors import Floats

HALF_FILTER = np.array([0.002128, -0.007540, 0.019597, -0.043159, 0.087929, -0.186077, 0.627123])
FILTER = np.concatenate((HALF_FILTER, HALF_FILTER[::-1]))
"""Weights of the seven values on either side of a missing one."""


def doubled(values: Floats, size: int, axis: int) -> Floats:
    """Twice the values along an axis, cut to ``size``: those that are there, and between them interpolated ones."""
    values = np.moveaxis(values, axis, -1)
    padded = np.concatenate((values[..., :1].repeat(6, -1), values, values[..., -1:].repeat(7, -1)), axis=-1)
    between = np.lib.stride_tricks.sliding_window_view(padded, len(FILTER), axis=-1) @ FILTER
    out = np.stack((values, between), axis=-1).reshape(*values.shape[:-1], -1)[..., :size]
    return np.moveaxis(out, -1, axis)


def from_luminance(y: Floats, ry: Floats, by: Floats, weights: Floats) -> Floats:
    """(3, h, w) of luminance (h, w) and chroma of the same size or half of it; ``weights`` of R, G, B in luminance."""
    halved = ry.shape != y.shape
    if halved:
        ry, by = (doubled(doubled(c, y.shape[1], 1), y.shape[0], 0) for c in (ry, by))
    red, blue = (ry + 1) * y, (by + 1) * y
    green = (y - weights[0] * red - weights[2] * blue) / weights[1]
    colours = np.where((ry == 0) & (by == 0), y, np.stack((red, green, blue)))
    return _less_saturated(colours, weights) if halved else colours


def _less_saturated(colours: Floats, weights: Floats) -> Floats:
    """Where a pixel's saturation is far above that of its four diagonal neighbours, less of it, at equal luminance."""
    top, low = colours.max(axis=0), colours.min(axis=0)
    saturation = np.where(top > 0, 1 - low / np.where(top > 0, top, 1), 0)
    around = np.pad(saturation, 1, mode="edge")
    around[-1] = around[-3]  # below the last row stands the one before it
    mean = np.minimum(1, (around[:-2, :-2] + around[:-2, 2:] + around[2:, :-2] + around[2:, 2:]) / 4)
    limit = np.minimum(1, 1 - (1 - mean) / 4)
    toned = np.maximum(top - (top - colours) * limit / np.where(saturation > 0, saturation, 1), 0)
    luminance = np.tensordot(weights, toned, 1)
    scale = np.where(luminance > 0, np.tensordot(weights, colours, 1) / np.where(luminance > 0, luminance, 1), 1)
    return np.where((saturation > mean) & (saturation > limit), toned * scale, colours)
