"""OpenEXR: of its parts and layers the one that is the image, within its display window, as Rec. 709's R, G, B."""

from __future__ import annotations

import errno
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.vectors import Floats

from . import primaries
from .chroma import from_luminance
from .exr_files import CHANNELS, MAGIC, QUOTED, Header, headers_of, opened, quiet, window
from .layers import CHROMA, GREY, XYZ, Layer, chosen, layers_of, left_out
from .raw import FLOAT, HALF, Format, Raw, Rounding, Wanted, refuse

LEAST_GREEN = 0.01
"""Share of green in luminance, below which it cannot be told from luminance and chroma."""
PXR24 = Rounding(2.0**-15)
"""Float32 cut off or rounded to 24 bits, 16 of them mantissa."""
LOSSLESS = ("NO", "RLE", "ZIPS", "ZIP", "PIZ", "PXR24", "HTJ2K32", "HTJ2K256", "ZSTD")
"""Compressions that keep what they are given (PXR24 but for 8 bits of 32): all others are taken to be lossy."""
LOSSY = 2.0**-8
"""Relative error of lossy compression where nothing varies; 4e-4 was measured for DWAA and B44."""


def read_exr(path: Path, wanted: Wanted) -> Raw:
    """The image that an EXR file holds.

    Raises
    ------
    InputError
    """
    headers, parts = headers_of(path, wanted)
    layers = layers_of(parts)
    layer = chosen(path, layers, [name for _, names in parts for name in names], wanted.layer)
    header = headers[layer.part]
    planes = _planes(path, layer, len(parts))
    raw = _colours(path, layer, planes, header)
    values, moved = _in_display(raw.values, header, wanted)
    return replace(raw, values=values, notes=(*left_out(layer, parts), *_said(header), *moved, *raw.notes))


def _planes(path: Path, layer: Layer, parts: int) -> list[np.ndarray[Any, Any]]:
    with opened(path, separate_channels=True) as file:
        if len(file.parts) != parts:  # it drops what it cannot decode, and says so in print alone
            raise ValueError("pixels that cannot be decoded")
        channels = file.channels(layer.part)
        return [np.array(channels[name].pixels) for name in layer.channels]


