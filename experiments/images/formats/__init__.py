"""Image files from anywhere, read with bounded memory: a header is believed only where it says the scene's size.

To add a format: its file here, and its place in the tuple. EXR is OpenEXR's own package, PNG Pillow's, the others are
read here. OpenImageIO is not behind them: 3.2 turns PFM upside down, ignores EXPOSURE and chromaticities, refuses old
run lengths and chroma of half the size, and takes the first of several parts without a word (see `findings`).
"""

from __future__ import annotations

from .exr import EXR
from .hdr import HDR
from .npy import NPY
from .pfm import PFM
from .png import PNG
from .raw import Format, Raw, Wanted

FORMATS: tuple[Format, ...] = (PNG, EXR, PFM, HDR, NPY)

__all__ = ["FORMATS", "Format", "Raw", "Wanted"]
"""Raw: what a file holds, before any transfer curve is undone."""
