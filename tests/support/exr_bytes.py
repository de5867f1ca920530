"""EXR files written byte by byte, with what OpenEXR's Python package does not write: channels of half the size."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Any

import numpy as np

HALF, FLOAT = 1, 2


def attribute(name: str, kind: str, data: bytes) -> bytes:
    return name.encode() + b"\0" + kind.encode("latin-1") + b"\0" + struct.pack("<i", len(data)) + data


def exr_bytes(channels: Mapping[str, tuple[np.ndarray[Any, Any], int]], height: int, width: int) -> bytes:
    """One part, no compression: channels (values, sampling) by name, a chunk a row."""
    names = sorted(channels)
    listed = b"".join(
        name.encode()
        + b"\0"
        + struct.pack("<iB3xii", HALF if channels[name][0].dtype == np.float16 else FLOAT, 0, *[channels[name][1]] * 2)
        for name in names
    )
    box = struct.pack("<4i", 0, 0, width - 1, height - 1)
    head = struct.pack("<II", 20000630, 2)
    head += attribute("channels", "chlist", listed + b"\0") + attribute("compression", "compression", b"\0")
    head += attribute("dataWindow", "box2i", box) + attribute("displayWindow", "box2i", box)
    head += attribute("lineOrder", "lineOrder", b"\0") + attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
    head += attribute("screenWindowCenter", "v2f", bytes(8))
    head += attribute("screenWindowWidth", "float", struct.pack("<f", 1)) + b"\0"
    rows = []
    for y in range(height):
        row = b"".join(values[y // step].tobytes() for values, step in map(channels.get, names) if y % step == 0)
        rows.append(struct.pack("<ii", y, len(row)) + row)
    first = len(head) + 8 * height
    places = np.cumsum([first, *map(len, rows[:-1])]).astype("<u8")
    return head + places.tobytes() + b"".join(rows)