def _colours(path: Path, layer: Layer, planes: Sequence[np.ndarray[Any, Any]], header: Header) -> Raw:
    """Rec. 709's R, G, B of a layer's channels, in its data window."""
    if any(plane.dtype.kind != "f" for plane in planes):
        raise refuse(path, f"whole numbers in channels {', '.join(layer.channels)}", "floating point")
    _, (width, height) = window(header, "dataWindow")
    rounding = _rounding(header, any(plane.dtype == np.float16 for plane in planes))
    values = [plane.astype(np.float64) for plane in planes]
    steps = [header["sampling"][name] for name in layer.channels]
    subsampled = layer.names == CHROMA and steps == [(1, 1), (2, 2), (2, 2)]
    shapes = [(-(-height // down), -(-width // right)) for right, down in steps]
    # OpenEXR before 3.5 gives such channels the full size, filled up.
    if not (subsampled or set(steps) == {(1, 1)}) or [plane.shape for plane in planes] != shapes:
        raise refuse(path, "subsampled channels", "channels of the full size, or chroma of half of it (OpenEXR 3.5)")
    if layer.names == XYZ:  # what chromaticities say there is that X, Y and Z are primaries
        return primaries.from_xyz(Raw(np.stack(values), (), rounding))
    stated, said = _chromaticities(path, header)
    if layer.names == CHROMA:
        weights = primaries.luminance_weights(stated)
        if abs(weights[1]) < LEAST_GREEN:
            raise refuse(path, f"chroma whose green has {weights[1]:.2g} of the luminance", f"at least {LEAST_GREEN}")
        colours = from_luminance(values[0], values[1], values[2], weights)
        note = "its luminance and chroma (Y, RY, BY) are converted to red, green and blue"
        rounding = replace(rounding, relative=4 * rounding.relative, one_exponent=True)
        if subsampled:
            note += "; its chroma has half the size, and every second value is interpolated"
            rounding = Rounding(LOSSY, one_exponent=True, lossy=rounding.lossy or "chroma at half its size")
        raw = Raw(colours, (note,), rounding)
    else:
        raw = Raw(np.stack(values * (3 // len(values))), (), rounding)
    return raw if primaries.is_rec709(stated) or layer.names == GREY else primaries.to_rec709(raw, stated, said)


def _rounding(header: Header, half: bool) -> Rounding:
    """What a compression does to channels of 16 or 32 bits: B44 packs the former alone, PXR24 cuts the latter."""
    compression = str(getattr(header.get("compression"), "name", "unknown")).removesuffix("_COMPRESSION")
    if compression not in LOSSLESS and (half or not compression.startswith("B44")):
        return Rounding(LOSSY, lossy=compression)
    return HALF if half else PXR24 if compression == "PXR24" else FLOAT


def _chromaticities(path: Path, header: Header) -> tuple[Sequence[float], str]:
    """Primaries and white that a header names, in either way, and how; else Rec. 709's."""
    if "chromaticities" in header:
        stated, said = header["chromaticities"], "chromaticities"
    else:
        stated, said = primaries.SPACES.get(header.get("colorInteropID", ""), primaries.REC709), "colorInteropID"
    if not primaries.usable(stated):
        raise refuse(path, f"chromaticities {', '.join(f'{v:g}' for v in stated)}", "primaries that span colours")
    return stated, said


def _in_display(colours: Floats, header: Header, wanted: Wanted) -> tuple[Floats, tuple[str, ...]]:
    """The data window's pixels at their place in the display window, black where there are none."""
    (left, top), (width, height) = window(header, "dataWindow")
    (x, y), _ = window(header, "displayWindow")
    left, top = left - x, top - y
    if (left, top, width, height) == (0, 0, *wanted.size):
        return colours, ()
    out = np.zeros((3, wanted.height, wanted.width))
    rows = slice(max(top, 0), max(min(top + height, wanted.height), 0))
    columns = slice(max(left, 0), max(min(left + width, wanted.width), 0))
    if rows.start < rows.stop and columns.start < columns.stop:
        out[:, rows, columns] = colours[
            :, rows.start - top : rows.stop - top, columns.start - left : columns.stop - left
        ]
    place = f"{width} x {height} pixels from ({left}, {top}) on"
    return out, (f"its data window is {place}: cut to the display window, and black outside",)


def _said(header: Header) -> tuple[str, ...]:
    """What a header says of values or pixels and nobody applies."""
    notes = []
    if (aspect := header["pixelAspectRatio"]) != 1:
        notes.append(f"its pixelAspectRatio {aspect:g} is left out: pixels are taken for squares")
    notes += [f"its {name} ({header[name]}) is left out" for name in QUOTED[1:] if name in header]
    interop = header.get("colorInteropID", "unknown")
    if interop not in ("unknown", *primaries.SPACES):
        notes.append(f"its colorInteropID is {interop}: values are taken as they are")
    return tuple(notes)


def exr_planes(path: Path) -> Floats:
    """What `write_image` wrote as EXR: (3, h, w) or (1, h, w).

    Raises
    ------
    InputError
        If it cannot be read.
    """
    import OpenEXR

    try:
        with quiet(), OpenEXR.File(str(path)) as file:
            channels = {name: np.array(channel.pixels, dtype=np.float64) for name, channel in file.channels().items()}
    except Exception as error:  # its reader raises whatever its C++ side throws
        raise InputError("image", str(path), f"a readable EXR file ({error})") from error
    if "RGB" in channels:
        return np.ascontiguousarray(channels["RGB"].transpose(2, 0, 1))
    if len(channels) == 1:
        return next(iter(channels.values()))[None]
    raise InputError("image", str(path), "an EXR file of RGB or one channel")


def write_exr(path: Path, radiance: Floats) -> None:
    """Radiance (3, h, w), or one channel (1, h, w), in float32."""
    write_channels(path, dict(zip("RGB" if len(radiance) == 3 else "Y", radiance, strict=True)))


def write_channels(path: Path, channels: Mapping[str, np.ndarray[Any, Any]], comments: str = "") -> None:
    """Channels (h, w) by name, `LAYER.R` and the like, in float32 and one part: every viewer opens it."""
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    header |= {"comments": comments} if comments else {}
    pixels = {name: np.ascontiguousarray(values, dtype=np.float32) for name, values in channels.items()}
    try:
        with quiet(), OpenEXR.File(header, pixels) as file:
            file.write(str(path))
    except RuntimeError as error:  # all that OpenEXR says of a full disk
        raise OSError(errno.EIO, str(error).rsplit(". ", 1)[-1].rstrip(".").lower()) from error


EXR = Format(".exr", (MAGIC,), read_exr, write_exr, has_layers=True, pixel=4 * CHANNELS)
