"""What a format is, what every reader gives, and the one error it raises."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.errors import InputError
from nusselt.renderer.vectors import Floats

SPARE = 1 << 24
"""Bytes a file may hold besides those of its pixels: comments, profiles, thumbnails."""


@dataclass(frozen=True)
class Rounding:
    """By how much a format may move a value.

    Parameters
    ----------
    relative : float
        Of the value; of the pixel's largest channel where its channels have one exponent.
    one_exponent : bool
    lossy : str
        Name of a compression that also mixes a value with those around it; empty: there is none.
    """

    relative: float
    one_exponent: bool = False
    lossy: str = ""

    def limit(self, values: Floats) -> Floats:
        """Largest error of values (3, ...), absolute."""
        size = np.abs(values)
        return np.asarray(self.relative * (size.max(axis=0, keepdims=True) if self.one_exponent else size))


FLOAT = Rounding(2e-6)
"""Of float32, and of what a renderer rounds in it."""
HALF = Rounding(2.0**-10)
"""Cut off or rounded to 11 bits."""


@dataclass(frozen=True)
class Wanted:
    """What is asked of a file.

    Parameters
    ----------
    width, height : int
        The scene's, in pixels.
    layer : str
        Its name, where a file has several; empty: the one that is the image.
    """

    width: int
    height: int
    layer: str = ""

    @property
    def size(self) -> tuple[int, int]:
        return self.width, self.height


@dataclass(frozen=True)
class Raw:
    """The numbers of an image file.

    Parameters
    ----------
    values : (3, h, w)
        uint8, uint16, or float64 for what is radiance already.
    notes : tuple of str
        What was left out of the file.
    rounding : Rounding
        Of radiance.
    encoding : str
        What the file says of its levels' curve, where it says another than the linear one.
    """

    values: NDArray[Any]
    notes: tuple[str, ...] = ()
    rounding: Rounding = FLOAT
    encoding: str = ""

    @property
    def levels(self) -> int:
        """Highest level of a whole-number format; 0 for radiance."""
        return 0 if self.values.dtype.kind == "f" else int(np.iinfo(self.values.dtype).max)


@dataclass(frozen=True)
class Format:
    """A kind of image file.

    Parameters
    ----------
    suffix : str
        What its names end in.
    magic : tuple of bytes
        What its files begin with, one of them.
    read : callable
        From a path and what is wanted of it.
    write : callable, optional
        To a path, radiance (3, h, w); also (1, h, w) where the format has one channel. None: it is only read.
    write_wide : callable, optional
        The same in 16 bits, where ``write`` writes 8.
    has_layers : bool
        Whether one of them can be named, as FILE:LAYER.
    pixel : int
        Bytes that a pixel may take in a file.
    """

    suffix: str
    magic: tuple[bytes, ...]
    read: Callable[[Path, Wanted], Raw]
    write: Callable[[Path, Floats], None] | None = None
    write_wide: Callable[[Path, Floats], None] | None = None
    has_layers: bool = False
    pixel: int = 64


def refuse(path: Path, found: object, accepted: str) -> InputError:
    """The error for a file that is not an image of the scene."""
    return InputError("image", found, accepted, str(path))


class OtherSize(InputError):
    """An image of another size than the scene's: its ``size`` (width, height)."""

    size: tuple[int, int]


def other_size(path: Path, size: tuple[int, int], found: str, accepted: str) -> OtherSize:
    """The error for it, in a format's own words."""
    error = OtherSize("image", found, accepted, str(path))
    error.size = size
    return error


def check_size(path: Path, size: tuple[int, int], wanted: tuple[int, int], more: str = "") -> None:
    """Refuse an image of another size (width, height)."""
    if size != wanted:
        scenes = f"the scene's {wanted[0]} x {wanted[1]}"
        raise other_size(path, size, f"{size[0]} x {size[1]} pixels{more}", scenes)


def check_bytes(path: Path, wanted: tuple[int, int], pixel: int) -> None:
    """Refuse what is no plain file, or far larger than an image of that size can be."""
    try:
        there, plain = path.exists(), path.is_file()
        size = os.path.getsize(path) if plain else 0
    except (OSError, ValueError) as error:
        raise refuse(path, str(error), "an image file") from error
    if not plain:
        raise refuse(path, "not a plain file" if there else "no such file", "an image file")
    limit = SPARE + pixel * wanted[0] * wanted[1]
    if size > limit:
        raise refuse(path, f"{size} bytes", f"at most {limit} for an image of {wanted[0]} x {wanted[1]}")


def three_channels(path: Path, values: NDArray[Any]) -> Raw:
    """(h, w), (h, w, 1), (h, w, 3) or (h, w, 4) as (3, h, w): grey is repeated, alpha left out."""
    if values.ndim == 2:
        values = values[..., None]
    channels = values.shape[2]
    if channels not in (1, 2, 3, 4):
        raise refuse(path, f"{channels} channels", "one (grey) or three (red, green, blue), with or without alpha")
    notes = ["its grey is taken for three equal channels"] if channels < 3 else []
    notes += ["its alpha is left out"] if channels in (2, 4) else []
    colours = np.repeat(values[..., :1], 3, axis=2) if channels < 3 else values[..., :3]
    return Raw(np.ascontiguousarray(colours.transpose(2, 0, 1)), tuple(notes))
