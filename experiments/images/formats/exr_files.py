"""EXR files as OpenEXR opens them: in silence, and bounded by their headers before a pixel is decoded."""

from __future__ import annotations

import ctypes
import io
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, redirect_stdout, suppress
from pathlib import Path
from typing import Any

from nusselt.renderer.errors import InputError

from .raw import Wanted, check_size, refuse

MAGIC = b"v/1\x01"
"""First bytes of every file."""
CHANNELS = 128
"""Most channels a file may have: each is decoded."""
OVERSCAN = 4
"""Pixels of a data window over those of the display window, at most; a few thousand are free."""
TILE = 1 << 24
"""Values of all channels that a tile may have, at least: 2048 x 2048 pixels of four."""
QUOTED = ("colorInteropID", "whiteLuminance", "adoptedNeutral", "envmap")
"""Attributes that are quoted."""
Header = Mapping[str, Any]
Parts = list[tuple[str, list[str]]]
"""Every part's name, and its channels'."""


@contextmanager
def quiet() -> Iterator[None]:
    """OpenEXR prints what should be an error, in Python, in C and on both streams: to nowhere while it decodes."""
    flush = ctypes.CDLL(None).fflush  # what C prints waits where it goes to a file
    if sys.stderr is not None:
        sys.stderr.flush()
    flush(None)
    nothing = os.open(os.devnull, os.O_WRONLY)
    kept: dict[int, int] = {}
    for stream in (1, 2):
        with suppress(OSError):  # it is closed
            kept[stream] = os.dup(stream)
    try:
        for stream in kept:
            os.dup2(nothing, stream)
        with redirect_stdout(io.StringIO()):
            yield
    finally:
        flush(None)
        for stream, copy in kept.items():
            os.dup2(copy, stream)
            os.close(copy)
        os.close(nothing)


@contextmanager
def opened(path: Path, **how: bool) -> Iterator[Any]:
    """A file as OpenEXR reads it; what it raises, or should, is an `InputError`."""
    import OpenEXR

    with path.open("rb") as stream:
        first = stream.read(len(MAGIC))
    if first != MAGIC:
        raise refuse(path, f"a file that begins with {first!r}" if first else "empty", "a whole OpenEXR file")
    try:
        with quiet(), OpenEXR.File(str(path), **how) as file:
            yield file
    except InputError:
        raise
    except Exception as error:  # whatever a foreign parser raises
        told = " ".join(str(error).split())[:80]
        raise refuse(path, f"damaged EXR ({told})", "a whole OpenEXR file") from error


def headers_of(path: Path, wanted: Wanted) -> tuple[list[Header], Parts]:
    """Every part's header, and its name with its channels'; refused before a pixel is read if they ask too much."""
    with opened(path, header_only=True) as file:
        headers = [_typed(dict(file.header(number))) for number in range(len(file.parts))]
        parts = [(str(h.get("name", "")), [str(c.name) for c in h["channels"]]) for h in headers]
        windows = [window(header, "dataWindow") for header in headers]
        shown = [window(header, "displayWindow") for header in headers]
        tiles = [h["tiles"].xSize * h["tiles"].ySize * len(h["channels"]) for h in headers if "tiles" in h]
    if any("deep" in str(header.get("type")) for header in headers):
        raise refuse(path, "deep pixels", "one colour a pixel")
    for _, size in shown:
        data = f", of which {windows[0][1][0]} x {windows[0][1][1]} are there" if windows[0] != shown[0] else ""
        check_size(path, size, wanted.size, data)
    if (count := sum(len(names) for _, names in parts)) > CHANNELS:
        raise refuse(path, f"{count} channels", f"at most {CHANNELS}")
    pixels, limit = max(w * h for _, (w, h) in windows), OVERSCAN * (wanted.width * wanted.height + 1024)
    if pixels > limit:
        raise refuse(path, f"a data window of {pixels} pixels", f"at most {limit}")
    if max(tiles, default=0) > (most := max(TILE, limit * CHANNELS)):  # one is decoded whole, however little is in it
        raise refuse(path, f"tiles of {max(tiles)} values", f"at most {most}")
    return headers, parts


def _typed(header: dict[str, Any]) -> Header:
    """A header whose numbers are numbers, and whose text is text: an attribute may be stored as any type."""
    header["pixelAspectRatio"] = float(header.get("pixelAspectRatio", 1.0))
    if "chromaticities" in header:
        header["chromaticities"] = tuple(float(value) for value in header["chromaticities"])
    header["sampling"] = {str(c.name): (int(c.xSampling), int(c.ySampling)) for c in header["channels"]}
    return header | {name: " ".join(str(header[name]).split())[:60] for name in QUOTED if name in header}


def window(header: Header, name: str) -> tuple[tuple[int, int], tuple[int, int]]:
    """The first column and row of a window, and its width and height."""
    (left, top), (right, bottom) = ([int(v) for v in corner] for corner in header[name])
    if right < left or bottom < top:
        raise ValueError(f"an empty {name}")
    return (left, top), (right - left + 1, bottom - top + 1)
