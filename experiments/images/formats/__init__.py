"""Image files from anywhere, read with bounded memory: a header is believed only where it says the scene's size."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from .exr import read_exr
from .floats import read_npy, read_pfm
from .png import read_png
from .raw import Raw
from .rgbe import read_hdr

READERS: dict[str, Callable[[Path, int, int], Raw]] = {
    ".png": read_png,
    ".exr": read_exr,
    ".pfm": read_pfm,
    ".hdr": read_hdr,
    ".npy": read_npy,
}
"""By the ending of a name; each takes the file and the width and height it must have."""

__all__ = ["READERS", "Raw"]
"""Raw: what a file holds, before any transfer curve is undone."""
