"""Silhouette edges from many points, cut to the light, and Lambert's terms along them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry import Ints
from ..pairs import take
from ..vectors import Floats, cross, dot
from .light_frame import Candidates, LightFrame


def edge_term(a: Floats, b: Floats, n: Floats) -> Floats:
    """Lambert's -1/2 angle(a, b) n . (a x b)/|a x b|: positive along a counter-clockwise rim above the horizon.

    The angle from atan2 keeps its digits however small; parallel a and b give 0.
    """
    normal = cross(a, b)
    sine = np.sqrt(dot(normal, normal))
    angle = np.arctan2(sine, dot(a, b))
    return np.divide(-0.5 * angle * dot(n, normal), sine, out=np.zeros_like(sine), where=sine > 0)


@dataclass(frozen=True)
class Pieces:
    """The parts of silhouette edges that lie before the light; layers on the left seen from the receiver.

    Parameters
    ----------
    owner : (m,) int64
        Receiver of each.
    a, b : (3, m) float64
        Ends, from the receiver.
    enters, leaves : (m,) int64
        Side of the rim where it begins and ends: 0 to 3, or -1 if it does so inside.
    p, q : (2, m) float64
        Ends on the light.
    """

    owner: Ints
    a: Floats
    b: Floats
    enters: Ints
    leaves: Ints
    p: Floats
    q: Floats


def pieces(edges: Candidates, x: Floats, local: Floats, frame: LightFrame) -> Pieces:
    """Of points x (3, n), ``local`` in the light's frame."""
    homogeneous = np.vstack((x, -np.ones(x.shape[1])))
    left = edges.left.T @ homogeneous > 0
    pair = np.flatnonzero(left != (edges.right.T @ homogeneous > 0))
    edge, owner = np.divmod(pair, x.shape[1])
    ahead = take(left.ravel(), pair)
    at = take(local, owner)
    a, b = take(edges.local_start, edge) - at, take(edges.local_end, edge) - at
    first, last = np.zeros(pair.size), np.ones(pair.size)
    begins, ends = np.full(pair.size, -1), np.full(pair.size, -1)
    for side, (axis, sign, bound) in enumerate(((0, 1.0, 0.0), (1, -1.0, 1.0), (0, -1.0, 1.0), (1, 1.0, 0.0))):
        # Inside where sign (p - bound) >= 0, times the depth -r of the direction.
        arm = at[axis] - bound
        ga, gb = (sign * (at[2] * v[axis] - arm * v[2]) for v in (a, b))
        with np.errstate(divide="ignore", invalid="ignore"):
            cut = ga / (ga - gb)
        later = (ga < 0) & (gb >= 0) & (cut > first)
        sooner = (ga >= 0) & (gb < 0) & (cut < last)
        first, begins = np.where(later, cut, first), np.where(later, side, begins)
        last, ends = np.where(sooner, cut, last), np.where(sooner, side, ends)
        last = np.where((ga < 0) & (gb < 0), -1.0, last)
    k = np.flatnonzero((first < last) & (np.minimum(a[2], b[2]) < 0))
    edge, owner, ahead = take(edge, k), take(owner, k), take(ahead, k)
    first, last, begins, ends = (take(v, k) for v in (first, last, begins, ends))
    at = take(x, owner)
    a, b = take(edges.start, edge) - at, take(edges.end, edge) - at
    way = b - a
    a, b = np.where(first > 0, a + first * way, a), np.where(last < 1, a + last * way, b)
    a, b = np.where(ahead, a, b), np.where(ahead, b, a)
    begins, ends = np.where(ahead, begins, ends), np.where(ahead, ends, begins)
    at = take(local, owner)
    on = []
    for v in (a, b):
        u = [row[0] * v[0] + row[1] * v[1] + row[2] * v[2] for row in frame.rows]
        reach = at[2] / np.minimum(u[2], -1e-300)
        on.append([np.clip(at[axis] - reach * u[axis], 0, 1) for axis in (0, 1)])
    p, q = (np.stack((on[0][axis], on[1][axis])) for axis in (0, 1))
    return Pieces(owner, a, b, begins, ends, p, q)


def layers(cut: Pieces, x: Floats, n: Floats, start: Ints, frame: LightFrame) -> tuple[Floats, Floats, Ints]:
    """int f w over the light for points x, normals n (3, n) and layers ``start`` (n,) before the first corner.

    Along the rim from that corner, w falls where a piece enters and rises where one leaves.

    Returns
    -------
    value : (n,) float64
    at, jump : (m,) float64, (m,) int64
        For every piece's change of w on the first side: how far up it (q, or 2 for none), and by how much.
    """
    count = x.shape[1]
    corners = frame.rim[:, :, None] - x[:, None, :]
    whole = [edge_term(corners[:, j], corners[:, (j + 1) % 4], n) for j in range(4)]
    passed = np.cumsum(np.stack([np.zeros(count), *whole]), axis=0)
    normal = take(n, cut.owner)
    value = start * passed[4] + np.bincount(cut.owner, edge_term(cut.a, cut.b, normal), minlength=count)
    for side, end, jump in ((cut.enters, cut.a, -1.0), (cut.leaves, cut.b, 1.0)):
        k = np.flatnonzero(side >= 0)
        who, j = cut.owner[k], side[k]
        along = passed[j, who] + edge_term(corners[:, j, who], end[:, k], normal[:, k])
        value += np.bincount(who, jump * (passed[4, who] - along), minlength=count)
    at = np.concatenate([np.where(side == 0, q, 2.0) for side, q in ((cut.enters, cut.q[0]), (cut.leaves, cut.q[1]))])
    return value, at, np.repeat([-1, 1], cut.owner.size)
