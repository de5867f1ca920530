"""Intervals on straight edges: where planes cut them, and what a union of intervals leaves.

An edge a + t (b - a), t in [0, 1], as a point sees it. A convex cone cuts it in one interval, so that all there is
to do is one-dimensional: no polygon is ever intersected with another.
"""

from __future__ import annotations

import numpy as np

from ..geometry import Ints
from ..vectors import Floats


def clip(start: Floats, end: Floats) -> tuple[Floats, Floats]:
    """The part of each edge on the inner side of all planes.

    Parameters
    ----------
    start, end : (planes, ...) float64
        Values of the planes at the edge's ends, positive inside. An edge in a plane is inside it.

    Returns
    -------
    lo, hi : (...) float64
        In [0, 1]; lo >= hi where nothing is left.
    """
    out0, out1 = start < 0, end < 0
    fall = start - end
    fall += fall == 0
    t = start / fall
    lo = np.max(t * out0 + 2.0 * (out0 & out1), axis=0)
    hi = np.min(np.where(out1, t, 1.0), axis=0)
    return lo, hi


def remaining(t0: Floats, t1: Floats, edge: Ints, lo: Floats, hi: Floats) -> tuple[Ints, Floats, Floats]:
    """What is left of edges (m,) from t0 to t1 outside a union of intervals.

    Parameters
    ----------
    edge : (q,) int64
        Which edge each interval [lo, hi] (q,) is on, in any order.

    Returns
    -------
    edge, t0, t1 : (k,)
        Parts of positive length.
    """
    lo, hi = np.maximum(lo, t0[edge]), np.minimum(hi, t1[edge])
    some = np.flatnonzero(lo < hi)
    edge, lo, hi = edge[some], lo[some], hi[some]
    count = np.bincount(edge, minlength=t0.size)
    free = np.flatnonzero((count == 0) & (t0 < t1))
    out: list[tuple[Ints, Floats, Floats]] = [(free, t0[free], t1[free])]
    if edge.size:
        order = np.argsort(edge, kind="stable")
        first = np.cumsum(count) - count
        slot = np.empty(edge.size, dtype=np.int64)
        slot[order] = np.arange(edge.size) - first[edge[order]]
        least, most = 1, 1
        while least <= count.max():  # 1, 2, 3-4, 5-8, ... intervals on an edge: padding at most doubles
            chosen = np.flatnonzero((count >= least) & (count <= most))
            if chosen.size:
                place = np.full(t0.size, -1)
                place[chosen] = np.arange(chosen.size)
                mine = np.flatnonzero(place[edge] >= 0)
                starts, ends = np.tile(t1[chosen], (2, most, 1))
                starts[slot[mine], place[edge[mine]]] = lo[mine]
                ends[slot[mine], place[edge[mine]]] = hi[mine]
                out += _gaps(chosen, t0[chosen], t1[chosen], starts, ends)
            least, most = most + 1, most * 2
    return np.concatenate([p[0] for p in out]), np.concatenate([p[1] for p in out]), np.concatenate([p[2] for p in out])


def _gaps(edge: Ints, t0: Floats, t1: Floats, lo: Floats, hi: Floats) -> list[tuple[Ints, Floats, Floats]]:
    """Gaps between the intervals (rows, m) of m edges."""
    rows = lo.shape[0]
    if rows > 1:
        order = np.argsort(lo, axis=0)
        lo, hi = np.take_along_axis(lo, order, 0), np.take_along_axis(hi, order, 0)
    reached = t0
    out: list[tuple[Ints, Floats, Floats]] = []
    for row in range(rows + 1):
        until = lo[row] if row < rows else t1
        k = np.flatnonzero(reached < until)
        out.append((edge[k], reached[k], until[k]))
        if row < rows:
            reached = np.maximum(reached, hi[row])
    return out


def joined(key: Ints, start: Ints, count: Ints) -> tuple[Ints, Ints]:
    """All pairs (i, j) with j in start[key[i]] .. start + count: indices i and j, each (k,)."""
    many = count[key]
    i = np.repeat(np.arange(key.size), many)
    before = np.cumsum(many) - many
    return i, start[key][i] + np.arange(i.size) - before[i]
