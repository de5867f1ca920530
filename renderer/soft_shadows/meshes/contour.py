"""Silhouette edges from many points, cut to the light above their horizon, and Lambert's terms along them."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.geometry.ragged import take
from nusselt.renderer.vectors import Floats, Ints, cross, dot

from .light_frame import Candidates, LightFrame


def edge_terms(a: Floats, way: Floats, n: Floats, size: Floats | float | None = 0.0) -> tuple[Floats, Floats]:
    """Lambert's -1/2 angle(a, b) n . (a x b)/|a x b| with b = a + way, and what rounding does to it.

    Positive along a counter-clockwise rim above the horizon. The product a x way and the angle from atan2 keep their
    digits however short the way; parallel a and b give 0.

    Parameters
    ----------
    a, way, n : (3, m) float64
        The way is rounded relative to itself.
    size : (m,) float64, optional
        Magnitude of the coordinates whose rounding moves a and b; without it there is no doubt, 0.

    Returns
    -------
    term : (m,) float64
    doubt : (m,) float64
        Of the order of how much it changes, in units of a relative rounding error: the plane of a and b turns by
        |a| |way| / |a x way|, and size / |a| more.
    """
    normal = cross(a, way)
    square, along = dot(a, a), dot(a, way)
    sine = np.sqrt(dot(normal, normal))
    angle = np.arctan2(sine, square + along)
    inverse = np.divide(angle, sine, out=np.zeros_like(sine), where=sine > 0)
    term: Floats = -0.5 * inverse * dot(n, normal)
    if size is None:
        return term, np.zeros_like(term)
    length = dot(way, way)
    doubt = inverse * np.sqrt(square * length)
    near = np.minimum(square, square + 2 * along + length)
    with np.errstate(divide="ignore", invalid="ignore"):
        doubt *= 1 + np.where(near > 0, size / np.sqrt(np.maximum(near, 0)), np.inf)
    return term, doubt


def edge_term(a: Floats, b: Floats, n: Floats) -> Floats:
    """Lambert's term from a to b: see `edge_terms`."""
    return edge_terms(a, b - a, n, None)[0]


@dataclass(frozen=True, eq=False)
class Pieces:
    """The parts of silhouette edges that lie before the light; layers on the left seen from the receiver.

    Parameters
    ----------
    owner : (m,) int64
        Receiver of each.
    a, b : (3, m) float64
        Ends, from the receiver.
    enters, leaves : (m,) int64
        Side of the rim where it begins and ends: 0 to 3, 4 for the horizon, or -1 if it does so inside.
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


HORIZON = 1e-12
"""Height over the horizon, against the coordinates, below which an edge is taken to lie on it: the edges of the
face that a point lies on do, to rounding."""


SIDES = ((0, 1.0, 0.0), (1, -1.0, 1.0), (0, -1.0, 1.0), (1, 1.0, 0.0))
"""Of the light: p or q, and what sign p, or q, less a bound has inside."""


@dataclass(frozen=True, eq=False)
class Silhouettes:
    """Silhouette edges that may lie before the light, each seen from one point.

    Parameters
    ----------
    owner : (m,) int64
        The point.
    ahead : (m,) bool
        Whether the face on the left is the one turned to it.
    start, end : (3, m) float64
        World.
    local_start, local_end : (3, m) float64
        The same in the light's frame.
    size : (m,) float64
        Magnitude of the coordinates of all edges that were looked at.
    """

    owner: Ints
    ahead: NDArray[np.bool_]
    start: Floats
    end: Floats
    local_start: Floats
    local_end: Floats
    size: Floats

    @classmethod
    def of(cls, edges: Candidates, height: Floats, local: Floats) -> Silhouettes:
        """Of points ``local`` (3, m) in the light's frame, at ``height`` (f, m) over the faces."""
        front = height > 0  # each face once: were two of its edges to disagree by rounding, the contour would not close
        left = np.take(front, edges.left, axis=0)
        pair = np.flatnonzero(left != np.take(front, edges.right, axis=0))
        edge, owner = np.divmod(pair, local.shape[1])
        near = _not_beyond(edges, edge, owner, local)
        edge, ahead = take(edge, near), take(left.ravel(), take(pair, near))
        start, end, first, last = (take(v, edge) for v in (edges.start, edges.end, edges.local_start, edges.local_end))
        size = np.full(edge.size, np.abs(edges.start).max(initial=0))
        return cls(take(owner, near), ahead, start, end, first, last, size)

    @classmethod
    def joined(cls, parts: list[Silhouettes]) -> Silhouettes:
        """One after the other."""
        names = [part.name for part in fields(cls)]
        return cls(*(np.concatenate([getattr(part, name) for part in parts], axis=-1) for name in names))


