"""Radiance as plain numbers: PFM (Debevec's portable float map) and NPY."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import numpy as np

from .raw import Raw, check_size, refuse, three_channels

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


def read_npy(path: Path, width: int, height: int) -> Raw:
    """An array (h, w, 3), (3, h, w) or (h, w): floating point is radiance, uint8 and uint16 are levels.

    Raises
    ------
    InputError
    """
    try:
        values = np.load(path, allow_pickle=False, mmap_mode="r")
        if not isinstance(values, np.ndarray):
            raise ValueError("an archive of several arrays")
    except Exception as error:  # whatever numpy's parser of Python text raises
        told = " ".join(str(error).split())[:60]
        raise refuse(path, f"damaged NPY ({told})", "one array, without pickled objects") from error
    return raw_of_array(path, values, width, height)


def raw_of_array(path: Path, values: np.ndarray[Any, Any], width: int, height: int) -> Raw:
    """An array (h, w, 3), (3, h, w) or (h, w), from a file or from anywhere that ``path`` names.

    Raises
    ------
    InputError
    """
    if values.dtype.kind != "f" and values.dtype.str[1:] not in ("u1", "u2"):
        raise refuse(path, f"numbers of type {values.dtype}", "floating point, uint8 or uint16")
    if values.ndim == 3 and values.shape == (3, height, width) and values.shape[2] not in (3, 4):
        values = values.transpose(1, 2, 0)
    if values.ndim not in (2, 3) or values.shape[:2] != (height, width):
        raise refuse(path, f"an array of shape {values.shape}", f"shape ({height}, {width}, 3): the scene's size")
    kind = np.float64 if values.dtype.kind == "f" else values.dtype.newbyteorder("=")
    return three_channels(path, np.array(values, dtype=kind))
