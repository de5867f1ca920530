"""PNG with 8 or 16 bits."""

from __future__ import annotations

import struct
import warnings
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import PIL.Image
from numpy.typing import NDArray

from nusselt.renderer.errors import InputError
from nusselt.renderer.vectors import Floats

from .raw import Format, Raw, check_size, refuse, three_channels

PLAIN = {"1": "L", "L": "L", "P": "RGB", "RGB": "RGB", "LA": "LA", "RGBA": "RGBA", "PA": "RGBA"}
"""Pillow's mode for eight bits, and what it is read as."""
WIDE = {"RGB;16B": ("RGB", "RGB;16L"), "RGBA;16B": ("RGBA", "RGBA;16L"), "LA;16B": ("LA", None)}
"""Sixteen bits, of which Pillow keeps the high byte. Told that the bytes are the other way round, it keeps the low."""


def read_png(path: Path, width: int, height: int) -> Raw:
    """A PNG file of this size; the size is looked at before a pixel is.

    Raises
    ------
    InputError
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return three_channels(path, _decode(path, (width, height)))
    except InputError:
        raise
    except PIL.Image.DecompressionBombError as error:
        raise refuse(path, "far more pixels than an image has", f"the scene's {width} x {height}") from error
    except (OSError, SyntaxError, ValueError, zlib.error, OverflowError, EOFError, struct.error) as error:
        told = str(error).splitlines()[0] if str(error) else "truncated"
        raise refuse(path, f"damaged PNG ({told})", "a whole PNG file") from error


def _decode(path: Path, wanted: tuple[int, int]) -> NDArray[Any]:
    with PIL.Image.open(path, formats=["PNG"]) as image:
        check_size(path, image.size, wanted)
        kind = str(image.tile[0].args) if image.tile else image.mode
        if kind in WIDE:
            image.load()
            high = np.asarray(image, dtype=np.uint16)
            return high << 8 | _low_bytes(path, kind)
        if image.mode.startswith("I"):
            return np.asarray(image).astype(np.uint16)
        if image.mode not in PLAIN:
            raise refuse(path, f"a PNG of mode {image.mode}", "grey or RGB in 8 or 16 bits")
        return np.asarray(image.convert(PLAIN[image.mode]))


def _low_bytes(path: Path, kind: str) -> NDArray[Any]:
    swapped = WIDE[kind][1]
    if swapped is None:
        raise refuse(path, "16-bit grey with alpha", "grey or RGB in 8 or 16 bits, or RGB with alpha")
    with PIL.Image.open(path, formats=["PNG"]) as image:
        image.tile = [entry._replace(args=swapped) for entry in image.tile]
        return np.asarray(image, dtype=np.uint16)


def to_levels(radiance: Floats) -> NDArray[np.uint8]:
    """The course's eight bits: clamp to [0, 1], times 255, truncate; no gamma. NaN is black."""
    return (255 * np.clip(np.nan_to_num(radiance, nan=0.0, posinf=1.0, neginf=0.0), 0, 1)).astype(np.uint8)


def write_png(path: Path, radiance: Floats) -> None:
    """The course's eight bits of radiance (3, h, w)."""
    PIL.Image.fromarray(to_levels(radiance).transpose(1, 2, 0)).save(path)


PNG = Format(".png", read_png, write_png)