def pieces(edges: Silhouettes, x: Floats, n: Floats, local: Floats, frame: LightFrame) -> Pieces:
    """Of points x with normals n, (3, m), ``local`` in the light's frame."""
    owner, ahead = edges.owner, edges.ahead
    at = take(local, owner)
    a, b = edges.local_start - at, edges.local_end - at
    first, last = np.zeros(owner.size), np.ones(owner.size)
    begins, ends = np.full(owner.size, -1), np.full(owner.size, -1)
    # A light wholly above a horizon has nothing before it that is not.
    clear = above_horizon(x, n, frame)
    for side in range(4 if clear else 5):
        if side < 4:  # inside where sign (p - bound) >= 0, times the depth -r of the direction
            axis, sign, bound = SIDES[side]
            ga, gb = (sign * (at[2] * v[axis] - (at[axis] - bound) * v[2]) for v in (a, b))
        else:
            ga, gb = _over_horizon(edges, x, n)
        with np.errstate(divide="ignore", invalid="ignore"):
            cut = ga / (ga - gb)
        later = (ga < 0) & (gb >= 0) & (cut > first)
        sooner = (ga >= 0) & (gb < 0) & (cut < last)
        first, begins = np.where(later, cut, first), np.where(later, side, begins)
        last, ends = np.where(sooner, cut, last), np.where(sooner, side, ends)
        last = np.where((ga < 0) & (gb < 0), -1.0, last)
    # One that only starts on the rim, or ends there, has no length, but is where the contour leaves or enters.
    k = np.flatnonzero((first <= last) & (np.minimum(a[2], b[2]) < 0))
    owner, ahead = take(owner, k), take(ahead, k)
    first, last, begins, ends = (take(v, k) for v in (first, last, begins, ends))
    at = take(x, owner)
    a, b = take(edges.start, k) - at, take(edges.end, k) - at
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
    for end, where in enumerate((begins, ends)):
        for side, (axis, _, bound) in enumerate(SIDES):  # on the rim to the last bit, or strips would not close
            (p, q)[axis][end, where == side] = bound
    return Pieces(owner, a, b, begins, ends, p, q)


def _not_beyond(edges: Candidates, edge: Ints, owner: Ints, local: Floats) -> Ints:
    """Which pairs (k,) of an edge and a point are not wholly beyond one side of the light: few."""
    k: Ints = np.arange(edge.size)
    for axis in (0, 1):
        at, depth = take(local[axis], owner), take(local[2], owner)
        ends = [
            (take(end[axis], edge) - at, take(end[2], edge) - depth) for end in (edges.local_start, edges.local_end)
        ]
        beyond = np.zeros(edge.size, dtype=bool)
        for _, sign, bound in SIDES[axis::2]:
            first, last = (sign * (depth * across - (at - bound) * down) < 0 for across, down in ends)
            beyond |= first & last
        left = np.flatnonzero(~beyond)
        k, edge, owner = take(k, left), take(edge, left), take(owner, left)
    return k


def above_horizon(x: Floats, n: Floats, frame: LightFrame) -> bool:
    """Whether all of the light is above the horizon of each point x with normal n, (3, m), by more than rounding."""
    height = dot(n[:, None, :], frame.rim[:, :, None] - x[:, None, :])
    size = np.abs(frame.rim).max() + np.abs(x).max(initial=0)
    return bool((height > HORIZON * size).all())


def _over_horizon(edges: Silhouettes, x: Floats, n: Floats) -> tuple[Floats, Floats]:
    """Heights of the ends of edges over the horizons of their points, less the tolerance; each (m,)."""
    size = HORIZON * (edges.size + np.abs(x).max(initial=0))
    normal, level = take(n, edges.owner), take(dot(n, x), edges.owner) + size
    first, last = (dot(normal, end) - level for end in (edges.start, edges.end))
    return first, last


