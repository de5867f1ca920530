"""What several layers count more than once: int f (w - 1) where w > 1, strip by strip.

Strips of the light lie between consecutive ends of pieces, so that no piece begins or ends inside one; two
lines through each, at Gauss's points, cross the same pieces. Along a line the integral of f is closed. Left
out: that two pieces may cross inside a strip, between the lines or before them. On a mesh whose edges are
short against the light that is the square of an edge's length; measured in the tests.
"""

from __future__ import annotations

import math

import numpy as np

from ..geometry import Ints
from ..pairs import expand, take
from ..vectors import Floats, column, cross, dot
from .contour import Pieces
from .light_frame import LightFrame


def line_term(x: Floats, n: Floats, frame: LightFrame, p: Floats, q: Floats) -> Floats:
    """int from p to 1 of (n . d) h / |d|^4 dp' times |ab x ac|, along the line q of the light.

    With d = e + s ab, e from x to (p, q): (c + s g) / (s^2 A + 2 s B + C)^2 has the closed form below;
    Q = A C - B^2 = |ab x e|^2 is taken from the cross product, where it keeps its digits.
    """
    ab, ac = column(frame.light.ab), column(frame.light.ac)
    e = frame.rim[:, :1] + p * ab + q * ac - x
    end = 1 - p
    aa, b, c2 = float(dot(ab, ab)[0]), dot(ab, e), dot(e, e)
    across = cross(np.broadcast_to(ab, e.shape), e)
    qq = dot(across, across)
    c, g = dot(n, e), dot(n, np.broadcast_to(ab, n.shape))
    far = aa * end * end + 2 * b * end + c2
    root = np.sqrt(qq)
    angle = np.arctan2(end * root, c2 + b * end)
    # int ds / D^2 and int s ds / D^2 over [0, end], D = aa s^2 + 2 b s + c2.
    one = ((aa * end + b) / far - b / c2) / (2 * qq) + aa * angle / (2 * qq * root)
    s_one = (1 / c2 - 1 / far) / (2 * aa) - b / aa * one
    height = np.abs(dot(np.broadcast_to(cross(ab, ac), e.shape), e))  # h |ab x ac|
    return height * (c * one + g * s_one)


def extra_layers(
    cut: Pieces, x: Floats, n: Floats, start: Ints, at: Floats, jump: Floats, frame: LightFrame
) -> Floats:
    """int f (w - 1)+ over the light, (n,): see `contour.layers` for ``start``, ``at`` and ``jump``."""
    count = x.shape[1]
    out = np.zeros(count)
    # Receiver i lives in [2 i, 2 i + 1]: one sorted list of strip ends for all of them.
    base = 2.0 * cut.owner
    low, high = base + cut.q.min(axis=0), base + cut.q.max(axis=0)
    side = np.flatnonzero(at <= 1)
    first = 2.0 * np.concatenate((cut.owner, cut.owner))[side] + at[side]
    ends = np.concatenate((2.0 * np.arange(count), 2.0 * np.arange(count) + 1, low, high, first))
    ends.sort()
    height = np.diff(ends)
    k = np.flatnonzero((height > 0) & (ends[:-1] % 2 < 1) & (ends[1:] - np.floor(ends[:-1] / 2) * 2 <= 1))
    strip, height = ends[k], height[k]
    middle = strip + height / 2
    who = (middle / 2).astype(np.int64)
    # Layers left of the light in each strip, and how many rise in it: only where two may lie does it matter.
    begin, stop = np.searchsorted(middle, low), np.searchsorted(middle, high)
    rises = cut.q[1] > cut.q[0]
    started = np.searchsorted(middle, first)
    steps = np.bincount(started, jump[side], minlength=strip.size + 1)
    # A receiver's changes end with it.
    total = np.cumsum(steps)[: strip.size]
    opening = np.searchsorted(middle, 2.0 * np.arange(count))
    before = np.concatenate(([0.0], np.cumsum(steps)))[opening]
    left = start[who] + np.rint(total - before[who]).astype(np.int64)
    up = np.bincount(begin[rises], minlength=strip.size + 1) - np.bincount(stop[rises], minlength=strip.size + 1)
    good = np.flatnonzero(left + np.cumsum(up)[: strip.size] > 1)
    if good.size == 0:
        return out
    number = np.concatenate(([0], np.cumsum(np.bincount(good, minlength=strip.size))))
    strip, height, who, left = strip[good], height[good], who[good], left[good]
    piece, offset = expand(number[stop] - number[begin])
    line = number[begin][piece] + offset
    sign = np.where(rises, 1, -1)[piece]
    for share in (0.5 - math.sqrt(1 / 12), 0.5 + math.sqrt(1 / 12)):
        q = strip + share * height - 2.0 * who
        pa, pb, qa, qb = (take(v, piece) for v in (*cut.p, *cut.q))
        p = np.clip(pa + (take(q, line) - qa) * ((pb - pa) / (qb - qa)), 0, 1)
        order = np.lexsort((-sign, p, line))
        where, step, place = line[order], sign[order], p[order]
        # Layers right and left of each crossing.
        opening = np.flatnonzero(np.diff(where, prepend=-1))
        runs = np.diff(np.append(opening, where.size))
        total = np.cumsum(step)
        right = total - np.repeat((total - step)[opening] - left[where[opening]], runs)
        change = np.maximum(right - 1, 0) - np.maximum(right - step - 1, 0)
        k = np.flatnonzero(change)
        more = np.flatnonzero(left > 1)
        where = np.concatenate((where[k], more))
        change = np.concatenate((change[k], left[more] - 1))
        place = np.concatenate((place[k], np.zeros(more.size)))
        i = who[where]
        term = line_term(take(x, i), take(n, i), frame, place, q[where])
        out += np.bincount(i, term * change * height[where] / 2, minlength=count)
    return out
