"""Rows of RGBE: in runs by component, or pixel by pixel with runs of the older kind, each as its beginning says."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
LONGEST = 1 << 15
"""Rows of 8 pixels up to one less than this can be in runs by component."""


class Damaged(ValueError):
    """Rows that cannot be read; the message is what is wrong."""


def rgbe_rows(data: bytes, width: int, height: int) -> tuple[Bytes, int]:
    """(height, width, 4), and how many bytes are left over.

    A row is in runs by component where it begins with 2 2 and its own width; else its pixels stand one by one, and
    1 1 1 n repeats the one before.

    Raises
    ------
    Damaged
    """
    out = np.empty((height, width, 4), dtype=np.uint8)
    mark = bytes((2, 2, width >> 8, width & 255)) if 8 <= width < LONGEST else None
    at = 0
    for row in out:
        if data[at : at + 4] == mark:
            at += 4
            for component in range(4):
                at = _runs(data, at, row[:, component])
        else:
            at = _pixels(data, at, row)
    return out, len(data) - at


def _pixels(data: bytes, at: int, out: Bytes) -> int:
    """Fill a row (w, 4) from pixels and old runs: successive runs count in units of 1, 256, 65536; where it ended."""
    width = len(out)
    quads = np.frombuffer(data[at : at + 4 * width], dtype=np.uint8)
    quads = quads[: len(quads) // 4 * 4].reshape(-1, 4)
    number = np.arange(len(quads))
    is_run = (quads[:, :3] == 1).all(axis=1)
    source = np.maximum.accumulate(np.where(is_run, -1, number))
    place = np.minimum(number - source - 1, 3)
    ends = np.cumsum(np.where(is_run, quads[:, 3].astype(np.int64) << (8 * np.maximum(place, 0)), 1))
    last = int(np.searchsorted(ends, width))
    if last == len(quads):
        raise Damaged("truncated")
    if ends[last] != width or source[0] < 0:
        raise Damaged("its runs")
    out[:] = quads[np.repeat(source[: last + 1], np.diff(ends[: last + 1], prepend=0))]
    return at + 4 * (last + 1)


def _runs(data: bytes, at: int, out: Bytes) -> int:
    """Fill one component of a row from runs (a count above 128, a byte) and literals; where it ended."""
    filled = 0
    while filled < out.size:
        if at + 1 >= len(data):
            raise Damaged("truncated")
        count = data[at]
        length, literal = (count - 128, False) if count > 128 else (count, True)
        piece = data[at + 1 : at + 1 + length] if literal else data[at + 1 : at + 2] * length
        if length == 0 or filled + length > out.size:
            raise Damaged("its runs")
        if len(piece) < length:
            raise Damaged("truncated")
        out[filled : filled + length] = np.frombuffer(piece, dtype=np.uint8)
        filled += length
        at += 1 + (length if literal else 1)
    return at
