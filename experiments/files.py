"""Files that are whole or not there: everything is written beside its place and renamed into it."""

from __future__ import annotations

import errno
import os
import re
import secrets
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.vectors import Floats


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A path to write to; it takes the place of ``path`` when the block ends well, and vanishes when not.

    Raises
    ------
    InputError
        If the folder cannot be written to.
    """
    beside = path.with_name(f".{path.stem}.{secrets.token_hex(4)}{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield beside
        os.replace(beside, path)
    except OSError as error:
        raise InputError("output", str(path), f"a place that can be written to ({error.strerror})") from error
    finally:
        with suppress(OSError):  # the first error is the one to tell
            beside.unlink(missing_ok=True)


def _png(path: Path, radiance: Floats) -> None:
    from PIL import Image

    Image.fromarray(to_levels(radiance).transpose(1, 2, 0)).save(path)


def _npy(path: Path, radiance: Floats) -> None:
    with path.open("wb") as stream:
        np.save(stream, np.ascontiguousarray(radiance.transpose(1, 2, 0)), allow_pickle=False)


def _exr(path: Path, radiance: Floats) -> None:
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    pixels = np.ascontiguousarray(radiance.transpose(1, 2, 0), dtype=np.float32)
    channels = {"RGB": pixels} if len(radiance) == 3 else {"Y": pixels[..., 0]}
    try:
        with OpenEXR.File(header, channels) as file:
            file.write(str(path))
    except RuntimeError as error:  # all that OpenEXR says of a full disk
        raise OSError(errno.EIO, str(error).rsplit(". ", 1)[-1].rstrip(".").lower()) from error


WRITERS: dict[str, Callable[[Path, Floats], None]] = {".png": _png, ".exr": _exr, ".npy": _npy}


def to_levels(radiance: Floats) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """The course's eight bits: clamp to [0, 1], times 255, truncate; no gamma. NaN is black."""
    return (255 * np.clip(np.nan_to_num(radiance, nan=0.0, posinf=1.0, neginf=0.0), 0, 1)).astype(np.uint8)


def folder_name(name: str) -> str:
    """A scene's name as that of a folder of its own: it leads nowhere else."""
    return re.sub(r"^\.+|[/\\\0]", "_", name) or "_"


def read_exr(path: Path) -> Floats:
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


def check_image_name(path: Path) -> None:
    """Refuse a name whose format is not written here.

    Raises
    ------
    InputError
    """
    if path.suffix.lower() not in WRITERS:
        raise InputError("output", str(path), "a name that ends in " + ", ".join(WRITERS))


def write_image(path: Path, radiance: Floats) -> None:
    """Write radiance (3, h, w): PNG in the course's eight bits, EXR in float32, NPY (h, w, 3) in float64.

    EXR also takes one channel, (1, h, w).
    """
    check_image_name(path)
    with replacing(path) as beside:
        WRITERS[path.suffix.lower()](beside, radiance)
