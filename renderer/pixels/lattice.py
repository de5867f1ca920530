"""Cubic interpolation from a lattice of pixel centres, each region from its own 4 x 4 of them."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property, lru_cache

import numpy as np

from nusselt.renderer.vectors import Bools, Floats, Ints

from .interpolation import BETWEEN, cubic, cubic_bend, cubic_slope, error_bound
from .moments import Pieces
from .squares import Groups

SHIFTS = np.array([(up, back) for up in (1, 0, 2, 3, -1, 4) for back in (1, 0, 2, 3, -1, 4)])
"""Of a square within, or one beside, the three by three between its nodes; the middle first."""
WITHIN_NODES = np.flatnonzero((SHIFTS >= 0).all(axis=1) & (SHIFTS <= 2).all(axis=1))


class Lattice:
    """Centres ``step`` pixels apart.

    Parameters
    ----------
    value : (c, r, k) float64
    region : (r, k) int32
        -1 where there is nothing to interpolate from.
    step : int
    """

    def __init__(self, value: Floats, region: Ints, step: int) -> None:
        self.value, self.region, self.step = value, region, step
        self.bound = np.full(region.size, np.nan)  # of what differences allow beside a node, as far as asked

    @cached_property
    def label(self) -> Ints:
        """See `_label`."""
        return _label(self.region)

    def spoken_for(self, groups: Groups, within: bool) -> Groups:
        """Those that have 4 x 4 nodes of their region, with the first of them.

        Parameters
        ----------
        within : bool
            Whether the groups' squares must lie between their nodes.
        """
        if self.label.size == 0 or groups.row.size == 0:
            return groups.take(np.zeros(0, dtype=np.int64))
        shifts = WITHIN_NODES if within else np.arange(len(SHIFTS))
        shift = np.where(self._fits(groups, shifts[:1])[0], shifts[0], -1)
        rest = np.flatnonzero(shift < 0)
        if rest.size:
            fits = self._fits(groups.take(rest), shifts[1:])
            shift[rest] = np.where(fits.any(axis=0), shifts[1 + fits.argmax(axis=0)], -1)
        kept = np.flatnonzero(shift >= 0)
        groups = groups.take(kept) if kept.size < shift.size else groups
        up, back = SHIFTS[shift[kept]].T
        return replace(groups, top=groups.row - up, left=groups.column - back)

    def rough(self, groups: Groups) -> Floats:
        """What differences allow (k,) at the four nodes of each group that are nearest its square."""
        r, c = (
            first + np.clip(place - first, 0, 2)
            for place, first in ((groups.row, groups.top), (groups.column, groups.left))
        )
        corner = r * self.region.shape[1] + c
        across = self.region.shape[1]
        return np.asarray(
            self._beside(np.stack((corner, corner + 1, corner + across, corner + across + 1))).max(axis=0)
        )

    def _fits(self, groups: Groups, shifts: Ints) -> Bools:
        """Whether the 4 x 4 nodes at each shift (s, k) of a group's square are its region's."""
        up, back = SHIFTS[shifts].T[:, :, None]
        rows, columns = self.label.shape
        top, left = groups.row - up, groups.column - back
        inside = (top >= 0) & (top < rows) & (left >= 0) & (left < columns)
        place = np.where(inside, top * columns + left, 0)
        return np.asarray(inside & (self.label.ravel()[place] == groups.region))

    def _beside(self, nodes: Ints) -> Floats:
        """What differences allow beside nodes."""
        asked = np.zeros(self.bound.size, dtype=bool)
        asked[nodes] = True
        index = np.flatnonzero(asked & np.isnan(self.bound))
        if index.size:
            # Differences are those of the channels' sum; the error is the norm.
            total, values = (
                self.value.sum(axis=0),
                self.value[:, index // self.region.shape[1], index % self.region.shape[1]],
            )
            own, norm = values.sum(axis=0), np.sqrt((values * values).sum(axis=0))
            share = np.where(own > 0, norm / np.where(own > 0, own, 1.0), 1.0)
            self.bound[index] = error_bound(total, self.region, BETWEEN, index) * share
        return np.asarray(self.bound[nodes])

    def _stencils(self, groups: Groups) -> Floats:
        """Values (c, k, 4, 4) at the groups' nodes."""
        i = np.arange(4)
        return self.value[:, groups.top[:, None, None] + i[:, None], groups.left[:, None, None] + i]

    def patches(self, groups: Groups) -> Floats:
        """Interpolated values (c, k, step, step) at all centres of the groups' squares."""
        step, count = self.step, groups.row.size
        nodes = self._stencils(groups).reshape(self.value.shape[0], count, 16)
        place = (groups.row - groups.top + 1) * 6 + groups.column - groups.left + 1
        places = np.flatnonzero(np.bincount(place, minlength=1)).tolist() if count else []
        if len(places) == 1:
            out = nodes @ _weights(step, places[0])
        else:
            out = np.empty((nodes.shape[0], count, step * step))
            for which in places:
                mine = np.flatnonzero(place == which)
                out[:, mine] = nodes[:, mine] @ _weights(step, which)
        np.maximum(out, 0.0, out=out)  # radiance; cubics overshoot
        return out.reshape(nodes.shape[0], count, step, step)

    def at(self, groups: Groups, x: Floats, y: Floats) -> Floats:
        """Interpolated values (c, k) at one point of each group."""
        down, across = cubic((y - 0.5) / self.step - groups.top), cubic((x - 0.5) / self.step - groups.left)
        return np.einsum("ckij,ki,kj->ck", self._stencils(groups), down, across)

    def at_pieces(self, groups: Groups, pieces: Pieces) -> Floats:
        """Interpolated means (c, k) over pieces, each of its group: to second order about their centroids."""
        v, u = (pieces.y - 0.5) / self.step - groups.top, (pieces.x - 0.5) / self.step - groups.left
        xx, xy, yy = pieces.covariance / self.step**2
        down, across = cubic(v), cubic(u)
        weight = down[:, :, None] * across[:, None, :]
        weight += (xx / 2)[:, None, None] * down[:, :, None] * cubic_bend(u)[:, None, :]
        weight += (yy / 2)[:, None, None] * cubic_bend(v)[:, :, None] * across[:, None, :]
        weight += xy[:, None, None] * cubic_slope(v)[:, :, None] * cubic_slope(u)[:, None, :]
        return np.maximum(np.einsum("ckij,kij->ck", self._stencils(groups), weight), 0.0)


@lru_cache(maxsize=256)
def _weights(step: int, place: int) -> Floats:
    """Of 16 nodes at the centres of a square (16, step^2), by its place among them: 6 (down + 1) + across + 1."""
    down, across = (cubic(np.arange(step) / step + which - 1) for which in divmod(place, 6))
    return np.ascontiguousarray((down[:, None, :, None] * across[:, None, :]).reshape(step * step, 16).T)


def _label(region: Ints) -> Ints:
    """The region of each 4 x 4 of nodes, by its first; -1 where they show several, or none."""
    if min(region.shape) < 4:
        return np.zeros((0, 0), dtype=np.int64)
    low, high = (_of_four(_of_four(region, take).T, take).T for take in (np.minimum, np.maximum))
    return np.where(low == high, low, -1)


def _of_four(array: Ints, take: np.ufunc) -> Ints:
    """Least or largest of each four in a column."""
    two = take(array[:-1], array[1:])
    return np.asarray(take(two[:-2], two[2:]))
