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
from .circles import CircleArcs, circle_arcs
from .fans import Fan
from .light_cone import Bools, LightCone
from .lines import joined, remaining
from .rounds import Rounds

Group = Fan | Rounds


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

    def take(self, index: Ints) -> Arcs:
        """Some of the arcs."""
        return Arcs(self.point[index], self.sign[index], self.start[:, index], self.end[:, index])


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
    circles : list of CircleArcs
        The contour for the other points.
    """

    lit: Bools
    hidden: Bools
    candidates: Ints
    arcs: Arcs
    circles: list[CircleArcs]


def visible_contour(light: LightCone, groups: list[Group], inside: Ints, shortcuts: bool, most: int) -> Contour:
    """The visible contour for every point of a light's cones.

    Parameters
    ----------
    groups : list of Fan or Rounds
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
    hides = [group.hides(light) for group in groups]
    if shortcuts:
        for group, (lo, hi) in zip(groups, hides, strict=True):
            hidden[group.point[(((lo <= 0) & (hi >= 1)) | ~light.live[:, group.point]).all(axis=0)]] = True
    candidates = np.zeros(n, dtype=np.int64)
    kept, spans, inner = [], [], []
    for group, (lo, hi) in zip(groups, hides, strict=True):
        some = np.flatnonzero(~hidden[group.point])
        few, inwards = group.take(some), None
        meets = np.asarray(((lo < hi) & light.live[:, group.point]).any(axis=0))[some]
        if isinstance(few, Fan):
            inwards = few.before(light)
            meets |= (inwards[0] < inwards[1]).any(axis=0)
        else:
            meets |= few.reaches(light)
        where = np.flatnonzero(meets) if shortcuts else np.arange(some.size)
        candidates += np.bincount(few.point[where], minlength=n)
        kept.append(few.take(where))
        spans.append((lo[:, some[where]], hi[:, some[where]]))
        inner.append(None if inwards is None else (inwards[0][:, where], inwards[1][:, where]))
    exact = (candidates <= most) & ~hidden & ((candidates > 0) | (not shortcuts))
    arcs, circles = [_light_arcs(light, kept, spans, exact)], []
    for own, (group, part) in enumerate(zip(kept, inner, strict=True)):
        if isinstance(group, Rounds):
            circles.append(circle_arcs(light, group, own, kept, exact))
        elif part is not None:
            arcs.append(_outline_arcs(group, own, *part, kept, exact))
    whole = _concatenated([part for part in arcs if part.point.size])
    pieces = np.bincount(whole.point, minlength=n)
    for found in circles:
        pieces += np.bincount(found.cone.point, minlength=n)
    lit = (candidates == 0) & ~hidden
    return Contour(lit, hidden | (exact & (pieces == 0)), candidates, whole, circles)


def _concatenated(arcs: list[Arcs]) -> Arcs:
    if not arcs:
        return Arcs(np.empty(0, dtype=np.int64), np.empty(0), np.empty((3, 0)), np.empty((3, 0)))
    return Arcs(
        np.concatenate([a.point for a in arcs]),
        np.concatenate([a.sign for a in arcs]),
        np.hstack([a.start for a in arcs]),
        np.hstack([a.end for a in arcs]),
    )


def _light_arcs(light: LightCone, kept: list[Group], spans: list[tuple[Floats, Floats]], exact: Bools) -> Arcs:
    """The light's edges outside every outline."""
    e, n = light.live.shape
    numbers: list[Ints] = [np.empty(0, dtype=np.int64)]
    los: list[Floats] = [np.empty(0)]
    his: list[Floats] = [np.empty(0)]
    for fan, (lo, hi) in zip(kept, spans, strict=True):
        k = np.flatnonzero((lo < hi) & light.live[:, fan.point] & exact[fan.point])
        edge, pair = np.divmod(k, fan.point.size) if fan.point.size else (k, k)
        numbers.append(edge * n + fan.point[pair])
        los.append(lo.ravel()[k])
        his.append(hi.ravel()[k])
    t1 = (light.live & exact).astype(np.float64).ravel()  # edges that are not there have no length
    found = remaining(np.zeros(e * n), t1, np.concatenate(numbers), np.concatenate(los), np.concatenate(his))
    start, end = light.start.reshape(3, -1), light.end.reshape(3, -1)
    return _arcs(found, found[0] % n, start[:, found[0]], end[:, found[0]], 1.0)


def _outline_arcs(fan: Fan, own: int, lo: Floats, hi: Floats, groups: list[Group], exact: Bools) -> Arcs:
    """The edges of a fan's outlines inside the light and outside every other outline."""
    k = np.flatnonzero((lo < hi) & exact[fan.point])
    q = max(fan.point.size, 1)
    edge, pair = np.divmod(k, q)
    point, start = fan.point[pair], fan.corners[:, edge, pair]
    end = fan.corners[:, (edge + 1) % fan.corners.shape[1], pair]
    t0, t1 = lo.ravel()[k], hi.ravel()[k]
    numbers: list[Ints] = [np.empty(0, dtype=np.int64)]
    los: list[Floats] = [np.empty(0)]
    his: list[Floats] = [np.empty(0)]
    for other, against in enumerate(groups):
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
