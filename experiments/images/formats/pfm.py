"""PFM, Debevec's portable float map."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from .raw import Format, Raw, Wanted, check_size, refuse, three_channels

HEADER = 4096
"""Bytes in which a PFM header must end."""
SPACE = rb"(?:\s|#[^\r\n]*[\r\n])+"
"""Between two words of the header: comments are no part of the format, and are written."""
WORDS = re.compile(
    rb"(P[Ff])" + SPACE + rb"(\d{1,9})" + SPACE + rb"(\d{1,9})" + SPACE + rb"([-+]?[.\deE][-+.\deE]{0,40})(?=\s)"
)


def read_pfm(path: Path, wanted: Wanted) -> Raw:
    """A PFM file, colour (PF) or grey (Pf); its rows run from the bottom up.

    The sign of its scale is the order of its bytes; its size multiplies the values, as pbrt and tev do.

    Raises
    ------
    InputError
    """
    data = path.read_bytes()
    head = WORDS.match(data[:HEADER])
    try:
        if head is None:
            raise ValueError
        kind, size, scale = head[1], (int(head[2]), int(head[3])), float(head[4])
    except ValueError as error:
        raise refuse(path, "damaged PFM (no header)", "PF or Pf, width, height and scale") from error
    if scale == 0 or not np.isfinite(scale):
        raise refuse(path, f"damaged PFM (scale {scale:g})", "a scale that is not 0")
    check_size(path, size, wanted.size)
    count = 4 * wanted.width * wanted.height * (3 if kind == b"PF" else 1)
    left = len(data) - head.end()
    # One white character ends the header, or CR and LF together: of a lone CR and a first byte that is LF, the length
    # of the file tells.
    if left != count + (2 if left == count + 2 and data[head.end() :][:2] == b"\r\n" else 1):
        told = f"{'truncated' if left <= count else 'damaged'} PFM ({max(left - 1, 0)} bytes after its header)"
        raise refuse(path, told, f"{count} bytes of pixels")
    values = np.frombuffer(data[-count:], dtype="<f4" if scale < 0 else ">f4").astype(np.float64)
    raw = three_channels(path, abs(scale) * values.reshape(wanted.height, wanted.width, -1)[::-1])
    if abs(scale) == 1:
        return raw
    return replace(raw, notes=(*raw.notes, f"its values are multiplied by its scale, {abs(scale):g}"))


PFM = Format(".pfm", (b"PF", b"Pf"), read_pfm)
