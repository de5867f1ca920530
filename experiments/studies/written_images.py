"""Images as other programs write them: every format that a renderer is likely to choose, told by a name."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nusselt.renderer.vectors import Floats

Write = Callable[[Path, Floats], None]


@dataclass(frozen=True)
class Written:
    """A way of writing radiance (h, w, 3).

    Parameters
    ----------
    name, suffix : str
    write : callable
    transfer : str
        What the user says of it.
    """

    name: str
    suffix: str
    write: Write
    transfer: str = "linear"


def _exr(compression: str, kind: Any = np.float32) -> Write:
    def write(path: Path, image: Floats) -> None:
        import OpenEXR

        header = {"compression": getattr(OpenEXR, f"{compression}_COMPRESSION"), "type": OpenEXR.scanlineimage}
        with OpenEXR.File(header, {"RGB": np.ascontiguousarray(image, dtype=kind)}) as file:
            file.write(str(path))

    return write


def _npy(kind: Any) -> Write:
    def write(path: Path, image: Floats) -> None:
        np.save(path, image.astype(kind), allow_pickle=False)

    return write


def _hdr(path: Path, image: Floats) -> None:
    """Ward's shared exponents, flat."""
    largest = image.max(axis=2)
    mantissa, exponent = np.frexp(largest)
    scale = np.divide(256 * mantissa, largest, out=np.zeros_like(largest), where=largest > 1e-32)
    levels = np.concatenate(
        (image * scale[..., None], np.where(largest > 1e-32, exponent + 128.0, 0)[..., None]), axis=2
    )
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {image.shape[0]} +X {image.shape[1]}\n"
    path.write_bytes(head.encode() + np.clip(levels, 0, 255).astype(np.uint8).tobytes())


def _pfm(path: Path, image: Floats) -> None:
    head = f"PF\n{image.shape[1]} {image.shape[0]}\n-1.0\n"
    path.write_bytes(head.encode() + image[::-1].astype("<f4").tobytes())


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _srgb(x: Floats) -> Floats:
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 1e-9) ** (1 / 2.4) - 0.055)


def _png(bits: int, level: Callable[[Floats], Floats], curve: Callable[[Floats], Floats] = lambda x: x) -> Write:
    """Levels by ``level`` of values in [0, 1], cut off at the highest."""

    def write(path: Path, image: Floats) -> None:
        levels = np.minimum(np.floor(level(curve(np.clip(image, 0, 1)))), 2**bits - 1)
        rows = levels.astype(">u2" if bits == 16 else np.uint8)
        data = b"".join(b"\0" + row.tobytes() for row in rows)
        head = struct.pack(">IIBBBBB", image.shape[1], image.shape[0], bits, 2, 0, 0, 0)
        parts = ((b"IHDR", head), (b"IDAT", zlib.compress(data)), (b"IEND", b""))
        path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(*part) for part in parts))

    return write


FORMATS: tuple[Written, ...] = (
    Written("EXR", ".exr", _exr("ZIP")),
    Written("half EXR", ".exr", _exr("PIZ", np.float16)),
    Written("PXR24 EXR", ".exr", _exr("PXR24")),
    Written("DWAA EXR", ".exr", _exr("DWAA")),
    Written("half DWAA EXR", ".exr", _exr("DWAA", np.float16)),
    Written("float64 NPY", ".npy", _npy(np.float64)),
    Written("float16 NPY", ".npy", _npy(np.float16)),
    Written("PFM", ".pfm", _pfm),
    Written("HDR", ".hdr", _hdr),
    Written("PNG truncated", ".png", _png(8, lambda x: 255 * x)),
    Written("PNG rounded", ".png", _png(8, lambda x: 255 * x + 0.5)),
    Written("PNG int(256 x)", ".png", _png(8, lambda x: 256 * x)),
    Written("sRGB PNG rounded", ".png", _png(8, lambda x: 255 * x + 0.5, _srgb), "srgb"),
    Written("16-bit PNG truncated", ".png", _png(16, lambda x: 65535 * x)),
    Written("16-bit PNG rounded", ".png", _png(16, lambda x: 65535 * x + 0.5)),
    Written("16-bit PNG int(65536 x)", ".png", _png(16, lambda x: 65536 * x)),
)
FORMAT = {written.name: written for written in FORMATS}
