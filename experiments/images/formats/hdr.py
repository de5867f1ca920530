"""Radiance HDR (RGBE): Ward's shared exponents, with or without run lengths."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .raw import Format, Raw, Rounding, check_size, refuse

Bytes = NDArray[np.uint8]
HEADER = 1 << 16
"""Bytes in which the header must end."""
RGBE = Rounding(2.0**-7, one_exponent=True)
"""One step of the smallest mantissa that the largest channel can have, 128."""


def read_hdr(path: Path, width: int, height: int) -> Raw:
    """An HDR file in the usual order (-Y h +X w).

    Raises
    ------
    InputError
    """
    data = path.read_bytes()
    first, _, rest = data.partition(b"\n")
    head, _, body = rest[:HEADER].partition(b"\n\n")
    size_line, _, _ = body.partition(b"\n")
    words = size_line.split()
    if first[:2] != b"#?" or len(words) != 4 or (words[0], words[2]) != (b"-Y", b"+X"):
        raise refuse(path, "damaged HDR (no header, or an order other than -Y h +X w)", "a Radiance picture")
    if b"32-bit_rle_xyze" in head:
        raise refuse(path, "an HDR file of XYZ", "FORMAT=32-bit_rle_rgbe")
    if not (words[1].isdigit() and words[3].isdigit() and len(words[1]) < 9 and len(words[3]) < 9):
        raise refuse(path, "damaged HDR (its size)", "a Radiance picture")
    check_size(path, (int(words[3]), int(words[1])), (width, height))
    start = len(first) + 1 + len(head) + 2 + len(size_line) + 1
    rgbe = _pixels(path, data[start:], width, height)
    scale = np.where(rgbe[..., 3] > 0, np.ldexp(1.0, rgbe[..., 3].astype(np.int64) - 136), 0.0)
    return Raw(np.ascontiguousarray(((rgbe[..., :3] + 0.5) * scale[..., None]).transpose(2, 0, 1)), rounding=RGBE)


def _pixels(path: Path, data: bytes, width: int, height: int) -> Bytes:
    """(h, w, 4): each row in runs, or, where it does not begin with 2 2, the whole file flat."""
    if not (8 <= width < 32768 and data[:2] == b"\2\2"):
        if len(data) < 4 * width * height:
            raise refuse(path, "truncated HDR", f"{4 * width * height} bytes of pixels")
        return np.frombuffer(data, dtype=np.uint8, count=4 * width * height).reshape(height, width, 4)
    out, at = np.empty((height, 4, width), dtype=np.uint8), 0
    for row in out:
        if data[at : at + 4] != bytes((2, 2, width >> 8, width & 255)):
            raise refuse(path, "damaged HDR (a row does not begin)", "a Radiance picture")
        at += 4
        for component in row:
            at = _runs(path, data, at, component)
    return out.transpose(0, 2, 1)


def _runs(path: Path, data: bytes, at: int, out: Bytes) -> int:
    """Fill one component of a row from runs (a count above 128, a byte) and literals; where it ended."""
    filled = 0
    while filled < out.size:
        if at + 1 >= len(data):
            raise refuse(path, "truncated HDR", "a Radiance picture")
        count = data[at]
        length, literal = (count - 128, False) if count > 128 else (count, True)
        piece = data[at + 1 : at + 1 + length] if literal else data[at + 1 : at + 2] * length
        if length == 0 or len(piece) < length or filled + length > out.size:
            raise refuse(path, "damaged HDR (its runs)", "a Radiance picture")
        out[filled : filled + length] = np.frombuffer(piece, dtype=np.uint8)
        filled += length
        at += 1 + (length if literal else 1)
    return at


HDR = Format(".hdr", read_hdr)
