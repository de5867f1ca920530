"""Cubic interpolation from a lattice of pixel centres, each region from its own 4 x 4 of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from nusselt.renderer.vectors import Floats, Ints

from .interpolation import BETWEEN, cubic, cubic_bend, cubic_slope, error_bound
from .moments import Pieces
from .squares import Groups

SHIFTS = np.array([(up, back) for up in (1, 0, 2, 3, -1, 4) for back in (1, 0, 2, 3, -1, 4)])
"""Of a square within, or one beside, the three by three between its nodes; the middle first."""
WITHIN_NODES = np.flatnonzero((SHIFTS >= 0).all(axis=1) & (SHIFTS <= 2).all(axis=1))


@dataclass(frozen=True)
class Lattice:
    """Centres ``step`` pixels apart.

    Parameters
    ----------
    value : (3, r, c) float64
    region : (r, c) int32
        -1 where there is nothing to interpolate from.
    step : int
    """

    value: Floats
    region: Ints
    step: int

    def spoken_for(self, groups: Groups, shifts: Ints) -> Groups:
        """Those that have 4 x 4 nodes of their region, with these, and what differences there allow."""
        value, region, label = self.value, self.region, _label(self.region)
        if label.size == 0:
            return groups.take(np.zeros(0, dtype=np.int64))
        up, back = SHIFTS[shifts].T[:, :, None]
        top, left = groups.row - up, groups.column - back
        inside = (top >= 0) & (top < label.shape[0]) & (left >= 0) & (left < label.shape[1])
        fits = inside & (label[np.where(inside, top, 0), np.where(inside, left, 0)] == groups.region)
        first = fits.argmax(axis=0)
        kept = np.flatnonzero(fits.any(axis=0))
        groups = groups.take(kept)
        top, left = top[first[kept], kept], left[first[kept], kept]
        r, c = top + np.clip(groups.row - top, 0, 2), left + np.clip(groups.column - left, 0, 2)
        corners = [(r + dy) * region.shape[1] + c + dx for dy in (0, 1) for dx in (0, 1)]
        needed = np.zeros(region.size, dtype=bool)
        for corner in corners:
            needed[corner] = True
        index = np.flatnonzero(needed)
        bound = np.zeros(region.size)
        bound[index] = error_bound(value.sum(axis=0), region, BETWEEN, index)
        # Differences are those of the channels' sum; the error is the norm.
        values = value.reshape(3, -1)[:, index]
        total, norm = values.sum(axis=0), np.sqrt((values * values).sum(axis=0))
        bound[index] *= np.where(total > 0, norm / np.where(total > 0, total, 1.0), 1.0)
        rough = np.maximum.reduce([bound[corner] for corner in corners])
        return replace(groups, top=top, left=left, rough=rough)

    def _stencils(self, groups: Groups) -> Floats:
        """Values (3, k, 4, 4) at the groups' nodes."""
        i = np.arange(4)
        return self.value[:, groups.top[:, None, None] + i[:, None], groups.left[:, None, None] + i]

    def patches(self, groups: Groups) -> Floats:
        """Interpolated values (3, k, step, step) at all centres of the groups' squares."""
        step = self.step
        weights = cubic(np.arange(step) / step + np.arange(-1, 5)[:, None])  # by the square's place among its nodes
        nodes = self._stencils(groups).reshape(3, -1, 16)
        out = np.empty((3, groups.row.size, step * step))
        place = (groups.row - groups.top + 1) * 6 + groups.column - groups.left + 1
        for which in np.flatnonzero(np.bincount(place, minlength=1)).tolist():
            down, across = weights[which // 6], weights[which % 6]
            both = (down[:, None, :, None] * across[:, None, :]).reshape(step * step, 16)
            mine = np.flatnonzero(place == which)
            out[:, mine] = nodes[:, mine] @ both.T
        return np.maximum(out, 0.0).reshape(3, -1, step, step)  # radiance; cubics overshoot

    def at(self, groups: Groups, x: Floats, y: Floats) -> Floats:
        """Interpolated values (3, k) at one point of each group."""
        down, across = cubic((y - 0.5) / self.step - groups.top), cubic((x - 0.5) / self.step - groups.left)
        return np.einsum("ckij,ki,kj->ck", self._stencils(groups), down, across)

    def at_pieces(self, groups: Groups, pieces: Pieces) -> Floats:
        """Interpolated means (3, k) over pieces, each of its group: to second order about their centroids."""
        v, u = (pieces.y - 0.5) / self.step - groups.top, (pieces.x - 0.5) / self.step - groups.left
        xx, xy, yy = pieces.covariance / self.step**2
        down, across = cubic(v), cubic(u)
        weight = down[:, :, None] * across[:, None, :]
        weight += (xx / 2)[:, None, None] * down[:, :, None] * cubic_bend(u)[:, None, :]
        weight += (yy / 2)[:, None, None] * cubic_bend(v)[:, :, None] * across[:, None, :]
        weight += xy[:, None, None] * cubic_slope(v)[:, :, None] * cubic_slope(u)[:, None, :]
        return np.maximum(np.einsum("ckij,kij->ck", self._stencils(groups), weight), 0.0)


def _label(region: Ints) -> Ints:
    """The region of each 4 x 4 of nodes, by its first; -1 where they show several, or none."""
    low = high = region
    for axis in (0, 1):
        size = region.shape[axis] - 3
        if size < 1:
            return np.zeros((0, 0), dtype=np.int64)
        cuts = [(slice(k, k + size),) if axis == 0 else (slice(None), slice(k, k + size)) for k in range(4)]
        low, high = np.minimum.reduce([low[cut] for cut in cuts]), np.maximum.reduce([high[cut] for cut in cuts])
    return np.where(low == high, low, -1)
