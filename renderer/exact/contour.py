"""The contour of the visible part of a light, as arcs that any boundary integral can be summed over.

It consists of the light's edges outside every occluder, and of the occluders' outlines inside the light's cone and
outside every other occluder (Nishita & Nakamae 1983; Stark & Riesenfeld 2000). Along an edge all of these are
intervals, and so is what they leave.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry import Ints
from ..vectors import Floats
from .fans import Fan
from .light_cone import Bools, LightCone
from .lines import joined, remaining


@dataclass(frozen=True)
class Arcs:
    """Great-circle arcs.

    Parameters
    ----------
    point : (k,) int64
    sign : (k,) float64
        +1 on the light's own edges, -1 on outlines.
    start, end : (3, k) float64
        Not unit vectors.
    """

    point: Ints
    sign: Floats
    start: Floats
    end: Floats


@dataclass(frozen=True)
class Contour:
    """What is left of a light.

    Parameters
    ----------
    lit, hidden : (n,) bool
        Nothing of the light is hidden; all of it is.
    candidates : (n,) int64
        Occluders that meet the light.
    arcs : Arcs
        The contour for the other points.
    """

    lit: Bools
    hidden: Bools
    candidates: Ints
    arcs: Arcs


def visible_contour(light: LightCone, fans: list[Fan], inside: Ints, shortcuts: bool, most: int) -> Contour:
    """The visible contour for every point of a light's cones.

    Parameters
    ----------
    fans : list of Fan
        All pairs of a point and an occluder that may matter.
    inside : (k,) int64
        Points inside an occluder: hidden.
    shortcuts : bool
        Leave out what cannot matter.
    most : int
        Points with more candidates than this get no arcs.
    """
    n = light.start.shape[2]
    hidden = np.zeros(n, dtype=bool)
    hidden[inside] = True
    hides = [fan.hides(light) for fan in fans]
    if shortcuts:
        for fan, (lo, hi) in zip(fans, hides, strict=True):
            hidden[fan.point[(((lo <= 0) & (hi >= 1)) | ~light.live[:, fan.point]).all(axis=0)]] = True
    candidates = np.zeros(n, dtype=np.int64)
    kept, edges = [], []
    for fan, spans in zip(fans, hides, strict=True):
        some = np.flatnonzero(~hidden[fan.point])
        fan, spans = fan.take(some), (spans[0][:, some], spans[1][:, some])
        before = fan.before(light)
        meets = np.ones(some.size, dtype=bool)
        if shortcuts:
            meets = (spans[0] < spans[1]).any(axis=0) | (before[0] < before[1]).any(axis=0)
        some = np.flatnonzero(meets)
        candidates += np.bincount(fan.point[some], minlength=n)
        kept.append((fan.take(some), spans[0][:, some], spans[1][:, some]))
        edges.append((before[0][:, some], before[1][:, some]))
    exact = (candidates <= most) & ~hidden & ((candidates > 0) | (not shortcuts))
    arcs = [_light_arcs(light, kept, exact)]
    fans = [fan for fan, _, _ in kept]
    for own, (fan, (lo, hi)) in enumerate(zip(fans, edges, strict=True)):
        arcs.append(_outline_arcs(fan, own, lo, hi, fans, exact))
    arcs = [part for part in arcs if part.point.size]
    whole = _concatenated(arcs)
    empty = exact & (np.bincount(whole.point, minlength=n) == 0)
    return Contour((candidates == 0) & ~hidden, hidden | empty, candidates, whole)


def _concatenated(arcs: list[Arcs]) -> Arcs:
    if not arcs:
        return Arcs(np.empty(0, dtype=np.int64), np.empty(0), np.empty((3, 0)), np.empty((3, 0)))
    return Arcs(
        np.concatenate([a.point for a in arcs]),
        np.concatenate([a.sign for a in arcs]),
        np.hstack([a.start for a in arcs]),
        np.hstack([a.end for a in arcs]),
    )


def _light_arcs(light: LightCone, kept: list[tuple[Fan, Floats, Floats]], exact: Bools) -> Arcs:
    """The light's edges outside every outline."""
    e, n = light.live.shape
    numbers, los, his = [np.empty(0, dtype=np.int64)], [np.empty(0)], [np.empty(0)]
    for fan, lo, hi in kept:
        k = np.flatnonzero((lo < hi) & light.live[:, fan.point] & exact[fan.point])
        edge, pair = np.divmod(k, fan.point.size) if fan.point.size else (k, k)
        numbers.append(edge * n + fan.point[pair])
        los.append(lo.ravel()[k])
        his.append(hi.ravel()[k])
    t1 = (light.live & exact).astype(np.float64).ravel()  # edges that are not there have no length
    found = remaining(np.zeros(e * n), t1, np.concatenate(numbers), np.concatenate(los), np.concatenate(his))
    start, end = light.start.reshape(3, -1), light.end.reshape(3, -1)
    return _arcs(found, found[0] % n, start[:, found[0]], end[:, found[0]], 1.0)


def _outline_arcs(fan: Fan, own: int, lo: Floats, hi: Floats, fans: list[Fan], exact: Bools) -> Arcs:
    """The edges of a fan's outlines inside the light and outside every other outline."""
    k = np.flatnonzero((lo < hi) & exact[fan.point])
    q = max(fan.point.size, 1)
    edge, pair = np.divmod(k, q)
    point, start = fan.point[pair], fan.corners[:, edge, pair]
    end = fan.corners[:, (edge + 1) % fan.corners.shape[1], pair]
    t0, t1 = lo.ravel()[k], hi.ravel()[k]
    numbers, los, his = [np.empty(0, dtype=np.int64)], [np.empty(0)], [np.empty(0)]
    for other, against in enumerate(fans):
        count = np.bincount(against.point, minlength=exact.size)
        i, j = joined(point, np.cumsum(count) - count, count)
        if other == own:
            i, j = i[pair[i] != j], j[pair[i] != j]
        if i.size:
            a, b = against.cover(j, start[:, i], end[:, i])
            numbers.append(i)
            los.append(a)
            his.append(b)
    found = remaining(t0, t1, np.concatenate(numbers), np.concatenate(los), np.concatenate(his))
    return _arcs(found, point[found[0]], start[:, found[0]], end[:, found[0]], -1.0)


def _arcs(found: tuple[Ints, Floats, Floats], point: Ints, start: Floats, end: Floats, sign: float) -> Arcs:
    """Parts t0 .. t1 of edges; whole ones keep their ends' digits."""
    _, t0, t1 = found
    step = end - start
    return Arcs(point, np.full(point.size, sign), start + t0 * step, np.where(t1 >= 1, end, start + t1 * step))
