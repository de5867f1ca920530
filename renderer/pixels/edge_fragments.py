"""Lines cut at pixel boundaries and at each other, pixel by pixel.

What crosses a pixel is found there and nowhere else: no global drawing, no error that travels along a row, and
a cost that grows with what is seen rather than with the square of the scene.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from nusselt.renderer.geometry.ragged import expand
from nusselt.renderer.vectors import Floats, Ints, alike

from .candidate_edges import Lines

SHORT = 1e-9
"""Pixels; what is shorter is dropped."""
SAME = 1e-7
"""Lines this close (pixels) over a common stretch are one."""
PARALLEL = 1e-12
"""Sine of the angle below which two lines are parallel."""
CROWD = 48
"""Lines in one pixel beyond which it is left to samples."""


@dataclass(frozen=True, eq=False)
class Bits:
    """Pieces of lines, each inside one cell of a grid.

    Parameters
    ----------
    start, end : (2, b) float64
        Grid units.
    cell : (b,) int64
        row * width + column.
    reach : (b,) float64
        See `Lines`.
    """

    start: Floats
    end: Floats
    cell: Ints
    reach: Floats

    def take(self, index: Ints) -> Bits:
        """The bits ``index`` (k,)."""
        return Bits(self.start[:, index], self.end[:, index], self.cell[index], self.reach[index])

    @classmethod
    def joined(cls, *parts: Bits) -> Bits:
        """One after the other."""
        names = [part.name for part in fields(cls)]
        return cls(*(np.concatenate([getattr(part, name) for part in parts], axis=-1) for name in names))


def one_by_one(owner: Ints, t: Floats) -> Ints:
    """The order of things (m,) by their owner and then by t in [0, 1], which it tells apart to 1e-9 and better."""
    return np.argsort(2.0 * owner + t)


def _inside(start: Floats, end: Floats, width: int, height: int) -> tuple[Floats, Floats]:
    """Parameters (s,) between which each segment lies inside the image (Liang & Barsky 1984)."""
    low, high = np.zeros(start.shape[1]), np.ones(start.shape[1])
    for axis, size in ((0, width), (1, height)):
        p, d = start[axis], end[axis] - start[axis]
        flat = d == 0
        step = np.where(flat, 1.0, d)
        t0, t1 = -p / step, (size - p) / step
        enter, leave = np.minimum(t0, t1), np.maximum(t0, t1)
        outside = flat & ((p < 0) | (p >= size))
        low = np.maximum(low, np.where(flat, np.where(outside, np.inf, -np.inf), enter))
        high = np.minimum(high, np.where(flat, np.inf, leave))
    return low, high


def _at(start: Floats, end: Floats, index: Ints, t: Floats) -> Floats:
    return start[:, index] + t * (end[:, index] - start[:, index])


def split(bits: Bits, owner: Ints, t: Floats) -> tuple[Bits, Ints]:
    """Cut bits at the parameters t (m,) of the bits ``owner`` (m,): the parts, along each bit, and whose they are."""
    count = bits.cell.size
    ends = np.arange(count)
    owners, ts = np.concatenate((owner, ends, ends)), np.concatenate((t, np.zeros(count), np.ones(count)))
    order = one_by_one(owners, ts)
    owners, ts = owners[order], ts[order]
    whole = np.flatnonzero(owners[1:] == owners[:-1])
    who, low, high = owners[whole], ts[whole], ts[whole + 1]
    length = np.abs(bits.end - bits.start).max(axis=0)
    long = (high - low) * length[who] > SHORT
    who, low, high = who[long], low[long], high[long]
    start, end = _at(bits.start, bits.end, who, low), _at(bits.start, bits.end, who, high)
    return Bits(start, end, bits.cell[who], bits.reach[who]), who


def cut_at_grid(bits: Bits, width: int, height: int) -> tuple[Bits, Ints]:
    """Cut bits at whole coordinates and name their cells, see `split`; what lies outside is dropped."""
    owners, ts = [], []
    for axis in (0, 1):
        p, d = bits.start[axis], bits.end[axis] - bits.start[axis]
        low, high = np.minimum(p, p + d), np.maximum(p, p + d)
        first, last = np.floor(low).astype(np.int64) + 1, np.ceil(high).astype(np.int64) - 1
        owner, rank = expand(np.maximum(last - first + 1, 0))
        owners.append(owner)
        ts.append(np.clip((first[owner] + rank - p[owner]) / d[owner], 0, 1))
    cut, who = split(bits, np.concatenate(owners), np.concatenate(ts))
    x, y = np.floor((cut.start + cut.end) / 2).astype(np.int64)
    within = np.flatnonzero((x >= 0) & (x < width) & (y >= 0) & (y < height))
    named = Bits(cut.start, cut.end, y * width + x, cut.reach)
    return named.take(within), who[within]


def in_image(lines: Lines, width: int, height: int) -> tuple[Bits, Ints]:
    """What of lines lies in the image, of no cell yet, and which they are."""
    low, high = _inside(lines.start, lines.end, width, height)
    seen = np.flatnonzero(high > low)
    start, end = (_at(lines.start, lines.end, seen, t[seen]) for t in (low, high))
    return Bits(start, end, np.zeros(seen.size, dtype=np.int64), lines.reach[seen]), seen


def bits_of(lines: Lines, width: int, height: int) -> Bits:
    """Lines cut at pixel boundaries."""
    return cut_at_grid(in_image(lines, width, height)[0], width, height)[0]


def thinned(bits: Bits) -> tuple[Bits, Ints]:
    """Bits in the order of their cells, without those of crowded ones; and these."""
    bits = bits.take(np.argsort(bits.cell, kind="stable"))
    cells, counts = np.unique(bits.cell, return_counts=True)
    crowded = cells[counts > CROWD]
    return bits.take(np.flatnonzero(~np.isin(bits.cell, crowded))) if crowded.size else bits, crowded


def pairs_within(cell: Ints, among: Ints) -> tuple[Ints, Ints]:
    """All pairs of one of the bits in ``cell`` (n,) and one of those in ``among`` (m,), in order, that share a cell."""
    first, last = (np.searchsorted(among, cell, side) for side in ("left", "right"))
    owner, rank = expand(last - first)
    return owner, first[owner] + rank


def meetings(bits: Bits, others: Bits, i: Ints, j: Ints, slack: Floats | float = 0.0) -> tuple[Ints, Floats]:
    """Which pairs of a bit ``i`` (m,) and another ``j`` (m,) meet, and where along the bit.

    Within the bit, or ``slack`` (m,) of its length beyond.
    """
    p, d = bits.start[:, i], (bits.end - bits.start)[:, i]
    q, e = others.start[:, j], (others.end - others.start)[:, j]
    w = q - p
    det = d[0] * e[1] - d[1] * e[0]
    length = np.sqrt((d * d).sum(axis=0))
    crossing = np.abs(det) > PARALLEL * length * np.sqrt((e * e).sum(axis=0))
    safe = np.where(crossing, det, 1.0)
    t, u = (w[0] * e[1] - w[1] * e[0]) / safe, (w[0] * d[1] - w[1] * d[0]) / safe
    meets = np.flatnonzero(crossing & (t > -slack) & (t < 1 + slack) & (u > -1e-9) & (u < 1 + 1e-9))
    pairs, ts = [meets], [t[meets]]
    for end in (w, w + e):  # ends of others that lie on the line
        along = (end * d).sum(axis=0) / (length * length)
        beside = np.abs(d[0] * end[1] - d[1] * end[0]) < SAME * length
        on = np.flatnonzero(beside & (along > -slack) & (along < 1 + slack))
        pairs.append(on)
        ts.append(along[on])
    return np.concatenate(pairs), np.concatenate(ts)


def cut_at_crossings(bits: Bits, others: Bits) -> Bits:
    """Cut the bits of each cell at each other, and at others, and drop repeats; all are sorted by cell."""
    i, j = pairs_within(bits.cell, bits.cell)
    other = i != j
    i, j = i[other], j[other]
    pair, t = meetings(bits, bits, i, j)
    owners, ts = [i[pair]], [t]
    if others.cell.size:
        i, j = pairs_within(bits.cell, others.cell)
        pair, t = meetings(bits, others, i, j)
        owners.append(i[pair])
        ts.append(t)
    return _once(split(bits, np.concatenate(owners), np.concatenate(ts))[0])


def _once(bits: Bits) -> Bits:
    """Without repeats: bits of one cell whose middles and ends agree."""
    middle = (bits.start + bits.end) / 2
    tilt = np.abs(bits.end - bits.start)
    keys = np.vstack((bits.cell, np.floor(np.vstack((middle, tilt)) / (4 * SAME) + 0.3137)))
    return bits.take(np.sort(alike(keys)[0]))
