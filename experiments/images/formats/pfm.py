"""PFM, Debevec's portable float map."""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np

from .raw import Format, Raw, check_size, refuse, three_channels

HEADER = 200
"""Bytes in which a PFM header must end."""


def read_pfm(path: Path, width: int, height: int) -> Raw:
    """A PFM file, colour (PF) or grey (Pf); its rows run from the bottom up.

    Raises
    ------
    InputError
    """
    with path.open("rb") as stream:
        head = re.match(rb"(P[Ff])\s+(\d{1,9})\s+(\d{1,9})\s+([-+.\deE]+)\s", stream.read(HEADER))
        try:
            if head is None:
                raise ValueError
            kind, size, scale = head[1], (int(head[2]), int(head[3])), float(head[4])
        except ValueError as error:
            raise refuse(path, "damaged PFM (no header)", "PF or Pf, width, height and scale") from error
        if scale == 0 or not np.isfinite(scale):
            raise refuse(path, f"damaged PFM (scale {scale:g})", "a scale that is not 0")
        check_size(path, size, (width, height))
        count = width * height * (3 if kind == b"PF" else 1)
        if stream.seek(0, os.SEEK_END) < head.end() + 4 * count:
            raise refuse(path, "truncated PFM", f"{4 * count} bytes of pixels")
        stream.seek(head.end())
        values = np.frombuffer(stream.read(4 * count), dtype="<f4" if scale < 0 else ">f4")
    return three_channels(path, values.astype(np.float64).reshape(height, width, -1)[::-1])


PFM = Format(".pfm", read_pfm)
