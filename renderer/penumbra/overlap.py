"""What several layers count more than once: int f (w - 1) where w > 1, strip by strip.

Strips of the light lie between consecutive ends of pieces, so that no piece begins or ends inside one; two
lines through each, at Gauss's points, cross the same pieces. Along a line the integral of f is closed. Left
out: that two pieces may cross inside a strip, between the lines or before them. On a mesh whose edges are
short against the light that is the square of an edge's length; measured in the tests.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..geometry import Ints
from ..pairs import expand, take
from ..vectors import Floats, column, cross, dot
from .contour import Pieces, Rim, above_horizon
from .light_frame import LightFrame

PART = 1 / 64
"""Height of the parts of a strip that two Gauss lines are enough for: their error is height^4 / 4320 of the fourth
derivative, 1e-11."""

THICK = 4e-3
"""Height of a strip, of the light's, above which one line through its middle is not enough: the error is that of
the midpoint rule, height^3 / 24 of the second derivative."""


def line_term(x: Floats, n: Floats, frame: LightFrame, p: Floats, q: Floats, to: Floats) -> Floats:
    """int from p to ``to`` of (n . d) h / |d|^4 dp' times |ab x ac|, along the line q of the light.

    With d = e + s ab, e from x to (p, q): (c + s g) / (s^2 A + 2 s B + C)^2 has the closed form below;
    Q = A C - B^2 = |ab x e|^2 is taken from the cross product, where it keeps its digits.
    """
    ab, ac = column(frame.light.ab), column(frame.light.ac)
    e = frame.rim[:, :1] + p * ab + q * ac - x
    end = np.maximum(to - p, 0)
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
    return np.asarray(height * (c * one + g * s_one))


def _span(x: Floats, n: Floats, frame: LightFrame, q: Floats) -> tuple[Floats, Floats]:
    """From which p to which p the line q of the light lies above the horizon; equal if nowhere."""
    level = dot(n, frame.rim[:, :1] - x) + q * dot(n, column(frame.light.ac) + 0 * x)
    slope = dot(n, column(frame.light.ab) + 0 * x)
    at = np.divide(-level, slope, out=np.where(level >= 0, np.inf, -np.inf), where=slope != 0)
    low, high = np.where(slope > 0, at, 0.0), np.where(slope > 0, 1.0, np.where(slope < 0, at, np.sign(at)))
    return np.clip(low, 0, 1), np.clip(high, 0, 1)


def extra_layers(
    cut: Pieces,
    rim: Rim,
    x: Floats,
    n: Floats,
    start: Ints,
    at: Floats,
    jump: Ints,
    frame: LightFrame,
    detail: int,
    merge: int,
) -> Floats:
    """int f (w - 1)+ over the light, (n,): see `contour.layers` for ``start``, ``at`` and ``jump``.

    With ``merge`` above 1 so many strips are one, with one line: right on average, not in each.
    """
    count = x.shape[1]
    # Receiver i lives in [2 i, 2 i + 1]: one sorted list of strip ends for all of them.
    base = 2.0 * cut.owner
    low, high = base + cut.q.min(axis=0), base + cut.q.max(axis=0)
    side = np.flatnonzero(at <= 1)
    turns = 2.0 * np.concatenate((cut.owner, cut.owner))[side] + at[side]
    each = 2.0 * np.arange(count)
    strip, height, single = _strips(np.concatenate((each, each + 1, *(each + rim.q), low, high, turns)), merge)
    middle = strip + height / 2
    who = (middle / 2).astype(np.int64)
    begin, stop = np.searchsorted(middle, low), np.searchsorted(middle, high)
    rises = cut.q[1] > cut.q[0]
    # Layers left of the light, and how many rise to their right: where there cannot be two, nothing overlaps.
    turn = np.searchsorted(middle, turns)
    within = np.flatnonzero(take(np.append(who, count), turn) == (turns / 2).astype(np.int64))  # else above all lines
    left: Ints = start[who] + _running(turn[within], jump[side][within], np.searchsorted(middle, each), who)
    up = np.bincount(begin[rises], minlength=strip.size + 1) - np.bincount(stop[rises], minlength=strip.size + 1)
    good = np.flatnonzero(left + np.cumsum(up)[: strip.size] > 1)
    if good.size == 0:
        return np.zeros(count)
    # One line through a thin strip, where f is straight enough; two through each part of a thick one.
    straight = (height[good] <= THICK / detail) | ~single[good]
    parts = np.where(~straight, np.ceil(height[good] * detail / PART), 0).astype(np.int64)
    lines = np.maximum(2 * parts, 1)
    number = np.concatenate(([0], np.cumsum(np.bincount(good, lines, minlength=strip.size).astype(np.int64))))
    which, nth = expand(lines)
    strip, height, who, left = strip[good][which], height[good][which], who[good][which], left[good][which]
    parts, lines = parts[which], lines[which]
    gauss = (nth // 2 + 0.5 + (nth % 2 - 0.5) / math.sqrt(3)) / np.maximum(parts, 1)
    q, weight = strip + np.where(parts > 0, gauss, 0.5) * height - 2.0 * who, height / lines
    piece, offset = expand(number[stop] - number[begin])
    line = take(number[begin], piece) + offset
    slope = np.divide(cut.p[1] - cut.p[0], cut.q[1] - cut.q[0], out=np.zeros(low.size), where=high > low)
    p = take(cut.p[0] - slope * cut.q[0], piece) + take(slope, piece) * take(q, line)
    line, p, right, step = _crossings(line, p, take(np.where(rises, 1, -1), piece), left)
    change: Ints = np.maximum(right - 1, 0) - np.maximum(right - step - 1, 0)
    k, more = np.flatnonzero(change), np.flatnonzero(left > 1)
    line = np.concatenate((line[k], more))
    change = np.concatenate((change[k], left[more] - 1))
    i = take(who, line)
    clear = above_horizon(x, n, frame)
    x, n, q = take(x, i), take(n, i), take(q, line)
    low, high = (np.zeros(i.size), np.ones(i.size)) if clear else _span(x, n, frame, q)
    p = np.clip(np.concatenate((p[k], np.zeros(more.size))), low, high)
    term = line_term(x, n, frame, p, q, high)
    return np.asarray(np.bincount(i, term * change * take(weight, line), minlength=count))


def _strips(ends: Floats, merge: int) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Starts and heights of the strips between sorted ends, those between receivers left out; which are of one."""
    ends = np.sort(ends)
    number = np.arange(ends.size)
    if merge > 1:
        thick = np.diff(ends) > THICK
        kept = (number % merge == 0) | (ends % 1 == 0) | np.append(thick, False) | np.append(False, thick)
        number = np.flatnonzero(kept)
        ends = ends[number]
    height = np.diff(ends)
    k = np.flatnonzero((height > 0) & (ends[:-1] % 2 < 1))
    return ends[k], height[k], np.diff(number)[k] == 1


