"""What a file is, by its first bytes; by its name where it is not there, or its first bytes say nothing."""

from __future__ import annotations

import re
from contextlib import suppress
from pathlib import Path

from .formats import FORMATS

OTHERS: tuple[tuple[str, str, bytes], ...] = (
    ("TIFF", r"tiff?", rb"II[*+]\0|MM\0[*+]"),
    ("JPEG", r"jpe?g|jfif", rb"\xff\xd8\xff"),
    ("BMP", r"bmp", rb"BM.{4}\0\0\0\0"),
    ("GIF", r"gif", rb"GIF8[79]a"),
    ("PPM", r"p[pgbn]m|pam", rb"P[1-7]\s+[#\dW]"),
    ("NPZ", r"npz", rb"PK\x03\x04"),
    ("WebP", r"webp", rb"RIFF.{4}WEBP"),
    ("TGA", r"tga", rb"(?!)"),
    ("DDS", r"dds", rb"DDS "),
    ("JPEG 2000", r"jp2|j2k", rb"\0\0\0\x0cjP|\xff\x4f\xff\x51"),
    ("JPEG XL", r"jxl", rb"\xff\x0a|\0\0\0\x0cJXL"),
    ("AVIF or HEIF", r"avif|heic|heif", rb".{4}ftyp(?:avi|hei|mif)"),
    ("Photoshop", r"psd", rb"8BPS"),
)
"""Kinds of images that are not read: name, endings, first bytes."""
LAYERED = re.compile(
    rf"(.+(?:{'|'.join(re.escape(kind.suffix) for kind in FORMATS if kind.has_layers)})):(.+)",
    re.IGNORECASE | re.DOTALL,
)


def split_layer(name: str) -> tuple[Path, str]:
    """A file, and the layer of it that FILE:LAYER names; a file that is there under the whole name is that file."""
    named = LAYERED.fullmatch(name)
    try:
        if named is None or Path(name).exists():
            return Path(name), ""
    except (OSError, ValueError):  # no name of a file
        return Path(name), ""
    return Path(named[1]), named[2]


def kind_of(path: Path) -> str:
    """What kind of image a file is: the ending of one that is read, or another's name; empty: none that is known."""
    first = b""
    if path.is_file():
        with suppress(OSError), path.open("rb") as stream:
            first = stream.read(16)
    for kind in FORMATS:
        if first.startswith(kind.magic):
            return kind.suffix
    for name, _, magic in OTHERS:
        if re.match(magic, first, re.DOTALL):
            return name
    suffix = path.suffix.lower()
    if suffix in [kind.suffix for kind in FORMATS]:
        return suffix
    return next((name for name, endings, _ in OTHERS if re.fullmatch(endings, suffix[1:])), "")
