"""NPY: arrays of NumPy's own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from nusselt.renderer.vectors import Floats

from .raw import FLOAT, HALF, Format, Raw, Wanted, other_size, refuse, three_channels


def read_npy(path: Path, wanted: Wanted) -> Raw:
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
    return raw_of_array(path, values, wanted)


def raw_of_array(path: Path, values: np.ndarray[Any, Any], wanted: Wanted) -> Raw:
    """An array (h, w, 3), (3, h, w) or (h, w), from a file or from anywhere that ``path`` names.

    Raises
    ------
    InputError
    """
    if values.dtype.kind != "f" and values.dtype.str[1:] not in ("u1", "u2"):
        raise refuse(path, f"numbers of type {values.dtype}", "floating point, uint8 or uint16")
    width, height = wanted.size
    turned = values.ndim == 3 and values.shape == (3, height, width) and values.shape[2] not in (3, 4)
    if turned:
        values = values.transpose(1, 2, 0)
    if values.ndim not in (2, 3) or values.shape[:2] != (height, width):
        first = values.ndim == 3 and values.shape[0] == 3 and values.shape[2] not in (3, 4)
        size = (values.shape[1:] if first else values.shape[:2])[::-1]
        found, accepted = f"an array of shape {values.shape}", f"shape ({height}, {width}, 3): the scene's size"
        raise other_size(path, size, found, accepted) if values.ndim in (2, 3) else refuse(path, found, accepted)
    kind = np.float64 if values.dtype.kind == "f" else values.dtype.newbyteorder("=")
    rounding = HALF if values.dtype.kind == "f" and values.dtype.itemsize == 2 else FLOAT
    raw = replace(three_channels(path, np.array(values, dtype=kind)), rounding=rounding)
    return replace(raw, notes=("it is taken for (3, h, w): channels first", *raw.notes)) if turned else raw


def write_npy(path: Path, radiance: Floats) -> None:
    """Radiance (c, h, w) as float64 (h, w, c)."""
    with path.open("wb") as stream:
        np.save(stream, np.ascontiguousarray(radiance.transpose(1, 2, 0)), allow_pickle=False)


NPY = Format(".npy", (b"\x93NUMPY",), read_npy, write_npy)
