"""Which folds are seen, and where: one ray for each stretch of one between the places where other lines meet it.

See `folds`: what is seen of one changes only where it meets a line that is none.
"""

from __future__ import annotations

import numpy as np

from nusselt.renderer.geometry.ragged import any_within
from nusselt.renderer.vectors import Bools, Floats, Ints

from .candidate_edges import SIDE, Lines
from .edge_fragments import SAME, SHORT, Bits, cut_at_grid, in_image, meetings, pairs_within, split
from .folds import Folds
from .moments import Edges, upwards
from .regions import Regions

CLOSE = 1e-6
"""Pixels; what is closer to a bit's end may meet it there."""


def visible_folds(folds: Folds, breaks: Bits, crowded: Ints, regions: Regions) -> tuple[Edges, Bits]:
    """The visible bits of folds, and all bits of those that run along another line, of which two rays must tell.

    Parameters
    ----------
    breaks : Bits
        Of all lines that are no folds, sorted by cell.
    crowded : (n,) int64
        Cells some of whose lines are not among those.
    """
    width, height = regions.lens.width, regions.lens.height
    folds = folds.take(np.flatnonzero(~folds.hidden))
    lines, which = _in_image(folds, regions)
    face = folds.face[:, which]
    meet = _may_meet(lines, np.append(breaks.cell, crowded), width, height)
    alone, some = np.flatnonzero(~meet), np.flatnonzero(meet)
    bits, line = cut_at_grid(lines.take(some), width, height)
    clear = np.flatnonzero(~np.isin(bits.cell, crowded))
    bits, line = bits.take(clear), some[line[clear]]
    i, j = pairs_within(bits.cell, breaks.cell)
    doubled = np.isin(line, line[i[_along(bits, breaks, i, j)]])
    along = bits.take(np.flatnonzero(doubled))
    parts, who, run = _runs(bits, line, breaks, i, j)
    place = _middles(parts, run)
    x, y = np.hstack((place, (lines.start[:, alone] + lines.end[:, alone]) / 2))
    seen = regions.seen(x, y)
    of = np.append(line[who[np.flatnonzero(np.diff(run, prepend=-1))]], alone)
    shown = (seen == face[0, of]) | (seen == face[1, of])
    near = np.flatnonzero(shown[run] & ~doubled[who])
    alone = alone[shown[place.shape[1] :]]
    free, owner = cut_at_grid(lines.take(alone), width, height)
    left, right = face[:, np.append(line[who[near]], alone[owner])]
    return upwards(Bits.joined(parts.take(near), free), left, right), along


def away_from(folds: Folds, cells: Ints, regions: Regions) -> Folds:
    """The folds whose boxes in the image hold none of the cells (n,)."""
    lines, which = _in_image(folds, regions)
    held = np.zeros(folds.edge.size, dtype=bool)
    held[which] = _may_meet(lines, cells, regions.lens.width, regions.lens.height)
    return folds.take(np.flatnonzero(~held))


def _in_image(folds: Folds, regions: Regions) -> tuple[Bits, Ints]:
    """What of folds lies in the image, and which they are."""
    lens, faces = regions.lens, regions.faces
    start, end, kept = lens.project(faces.start[:, folds.edge], faces.end[:, folds.edge])
    lines, which = in_image(Lines(start, end, np.full(kept.size, SIDE)), lens.width, lens.height)
    return lines, kept[which]


def _may_meet(lines: Bits, cells: Ints, width: int, height: int) -> Bools:
    """Which lines' boxes hold, or touch, one of the cells."""
    count = np.bincount(cells, minlength=width * height).reshape(height, width)
    low, high = np.minimum(lines.start, lines.end) - CLOSE, np.maximum(lines.start, lines.end) + CLOSE
    most = np.array([[width], [height]])
    x0, y0 = np.clip(np.floor(low), 0, most).astype(np.int64)
    x1, y1 = np.clip(np.floor(high) + 1, 0, most).astype(np.int64)
    return any_within(count, x0, x1, y0, y1)


def _along(bits: Bits, others: Bits, i: Ints, j: Ints) -> Bools:
    """Which pairs of a bit and another run along each other, over some stretch."""
    p, d = bits.start[:, i], (bits.end - bits.start)[:, i]
    q, e = others.start[:, j], (others.end - others.start)[:, j]
    found = np.zeros(i.size, dtype=bool)
    for a, b, c, f in ((p, d, q, e), (q, e, p, d)):
        size = np.sqrt((b * b).sum(axis=0))
        ends = [end - a for end in (c, c + f)]
        beside = [np.abs(b[0] * end[1] - b[1] * end[0]) < SAME * size for end in ends]
        first, last = ((end * b).sum(axis=0) / size for end in ends)
        over = np.minimum(np.maximum(first, last), size) - np.maximum(np.minimum(first, last), 0)
        found |= beside[0] & beside[1] & (over > SHORT)
    return found


def _runs(bits: Bits, line: Ints, breaks: Bits, i: Ints, j: Ints) -> tuple[Bits, Ints, Ints]:
    """Bits, in order along their lines, cut where one of the others meets them, in pairs (i, j).

    Returns the parts, whose they are, and the run of each: of parts that follow each other, nothing met between.
    """
    size = np.sqrt(((bits.end - bits.start) ** 2).sum(axis=0))
    pair, t = meetings(bits, breaks, i, j, CLOSE / size[i])
    i = i[pair]
    first, last = t * size[i] < CLOSE, (1 - t) * size[i] < CLOSE
    met = np.zeros((2, size.size), dtype=bool)
    met[0, i[first]] = met[1, i[last]] = True
    inner = np.flatnonzero(~first & ~last)
    parts, who = split(bits, i[inner], t[inner])
    before, after = who[:-1], who[1:]
    gap = np.abs(parts.start[:, 1:] - parts.end[:, :-1]).max(axis=0, initial=0)
    joined = (line[before] == line[after]) & (before != after) & ~met[1, before] & ~met[0, after] & (gap < CLOSE)
    begins = np.ones(who.size, dtype=bool)
    begins[1:] = ~joined
    return parts, who, np.cumsum(begins) - 1


def _middles(parts: Bits, run: Ints) -> Floats:
    """The middle (2, r) of the longest part of each run."""
    size = np.abs(parts.end - parts.start).max(axis=0)
    order = np.lexsort((size, run))
    longest = order[np.flatnonzero(np.diff(run[order], append=-1))]
    return np.asarray((parts.start[:, longest] + parts.end[:, longest]) / 2)
