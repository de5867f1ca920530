"""Radiance HDR (RGBE): Ward's shared exponents, flat or in runs of either kind; his `filefmts.pdf` and `color.c`."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from . import primaries
from .raw import Format, Raw, Rounding, Wanted, check_size, refuse
from .rgbe_rows import Damaged, rgbe_rows

HEADER = 1 << 16
"""Bytes in which the header must end."""
RGBE = Rounding(2.0**-7, one_exponent=True)
"""One step of the smallest mantissa that the largest channel can have, 128."""
HEAD = re.compile(
    rb"#\?[^\r\n]*\r?\n((?:[^\n]*\n)*?)\r?\n([-+])([XY])[ \t]+(\d{1,8})[ \t]+([-+])([XY])[ \t]+(\d{1,8})\r?\n"
)
"""Its lines up to an empty one, and the line of its size: the slower axis, then the faster."""
Lines = dict[str, list[tuple[float, ...]]]


def read_hdr(path: Path, wanted: Wanted) -> Raw:
    """An HDR file in any of its eight orders, its EXPOSURE, COLORCORR and PRIMARIES undone.

    Raises
    ------
    InputError
    """
    data = path.read_bytes()
    head = HEAD.match(data[:HEADER])
    if head is None or head[3] == head[6]:
        raise refuse(path, "damaged HDR (no header)", "a Radiance picture: #?, lines, an empty one, -Y h +X w")
    lines, notes = _header(path, head[1])
    slow, fast = int(head[4]), int(head[7])
    upright = head[3] == b"Y"
    check_size(path, (fast, slow) if upright else (slow, fast), wanted.size)
    try:
        rgbe, after = rgbe_rows(data[head.end() :], fast, slow)
    except Damaged as error:
        raise refuse(path, f"damaged HDR ({error})", "a whole Radiance picture") from error
    if after:
        raise refuse(path, f"damaged HDR ({after} bytes after its pixels)", "a whole Radiance picture")
    order = b"%s%s %s%s" % (head[2], head[3], head[5], head[6])
    if order != b"-Y +X":
        notes.append(f"its order {order.decode()} is turned to -Y +X")
    down, right = (head[2], head[5]) if upright else (head[5], head[2])
    rgbe = rgbe if upright else rgbe.transpose(1, 0, 2)
    rgbe = rgbe[:: -1 if down == b"+" else 1, :: -1 if right == b"-" else 1]
    return _undone(path, Raw(_radiance(rgbe), tuple(notes), RGBE), lines)


def _radiance(rgbe: NDArray[np.uint8]) -> NDArray[np.float64]:
    scale = np.where(rgbe[..., 3] > 0, np.ldexp(1.0, rgbe[..., 3].astype(np.int64) - 136), 0.0)
    return np.ascontiguousarray(((rgbe[..., :3] + 0.5) * scale[..., None]).transpose(2, 0, 1))


def _header(path: Path, text: bytes) -> tuple[Lines, list[str]]:
    """Numbers of the lines that say something of the values, and what is to be said of the rest."""
    lines: Lines = {"EXPOSURE": [], "COLORCORR": [], "PRIMARIES": [], "PIXASPECT": [], "GAMMA": []}
    counts = {"COLORCORR": 3, "PRIMARIES": 8}
    for line in text.split(b"\n"):
        name, _, value = line.decode("latin-1").partition("=")
        if name == "FORMAT" and value.strip() != "32-bit_rle_rgbe":
            raise refuse(path, f"an HDR file of FORMAT={value.strip()[:40]}", "FORMAT=32-bit_rle_rgbe")
        if name not in lines:
            continue
        try:
            numbers = tuple(float(word) for word in value.split())
        except ValueError:
            numbers = ()
        right = len(numbers) == counts.get(name, 1) and np.isfinite(numbers).all()
        if not right or (name in ("EXPOSURE", "COLORCORR") and min(numbers) <= 0):
            raise refuse(path, f"damaged HDR (its {name})", f"{name}= and {counts.get(name, 1)} numbers above 0")
        lines[name].append(numbers)
    notes = [
        f"its PIXASPECT {v[0]:g} is left out: pixels are taken for squares" for v in lines["PIXASPECT"] if v[0] != 1
    ]
    notes += [f"its GAMMA {v[0]:g} is left out: values are taken for linear" for v in lines["GAMMA"] if v[0] != 1]
    return lines, notes


def _undone(path: Path, raw: Raw, lines: Lines) -> Raw:
    """Values before the exposures and corrections that the file says were multiplied in; Rec. 709's primaries."""
    for name in ("EXPOSURE", "COLORCORR"):
        factors = [math.prod(column) for column in zip(*lines[name], strict=True)]
        told = " ".join(f"{factor:g}" for factor in factors)
        if not all(1e-30 < factor < 1e30 for factor in factors):
            raise refuse(path, f"damaged HDR (its {name} lines give {told})", "a product from 1e-30 to 1e30")
        if any(factor != 1 for factor in factors):
            values = raw.values / np.array(factors)[:, None, None]
            raw = replace(raw, values=values, notes=(*raw.notes, f"its {name} {told} is divided out"))
    for stated in lines["PRIMARIES"][-1:]:
        if not primaries.usable(stated):
            raise refuse(path, "damaged HDR (its PRIMARIES)", "primaries that span colours, and a white")
        if not primaries.is_rec709(stated):
            raw = primaries.to_rec709(raw, stated, "PRIMARIES")
    return raw


HDR = Format(".hdr", (b"#?RADIANCE", b"#?RGBE"), read_hdr)