@dataclass(frozen=True, eq=False)
class Rim:
    """The light's rim above the horizon of n points, walked from its first corner, which is.

    Parameters
    ----------
    begin : (5, 3, n) float64
        Where each side begins, from the point: the light's four, and the horizon's part between them.
    passed : (5, n) float64
        Sum of Lambert's terms before each side.
    whole : (n,) float64
        Of all of them: the light's irradiance.
    doubt : (n,) float64
        What rounding does to that: see `edge_terms`.
    rising : (n,) bool
        Whether the horizon bounds the light on the left, beyond the first side.
    q : (2, n) float64
        Where the horizon's part begins and ends on the light; 0 if there is none.
    """

    begin: Floats
    passed: Floats
    whole: Floats
    doubt: Floats
    rising: NDArray[np.bool_]
    q: Floats

    @classmethod
    def of(cls, x: Floats, n: Floats, frame: LightFrame, size: Floats | None) -> Rim:
        """For points x with normals n, (3, n), and coordinates of magnitude ``size`` (n,), if doubts are asked for."""
        a, count = frame.rim.T[:, :, None] - x, x.shape[1]  # corner by corner
        ha = dot(n[:, None, :], a.swapaxes(0, 1))
        b, hb = np.roll(a, -1, axis=0), np.roll(ha, -1, axis=0)
        up = np.stack((ha >= 0, hb >= 0))
        crosses = up[0] != up[1]
        share = np.divide(ha, ha - hb, out=np.zeros_like(ha), where=crosses)
        at = a + share[:, None] * (b - a)
        each, along = np.arange(count), np.stack((share[0], np.ones(count), 1 - share[2], np.zeros(count)))
        horizon, q = np.zeros((2, 3, count)), np.zeros((2, count))
        for end, mine in enumerate((crosses & up[0], crosses & up[1])):
            side, here = 3 - mine[::-1].argmax(axis=0), mine.any(axis=0)
            horizon[end] = np.where(here, at[side, :, each].T, 0.0)
            q[end] = np.where(here, along[side, each], 0.0)
        sinks = np.concatenate((np.zeros((1, count), dtype=bool), crosses & up[0]))  # the horizon comes after this side
        begin = np.concatenate((np.where(up[0][:, None], a, at), horizon[:1]))
        way = np.concatenate((np.where(up[1][:, None], b, at), horizon[1:])) - begin
        first, way = (v.swapaxes(0, 1).reshape(3, -1) for v in (begin, way))
        normal = np.tile(n, 5)
        terms, doubts = (
            v.reshape(5, count) for v in edge_terms(first, way, normal, None if size is None else np.tile(size, 5))
        )
        terms[:4] *= up.any(axis=0)
        cut = sinks.any(axis=0)
        level = np.where(cut, terms[4], 0.0)
        before = np.cumsum(np.vstack((np.zeros(count), terms[:4])), axis=0)
        sunk = np.cumsum(sinks, axis=0) > 0
        passed = before[:4] + np.where(sunk[:4], level, 0.0)
        own = np.where(sinks, before, 0.0).sum(axis=0)
        return cls(
            begin,
            np.concatenate((passed, own[None])),
            before[4] + level,
            doubts[:4].sum(axis=0) + np.where(cut, doubts[4], 0.0),
            sinks[1] & (q[1] > q[0]),
            q * cut,
        )


def before_corner(cut: Pieces, at: Floats, jump: Ints, spot: Floats, within: Ints) -> Ints:
    """Layers (n,) before the light's first corner, from those ``within`` (n,) before its points ``spot`` (2, n).

    What is passed on the way from there, along q to the light's left and down, is told from the pieces themselves,
    so that a contour through the corner is on the same side of it here and there. ``at``, ``jump``: see `layers`.
    """
    p, q = take(spot, cut.owner)
    passed = np.flatnonzero((cut.q[0] < q) != (cut.q[1] < q))
    share = (q - cut.q[0])[passed] / (cut.q[1] - cut.q[0])[passed]
    k = passed[cut.p[0][passed] + share * (cut.p[1] - cut.p[0])[passed] < p[passed]]
    count = within.size
    steps = np.bincount(cut.owner[k], np.where(cut.q[1] > cut.q[0], 1, -1)[k], minlength=count)
    owner = np.concatenate((cut.owner, cut.owner))
    turned = np.flatnonzero(at < take(spot[1], owner))
    jumps = np.bincount(owner[turned], jump[turned], minlength=count)
    return within - np.rint(steps + jumps).astype(np.int64)


def on_left(cut: Pieces, rim: Rim) -> tuple[Floats, Ints]:
    """For every piece's beginning, then every end: how far up the light's left (q, or 2 if not there) w changes, and
    by how much; (2 m,).
    """
    at = [
        np.where((side == 0) | ((side == 4) & take(rim.rising, cut.owner)), q, 2.0)
        for side, q in ((cut.enters, cut.q[0]), (cut.leaves, cut.q[1]))
    ]
    return np.concatenate(at), np.repeat([-1, 1], cut.owner.size)


def layers(cut: Pieces, rim: Rim, n: Floats, start: Ints, size: Floats | None) -> tuple[Floats, Floats]:
    """int f w over the light for points with normals n (3, n) and layers ``start`` (n,) before the first corner.

    Along the rim from that corner, w falls where a piece enters and rises where one leaves. Returned with the sum of
    all terms' doubts, for coordinates of magnitude ``size`` (n,); 0 without it.
    """
    count = n.shape[1]
    normal = take(n, cut.owner)
    term, doubt = edge_terms(cut.a, cut.b - cut.a, normal, None if size is None else take(size, cut.owner))
    value = start * rim.whole + np.bincount(cut.owner, term, minlength=count)
    rims = np.abs(start)
    for side, end, jump in ((cut.enters, cut.a, -1.0), (cut.leaves, cut.b, 1.0)):
        k = np.flatnonzero(side >= 0)
        who, j = cut.owner[k], side[k]
        along = rim.passed[j, who] + edge_term(rim.begin[j, :, who].T, end[:, k], normal[:, k])
        value += np.bincount(who, jump * (rim.whole[who] - along), minlength=count)
        rims = rims + 2 * np.bincount(who, minlength=count)
    return value, np.bincount(cut.owner, doubt, minlength=count) + rims * rim.doubt
