"""The rims of what is left of a light, as arcs that any boundary integral can be summed over."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.renderer.closed_forms.circles.circles import CircleArcs
from nusselt.renderer.closed_forms.circles.pairing import columns
from nusselt.renderer.vectors import Floats, Ints

from .conics import angle
from .sections import FINE
from .strips import Bodies, Trapezoids


@dataclass(frozen=True, eq=False)
class Arcs:
    """Great-circle arcs.

    Parameters
    ----------
    point : (k,) int64
    start, end : (3, k) float64
        Not unit vectors.
    """

    point: Ints
    start: Floats
    end: Floats


def rims(bodies: Bodies, parts: Trapezoids, few: bool) -> tuple[Arcs, list[tuple[CircleArcs, Floats]]]:
    """The trapezoids' rims.

    Where two of them meet along a line of constant u the arcs cancel; with ``few`` they are not made: that costs
    more than it saves for the irradiance, and less for the Phong lobe.
    """
    point, u, v = parts.point, parts.u, parts.v
    straight = parts.curve < bodies.lines
    owners, us, vs = [], [], []
    for side, sign in ((0, 1), (1, -1)):  # below onwards, above back
        mine = np.flatnonzero(straight[side])
        owners.append(point[mine])
        us.append(columns(u, mine)[::sign])
        vs.append(columns(v[side], mine)[::sign])
    upright = _cancelled(parts) if few else _upright(parts)
    owners.append(upright[0])
    us.append(np.stack((upright[1], upright[1])))
    vs.append(upright[2])
    owner, u_ends, v_ends = np.concatenate(owners), np.hstack(us), np.hstack(vs)
    start, end = (bodies.square.at(owner, u_ends[k], v_ends[k]) for k in (0, 1))
    return Arcs(owner, start, end), _curved(bodies, parts)


def _upright(parts: Trapezoids) -> tuple[Ints, Floats, Floats]:
    """Sides of constant u: points (k,), u (k,), and v (2, k) from and to."""
    one, two = (np.flatnonzero(parts.v[0, end] != parts.v[1, end]) for end in (1, 0))
    v = np.hstack((columns(parts.v[:, 1], one), columns(parts.v[::-1, 0], two)))
    return np.concatenate((parts.point[one], parts.point[two])), np.concatenate((parts.u[1, one], parts.u[0, two])), v


def _cancelled(parts: Trapezoids) -> tuple[Ints, Floats, Floats]:
    """The same without what lies on both sides of one line, and without slivers of rounding."""
    point = np.tile(parts.point, 4)
    u = np.concatenate((parts.u[1], parts.u[1], parts.u[0], parts.u[0]))
    v = np.concatenate((parts.v[0, 1], parts.v[1, 1], parts.v[0, 0], parts.v[1, 0]))
    step = np.repeat([1, -1, -1, 1], parts.point.size)
    order = np.lexsort((v, u, point))
    point, u, v, net = point[order], u[order], v[order], np.cumsum(step[order])
    there = (net[:-1] != 0) & (u[1:] == u[:-1]) & (point[1:] == point[:-1]) & (np.diff(v) > 2 * FINE)
    k = np.flatnonzero(there)
    k = np.repeat(k, np.abs(net[k]))  # slivers of rounding may lie on each other
    ends = np.where(net[k] > 0, [v[k], v[k + 1]], [v[k + 1], v[k]])
    return point[k], u[k], ends


def _curved(bodies: Bodies, parts: Trapezoids) -> list[tuple[CircleArcs, Floats]]:
    """Parts of round outlines, ascending, and how they count: -1 where the rim runs the other way, as it mostly does.

    Beside the place where a line of constant u touches an outline, an angle is known to the root of rounding only:
    a short arc may then run backwards. Which of two ways round it is, is told by a place between.
    """
    out = []
    for group, first, _ in bodies.curved():
        for side, sign in ((0, -1), (1, 1)):  # ascending about what is hidden
            pair = parts.curve[side] - first
            mine = np.flatnonzero((pair >= 0) & (pair < group.point.size))
            pair, owner = pair[mine], parts.point[mine]
            cone = group.cone.take(pair)
            ends = [
                angle(cone, bodies.square.at(owner, parts.u[end, mine], parts.v[side, end, mine]))
                for end in ((0, 1) if sign > 0 else (1, 0))
            ]
            turn = np.mod(ends[1] - ends[0], 2 * np.pi)
            far = np.flatnonzero(turn > 2 * np.pi - NOTHING)
            if far.size:
                u = parts.u[:, mine[far]].mean(axis=0)
                v = np.clip(group.interval(pair[far], u, meets=True)[1 - side], 0.0, 1.0)
                between = np.mod(angle(cone.take(far), bodies.square.at(owner[far], u, v)) - ends[0][far], 2 * np.pi)
                back = np.minimum(between, 2 * np.pi - between) < NOTHING / 10
                turn[far[back]] -= 2 * np.pi
            begin = np.where(turn < 0, ends[1], ends[0])
            out.append((CircleArcs(cone, begin, begin + np.abs(turn)), np.where(turn < 0, 1.0, -1.0)))
    return out


NOTHING = 1e-3
"""What lacks so little of a circle may be so little of it, the other way."""
