"""Where strips of the light's square may begin: crossings of lines, and ends and crossings of round outlines."""

from __future__ import annotations

import numpy as np

from nusselt.renderer.closed_forms.circles.circles import meet
from nusselt.renderer.closed_forms.circles.pairing import columns, joined
from nusselt.renderer.vectors import Floats, Ints, cross

from .conics import Conics
from .sections import HalfPlanes, Square

GRID = 1 << 30
"""Places along u are sorted on this grid."""
PARALLEL = 1e-15
"""Lines that turn by less part by less within the square: where they cross does not matter."""


def line_crossings(flats: HalfPlanes, pair: Ints, line: Ints, us: Floats, vs: Floats) -> tuple[Ints, Floats]:
    """Points (m,) and places u (m,) where segments of different regions cross.

    Parameters
    ----------
    pair, line : (k,) int64
    us, vs : (2, k) float64
        The segments, as `HalfPlanes.segments` has them.
    """
    low, high = us.min(axis=0), us.max(axis=0)
    first = np.clip(np.floor(low * GRID), 0, GRID).astype(np.int64)
    point = flats.point[pair]
    key = point * (2 * GRID) + first
    order = np.argsort(key, kind="stable")
    until = np.clip(np.ceil(high * GRID), 0, GRID).astype(np.int64)[order] + point[order] * (2 * GRID)
    many = np.searchsorted(key[order], until, side="right") - np.arange(order.size) - 1
    i, j = joined(np.arange(order.size), np.arange(order.size) + 1, many)
    i, j = order[i], order[j]
    bottom, top = vs.min(axis=0), vs.max(axis=0)
    near = np.flatnonzero((pair[i] != pair[j]) & (bottom[i] <= top[j]) & (bottom[j] <= top[i]))
    i, j = i[near], j[near]
    (a1, b1, c1), (a2, b2, c2) = ([w[line[k], pair[k]] for w in (flats.a, flats.b, flats.c)] for k in (i, j))
    turn = a1 * b2 - a2 * b1
    k = np.flatnonzero(np.abs(turn) > PARALLEL)
    u = (b1[k] * c2[k] - b2[k] * c1[k]) / turn[k]
    inside = (u >= np.maximum(low[i[k]], low[j[k]])) & (u <= np.minimum(high[i[k]], high[j[k]]))
    return point[i[k]][inside], u[inside]


def conic_crossings(square: Square, flats: HalfPlanes, pair: Ints, line: Ints, conics: list[Conics]) -> list[Places]:
    """For each group of round bodies the pairs (m,) and places u (m,) where anything crosses their outlines.

    Parameters
    ----------
    pair, line : (k,) int64
        The segments of flat bodies, as `HalfPlanes.segments` has them; pairs ascending.
    """
    count = np.bincount(flats.point[pair], minlength=square.p.shape[1])
    order = np.argsort(flats.point[pair], kind="stable")
    first = np.cumsum(count) - count
    bottom, top = square.p, square.p + square.ac
    sides = cross(bottom, square.ab), cross(top, square.ab)
    out = []
    for group in conics:
        every = np.arange(group.point.size)
        cuts = [group.crossed(every, columns(side, group.point)) for side in sides]
        i, j = joined(group.point, first, count)
        j = order[j]
        cuts.append(group.crossed(i, columns(flats.planes.reshape(3, -1), line[j] * flats.count + pair[j])))
        for other in conics:
            many = np.bincount(other.point, minlength=square.p.shape[1])
            i, j = joined(group.point, np.cumsum(many) - many, many)
            apart = np.flatnonzero((i != j) | (other is not group))
            if apart.size:
                of, phi = meet(group.cone.take(i[apart]), other.cone.take(j[apart]))
                cuts.append((i[apart][of], phi))
        mine, phi = np.concatenate([c[0] for c in cuts]), np.concatenate([c[1] for c in cuts])
        u, v = square.place(group.point[mine], group.cone.take(mine).direction(phi))
        with np.errstate(invalid="ignore"):
            beside = np.maximum(square.slack[group.point[mine]], NEAR)
            inside = np.flatnonzero((u > 0) & (u < 1) & (v >= -beside) & (v <= 1 + beside))
        out.append((mine[inside], u[inside]))
    return out


Places = tuple[Ints, Floats]
NEAR = 1e-9
"""What crosses so little outside the square may cross on its rim: a place too many costs nothing, one too few a strip
that is taken for lit or hidden all along."""
