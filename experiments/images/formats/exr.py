"""OpenEXR: one part, three channels."""

from __future__ import annotations

import errno
from pathlib import Path
from typing import Any

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.vectors import Floats

from .raw import FLOAT, HALF, Format, Raw, Rounding, check_size, refuse

CHANNELS = 64
"""Most channels a file may have: each is decoded."""
PXR24 = Rounding(2.0**-15)
"""Float32 cut off or rounded to 24 bits, 16 of them mantissa."""
LOSSY = 2.0**-8
"""Relative error of lossy compression where nothing varies; 4e-4 was measured for DWAA and B44."""


def read_exr(path: Path, width: int, height: int) -> Raw:
    """The R, G, B channels (or Y) of an EXR file of this size.

    Raises
    ------
    InputError
    """
    import OpenEXR

    try:
        with OpenEXR.File(str(path), header_only=True) as file:
            _check_header(path, file, (width, height))
            compression = str(getattr(file.header().get("compression"), "name", "")).removesuffix("_COMPRESSION")
        with OpenEXR.File(str(path), separate_channels=True) as file:
            found: dict[str, Any] = {name: channel.pixels for name, channel in file.channels().items()}
    except InputError:
        raise
    except Exception as error:  # whatever a foreign parser raises
        told = " ".join(str(error).split())[:80]
        raise refuse(path, f"damaged EXR ({told})", "a whole OpenEXR file") from error
    for names in (("R", "G", "B"), ("Y", "Y", "Y")):
        if all(name in found for name in names):
            planes = [np.asarray(found[name], dtype=np.float64) for name in names]
            if any(plane.shape != (height, width) for plane in planes):
                raise refuse(path, "subsampled channels", "channels of the full size")
            half = any(found[name].dtype == np.float16 for name in names)
            notes = ("its grey is taken for three equal channels",) if len(set(names)) == 1 else ()
            return Raw(np.stack(planes), notes, _rounding(compression, half))
    raise refuse(path, f"channels {', '.join(sorted(found))[:40]}", "channels R, G, B or Y")


def _rounding(compression: str, half: bool) -> Rounding:
    """What a compression does to channels of 16 or 32 bits: B44 packs the former alone."""
    if compression.startswith("DWA") or (half and compression.startswith("B44")):
        return Rounding(LOSSY, lossy=compression)
    return HALF if half else PXR24 if compression == "PXR24" else FLOAT


def _check_header(path: Path, file: Any, wanted: tuple[int, int]) -> None:
    if len(file.parts) != 1:
        raise refuse(path, f"{len(file.parts)} parts", "an EXR file of one part")
    low, high = (np.asarray(corner, dtype=np.int64) for corner in file.header()["dataWindow"])
    check_size(path, tuple(int(v) for v in high - low + 1), wanted)  # type: ignore[arg-type]
    if len(file.header()["channels"]) > CHANNELS:
        raise refuse(path, f"{len(file.header()['channels'])} channels", f"at most {CHANNELS}")


def exr_planes(path: Path) -> Floats:
    """What `write_image` wrote as EXR: (3, h, w) or (1, h, w).

    Raises
    ------
    InputError
        If it cannot be read.
    """
    import OpenEXR

    try:
        with OpenEXR.File(str(path)) as file:
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
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    pixels = np.ascontiguousarray(radiance.transpose(1, 2, 0), dtype=np.float32)
    channels = {"RGB": pixels} if len(radiance) == 3 else {"Y": pixels[..., 0]}
    try:
        with OpenEXR.File(header, channels) as file:
            file.write(str(path))
    except RuntimeError as error:  # all that OpenEXR says of a full disk
        raise OSError(errno.EIO, str(error).rsplit(". ", 1)[-1].rstrip(".").lower()) from error


EXR = Format(".exr", read_exr, write_exr)
