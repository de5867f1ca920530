"""PNG of every kind: grey, colours or a palette, 1 to 16 bits, with alpha or without, in rows or interlaced."""

from __future__ import annotations

import struct
import warnings
import zlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import PIL.Image
from numpy.typing import NDArray

from nusselt.renderer.errors import InputError
from nusselt.renderer.vectors import Floats
from nusselt.renderer.words import count

from . import primaries
from .raw import Format, Raw, Wanted, check_size, refuse, three_channels

PLAIN = {"1": "L", "L": "L", "P": "RGB", "RGB": "RGB", "LA": "LA", "RGBA": "RGBA", "PA": "RGBA"}
"""Pillow's mode for eight bits, and what it is read as."""
WIDE = {"RGB;16B": "RGB;16L", "RGBA;16B": "RGBA;16L", "LA;16B": "RGBA"}
"""Sixteen bits, of which Pillow keeps the high byte. Told that the bytes are the other way round, it keeps the low;
told that grey with alpha is four numbers of eight bits, it keeps both."""


CHUNKS = 1 << 17
"""Chunks of a file, at most."""


def read_png(path: Path, wanted: Wanted) -> Raw:
    """A PNG file of this size; the size is looked at before a pixel is.

    Raises
    ------
    InputError
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            notes, encoding = _said(dict(_chunks(path)))
            raw = three_channels(path, _decode(path, wanted.size))
        return replace(raw, notes=(*raw.notes, *notes), encoding=encoding)
    except InputError:
        raise
    except PIL.Image.DecompressionBombError as error:
        raise refuse(
            path, "far more pixels than an image has", f"the scene's {wanted.width} x {wanted.height}"
        ) from error
    except (OSError, SyntaxError, ValueError, zlib.error, OverflowError, EOFError, struct.error) as error:
        told = str(error).splitlines()[0] if str(error) else "truncated"
        raise refuse(path, f"damaged PNG ({told})", "a whole PNG file") from error


def _decode(path: Path, wanted: tuple[int, int]) -> NDArray[Any]:
    with PIL.Image.open(path, formats=["PNG"]) as image:
        check_size(path, image.size, wanted)
        kind = str(image.tile[0].args) if image.tile else image.mode
        if kind in WIDE:
            image.load()
            return _wide(np.asarray(image, dtype=np.uint16), path, kind)
        if image.mode.startswith("I"):
            return np.asarray(image).astype(np.uint16)
        if image.mode not in PLAIN:
            raise refuse(path, f"a PNG of mode {image.mode}", "grey or RGB in 8 or 16 bits")
        return np.asarray(image.convert(PLAIN[image.mode]))


def _wide(high: NDArray[np.uint16], path: Path, kind: str) -> NDArray[np.uint16]:
    """Sixteen bits, of what Pillow made of them and of what it makes when told otherwise."""
    with PIL.Image.open(path, formats=["PNG"]) as image:
        image.tile = [entry._replace(args=WIDE[kind]) for entry in image.tile]
        told = np.asarray(image, dtype=np.uint16)
    return np.asarray(told[..., ::2] << 8 | told[..., 1::2] if kind == "LA;16B" else high << 8 | told, dtype=np.uint16)


def _chunks(path: Path) -> Iterator[tuple[bytes, bytes]]:
    """Name and first bytes of every chunk; none is longer than the file: its reader would ask for that much memory."""
    size = path.stat().st_size
    with path.open("rb") as stream:
        stream.seek(8)
        for _ in range(CHUNKS):
            head = stream.read(8)
            if len(head) < 8:
                return
            length, name = struct.unpack(">I4s", head)
            if stream.tell() + length > size:
                raise ValueError("truncated")
            yield name, stream.read(min(length, 80))
            stream.seek(max(length - 80, 0) + 4, 1)
    raise ValueError(f"more than {CHUNKS} chunks")


def _said(chunks: dict[bytes, bytes]) -> tuple[tuple[str, ...], str]:
    """What chunks say of the picture, and of its levels' curve: of several the one that counts."""
    notes, (depth, colour) = [], chunks.get(b"IHDR", bytes(10))[8:10]
    if colour == 3:
        if b"PLTE" not in chunks:
            raise ValueError("no palette")
        notes.append("the colours of its palette are taken for levels of eight bits")
    elif depth < 8:
        notes.append(f"its grey of {count(depth, 'bit')} is taken for levels of eight")
    if b"tRNS" in chunks:
        notes.append("its tRNS chunk (what is transparent) is left out")
    if b"acTL" in chunks:
        notes.append("it is animated: its first picture is taken")
    chromaticities = [v / 1e5 for v in struct.unpack(">8I", chunks[b"cHRM"])] if b"cHRM" in chunks else ()
    xy = [*chromaticities[2:], *chromaticities[:2]]  # white comes first
    if xy and not primaries.is_rec709(xy):
        notes.append("its cHRM chunk names other primaries than Rec. 709's: its colours are not converted")
    if b"cICP" in chunks:
        numbers = " ".join(map(str, chunks[b"cICP"]))
        return tuple(notes), f"its cICP chunk says {numbers} (primaries, curve, matrix, range)"
    if b"iCCP" in chunks:
        name = chunks[b"iCCP"].split(b"\0")[0].decode("latin-1")
        return tuple(notes), f"its iCCP chunk names the profile '{name}' (--transfer srgb, if its curve is that)"
    if b"sRGB" in chunks:
        return tuple(notes), "its sRGB chunk says sRGB (--transfer srgb)"
    gamma = struct.unpack(">I", chunks[b"gAMA"])[0] / 1e5 if b"gAMA" in chunks else 1.0
    told = f" (--transfer gamma:{1 / gamma:.4g})" if gamma else ""
    return tuple(notes), f"its gAMA chunk says {gamma:g}{told}" if gamma != 1 else ""


def to_levels(radiance: Floats, top: int = 255) -> NDArray[Any]:
    """The course's eight bits: clamp to [0, 1], times 255, truncate; no gamma. NaN is black. Or 65535, of sixteen."""
    levels = top * np.clip(np.nan_to_num(radiance, nan=0.0, posinf=1.0, neginf=0.0), 0, 1)
    return levels.astype(np.uint8 if top == 255 else np.uint16)


def write_png(path: Path, radiance: Floats) -> None:
    """The course's eight bits of radiance (3, h, w)."""
    PIL.Image.fromarray(to_levels(radiance).transpose(1, 2, 0)).save(path)


def write_png16(path: Path, radiance: Floats) -> None:
    """Sixteen bits of radiance (3, h, w), made alike; Pillow writes no colours of more than eight."""
    _, height, width = radiance.shape
    rows = to_levels(radiance, 65535).transpose(1, 2, 0).astype(">u2").reshape(height, -1).view(np.uint8)
    pixels = np.concatenate((np.zeros((height, 1), dtype=np.uint8), rows), axis=1).tobytes()  # no row is filtered
    head = struct.pack(">IIBBBBB", width, height, 16, 2, 0, 0, 0)
    with path.open("wb") as stream:
        stream.write(b"\x89PNG\r\n\x1a\n")
        for name, data in ((b"IHDR", head), (b"IDAT", zlib.compress(pixels)), (b"IEND", b"")):
            stream.write(struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data)))


PNG = Format(".png", (b"\x89PNG",), read_png, write_png, write_png16)