def _running(at: Ints, jump: Ints, first: Ints, who: Ints) -> Ints:
    """Sum of the jumps at or before each strip, from its receiver's ``first`` strip on; ``who`` (strips,)."""
    total = np.cumsum(np.bincount(at, jump, minlength=who.size + 1))
    before = np.where(first > 0, total[np.maximum(first, 1) - 1], 0.0)
    return np.rint(total[: who.size] - before[who]).astype(np.int64)


def _crossings(line: Ints, p: Floats, sign: Ints, left: Ints) -> tuple[Ints, Floats, Ints, Ints]:
    """Crossings in order along each line: line, p, layers to the right, and how many more than to the left.

    Line, p (to 2^-30 of the light) and sign in one integer: sorting those is many times faster.
    """
    key = (line << 32) | ((np.clip(p, 0, 1) * (1 << 30)).astype(np.int64) << 1) | (sign > 0)
    key.sort()
    line, step = key >> 32, 2 * (key & 1) - 1
    total = np.cumsum(step)
    opening = np.flatnonzero(np.diff(line, prepend=-1))
    before = (total - step)[opening] - left[line[opening]]
    right = total - np.repeat(before, np.diff(np.append(opening, line.size)))
    return line, ((key >> 1) & 0x7FFFFFFF) * 2.0**-30, right, step
