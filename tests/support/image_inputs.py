"""Image files for the fuzz: those of every kind that is read or refused, changed, cut and mixed, and made up."""

from __future__ import annotations

import os
import struct
import tempfile
import zlib
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import OpenEXR
from exr_bytes import attribute, exr_bytes

from nusselt.renderer.scene import Camera, Scene

W, H = 12, 8
SIZE = H, W
"""Small: most changes then meet headers. Rows of fewer than eight pixels have no runs."""
VIEWED = Scene(W, H, Camera((0.0, 3.0, 6.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 40.0))
"""Whose images they are."""
ENDINGS = (".exr", ".hdr", ".pfm", ".png")
HALVES = tuple(map(int, OpenEXR.__version__.split(".")[:2])) >= (3, 5)
"""Whether this OpenEXR reads chroma of half the size."""
NUMBERS = (0, 1, 2, 3, W - 1, H, W, 255, 256, 65535, 1 << 20, (1 << 31) - 1, -1, -2, -W, -(1 << 31))
IMAGE = np.round(np.random.default_rng(0).random((3, H, W)) * 16) / 8
IMAGE[:, :3] = 0.5


def _exr(*parts: tuple[str, dict[str, np.ndarray]], **header: Any) -> bytes:
    head = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **header}
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "a.exr")
        made = [OpenEXR.Part(dict(head), channels, name) for name, channels in parts]
        with OpenEXR.File(head, parts[0][1]) if len(parts) == 1 else OpenEXR.File(made) as file:
            file.write(path)
        return Path(path).read_bytes()


def _exr_files() -> list[bytes]:
    found, tiles = [], OpenEXR.TileDescription()
    tiles.xSize = tiles.ySize = 5
    for name in (name for name in dir(OpenEXR) if name.endswith("_COMPRESSION")):
        for kind in (np.float16, np.float32):
            for storage in (OpenEXR.scanlineimage, OpenEXR.tiledimage):
                planes = {c: np.ascontiguousarray(p, dtype=kind) for c, p in zip("RGB", IMAGE, strict=True)}
                head = {"tiles": tiles} if storage == OpenEXR.tiledimage else {}
                found.append(_exr(("", planes), compression=getattr(OpenEXR, name), type=storage, **head))
    r, g, b = IMAGE.astype(np.float32)
    box = tuple(np.array(v, dtype=np.int32) for v in ((-2, -1), (W + 1, H)))
    wide = {c: np.pad(p, ((1, 1), (2, 2))) for c, p in zip("RGB", (r, g, b), strict=True)}
    half, rgb = r[: H // 2, : W // 2], {"R": r, "G": g, "B": b}
    shown = (np.zeros(2, dtype=np.int32), np.array((W - 1, H - 1), dtype=np.int32))
    beside = [np.array(corner, dtype=np.int32) for corner in ((W, H), (2 * W - 1, 2 * H - 1))]
    right = [np.array(corner, dtype=np.int32) for corner in ((W, 0), (2 * W - 1, H - 1))]
    layer = {f"a.{name}": plane for name, plane in rgb.items()}
    return [
        *found,
        _exr(("a", layer), ("b", {"Z": r})),
        _exr(("one", layer), ("two", {"b.Z": r, "c.Z": r})),
        _exr(("", rgb | {f"{k:040}.Z": r for k in range(9)})),
        _exr(("", rgb), dataWindow=tuple(right), displayWindow=shown),
        _exr(("", {"a.R": r, "a.G": g, "a.B": b, "a.A": r, "z.Z": g})),
        _exr(("", {"r": r, "g": g, "b": b}), chromaticities=(0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.322, 0.338)),
        _exr(("one", {"R": r, "G": g, "B": b}), ("two", {"Z": r}), colorInteropID="lin_ap1_scene"),
        _exr(("", {"X": r, "Y": g, "Z": b}), pixelAspectRatio=2.0, whiteLuminance=3.0),
        _exr(("", {"Y": r, "RY": g, "BY": b})),
        _exr(("", {"Y": r})),
        _exr(("", rgb), dataWindow=tuple(beside), displayWindow=shown),
        _exr(("", wide), dataWindow=box, displayWindow=shown),
        *([exr_bytes({"Y": (r, 1), "RY": (half, 2), "BY": (half, 2)}, H, W)] if HALVES else []),
    ]


def _rgbe() -> np.ndarray:
    exponent = np.frexp(np.maximum(IMAGE.max(axis=0), 1e-9))[1]
    return np.dstack([*np.floor(IMAGE * np.exp2(8.0 - exponent)), exponent + 128]).astype(np.uint8)


def _hdr_files() -> list[bytes]:
    rows = _rgbe()
    mark, four, rest = bytes((2, 2, 0, W)), bytes((128 + 4,)), bytes((W - 4,))
    runs = b"".join(mark + b"".join(four + c[:1].tobytes() + rest + c[4:].tobytes() for c in row.T) for row in rows)
    old = b"".join(row[:1].tobytes() + bytes((1, 1, 1, 3)) + row[4:].tobytes() for row in rows)
    head = b"#?RADIANCE\n%sFORMAT=32-bit_rle_rgbe\n\n%s\n"
    rec709 = b"PRIMARIES=.64 .33 .3 .6 .15 .06 .3127 .329\n"
    usual, turned = b"-Y %d +X %d" % (H, W), b"+X %d -Y %d" % (W, H)
    lines = b"EXPOSURE=2\nCOLORCORR=1 2 3\nPRIMARIES=.64 .33 .29 .6 .15 .06 .3333 .3333\nGAMMA=2\nPIXASPECT=2\n"
    return [
        head % (b"", usual) + runs,
        head % (lines, usual) + rows.tobytes(),
        head % (b"EXPOSURE=1\n" + rec709, usual) + old,
        head % (b"VIEW=-vtv\n", turned) + rows.transpose(1, 0, 2).tobytes(),
    ]


def _pfm_files() -> list[bytes]:
    rows = IMAGE.transpose(1, 2, 0)[::-1]
    return [
        b"PF\n%d %d\n-1.0\n" % (W, H) + rows.astype("<f4").tobytes(),
        b"PF\r\n# x\r\n%d %d\r\n2\r\n" % (W, H) + rows.astype(">f4").tobytes(),
        b"Pf %d %d -0.5\n" % (W, H) + rows[..., 0].astype("<f4").tobytes(),
    ]


def _chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


REC709_WHITE_FIRST = (31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000)


def _png_files() -> list[bytes]:
    chunks = [(b"gAMA", struct.pack(">I", 45455)), (b"sRGB", b"\0"), (b"iCCP", b"Film\0\0" + zlib.compress(bytes(200)))]
    chunks += [(b"cHRM", np.arange(8, dtype=">u4").tobytes()), (b"cHRM", struct.pack(">8I", *REC709_WHITE_FIRST))]
    chunks += [(b"cICP", bytes((9, 16, 0, 1))), (b"tRNS", bytes(6)), (b"acTL", bytes(8))]
    found = []
    rows = np.random.default_rng(2).integers(0, 256, (H, 8 * W), dtype=np.uint8)
    for depth, colour, size in (
        (8, 2, 3),
        (8, 6, 4),
        (8, 0, 1),
        (16, 2, 6),
        (16, 6, 8),
        (16, 0, 2),
        (16, 4, 4),
        (8, 3, 1),
    ):
        data = zlib.compress(b"".join(b"\0" + row[: size * W].tobytes() for row in rows))
        head = _chunk(b"IHDR", struct.pack(">IIBBBBB", W, H, depth, colour, 0, 0, 0))
        palette = _chunk(b"PLTE", bytes(range(256)) * 3) if colour == 3 else b""
        for name, value in [(b"", b""), *chunks]:
            more = _chunk(name, value) if name else b""
            found.append(b"\x89PNG\r\n\x1a\n" + head + more + palette + _chunk(b"IDAT", data) + _chunk(b"IEND", b""))
    return found


def _refused_exr() -> list[bytes]:
    r, g, b = IMAGE.astype(np.float32)
    rgb = {"R": r, "G": g, "B": b}
    large = _exr(("", {name: np.ones((100, 100), dtype=np.float32) for name in "RGB"}))
    small = np.array((0, 0, W - 1, H - 1), dtype="<i4").tobytes()
    at = large.index(b"displayWindow\0box2i\0") + 24
    samples = np.empty((H, W), dtype=object)
    samples[:] = [[np.ones(2, dtype=np.float32) for _ in range(W)] for _ in range(H)]
    deep = {"type": OpenEXR.deepscanline, "compression": OpenEXR.ZIPS_COMPRESSION}
    return [
        _exr(("", dict.fromkeys("RGB", samples)), **deep),
        _exr(("", {"Y": r, "RY": g, "BY": b}), chromaticities=(0.64, 0.33, 0.4, 0.0, 0.15, 0.06, 0.3, 0.3)),
        _exr(("", {name: plane.astype(np.uint32) for name, plane in rgb.items()})),
        _exr(("", {f"{layer}.{name}": plane for layer in "ab" for name, plane in rgb.items()})),
        _exr(("one", rgb), ("two", rgb)),
        _exr(("one", {f"a.{name}": plane for name, plane in rgb.items()}), ("two", rgb)),
        _exr(("", {f"{k}.R": r for k in range(130)})),
        _exr(("", rgb), chromaticities=(0.3,) * 8),
        large[:at] + small + large[at + 16 :],
        exr_bytes({"R": (r[: H // 2, : W // 2], 2), "G": (g, 1), "B": (b, 1)}, H, W),
    ]


def _refused_hdr() -> list[bytes]:
    lines = (b"EXPOSURE=1e20\nEXPOSURE=1e20\n", b"PRIMARIES=.3 .3 .3 .3 .3 .3 .3 .3\n", b"FORMAT=32-bit_rle_xyze\n")
    return [b"#?RADIANCE\n%s\n-Y %d +X %d\n" % (line, H, W) + _rgbe().tobytes() for line in lines]


@lru_cache
def refused(ending: str) -> list[bytes]:
    """Files that are not damaged, and are refused by name."""
    return {".exr": _refused_exr, ".hdr": _refused_hdr}.get(ending, list)()


@lru_cache
def whole(ending: str) -> list[bytes]:
    """Files that are read, of every kind."""
    makers: dict[str, Callable[[], list[bytes]]]
    makers = {".exr": _exr_files, ".hdr": _hdr_files, ".pfm": _pfm_files, ".png": _png_files}
    return makers[ending]()


TEXTS = (b"9" * 9, b"-1", b"nan", b"1e400", b"=", b"\n", b"\n\n", b"# x\r", b"EXPOSURE=0\n")


def _mutate(data: bytearray, rng: Random, other: bytes) -> None:
    """One change, in place; most are where headers are."""
    if not data:
        return
    at = rng.randrange(min(len(data), 600) if rng.random() < 0.7 else len(data))
    kind = rng.randrange(8)
    if kind <= 1:
        data[at] = rng.choice((0, 1, 2, 32, 127, 128, 255, rng.randrange(256)))
    elif kind == 2:
        data[at : at + 4] = struct.pack(rng.choice(("<i", ">i")), rng.choice(NUMBERS))
    elif kind == 3:
        del data[at : at + rng.randrange(1, 40)]
    elif kind == 4:
        data[at:at] = rng.randbytes(rng.randrange(1, 20))
    elif kind == 5:
        start = rng.randrange(len(other))
        data[at : at + 60] = other[start : start + rng.randrange(1, 200)]
    elif kind == 6:
        data[at:at] = rng.choice(TEXTS)
    else:
        data[:] = data.replace(b"\n", b"\r\n") if rng.random() < 0.3 else data[: rng.randrange(len(data) + 1)]


def _checksummed(data: bytes) -> bytes:
    """A PNG's chunks with their checksums right again, so that what they hold is looked at."""
    out, at = data[:8], 8
    while at + 12 <= len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        out += _chunk(data[at + 4 : at + 8], data[at + 8 : at + 8 + length])
        at += 12 + length
    return out


_SIZES = (
    *((b"gAMA", 4), (b"sRGB", 1), (b"iCCP", 30), (b"cHRM", 32), (b"cICP", 4), (b"tRNS", 2), (b"tRNS", 6), (b"acTL", 8)),
    *((b"PLTE", 6), (b"PLTE", 768), (b"tEXt", 9), (b"fcTL", 26), (b"bKGD", 2), (b"pHYs", 9), (b"none", 3)),
)
"""Chunks, and how long they are."""


def _made_png(rng: Random) -> bytes:
    """A header of any kind, filtered rows enough or not, chunks of any sizes in any order."""
    depth, colour = rng.choice((1, 2, 4, 8, 16, 3)), rng.choice((0, 2, 3, 4, 6, 5))
    if rng.random() < 0.8:  # a pair that there is
        depth = rng.choice({0: (1, 2, 4, 8, 16), 3: (1, 2, 4, 8)}.get(colour, (8, 16)))
    interlace = rng.choice((0, 0, 0, 0, 1, 1, 1, 1, 2))
    size = -(-W * depth * {2: 3, 4: 2, 6: 4}.get(colour, 1) // 8)
    filters = range(5 if rng.random() < 0.9 else 6)
    if interlace:  # rows of many lengths: every byte can be a filter
        rows = bytes(rng.choices(filters, k=4 * H * (size + 8)))
    else:
        rows = b"".join(rng.choice(filters).to_bytes() + rng.randbytes(size) for _ in range(H))
    data = zlib.compress(rows)
    chunks = [_chunk(b"IHDR", struct.pack(">IIBBBBB", W, H, depth, colour, 0, 0, interlace))]
    for _ in range(rng.choice((0, 0, 1, 1, 2, 3))):
        name, size = rng.choice(_SIZES)
        chunks.append(
            _chunk(
                name,
                rng.choice((rng.randbytes, rng.randbytes, bytes))(size if rng.random() < 0.8 else rng.randrange(40)),
            )
        )
    palette = [_chunk(b"PLTE", bytes(3 * rng.choice((0, 1, 2, 256))))] if colour == 3 and rng.random() < 0.9 else []
    at = rng.randrange(len(data))
    return b"".join(
        (
            b"\x89PNG\r\n\x1a\n",
            *chunks,
            *palette,
            _chunk(b"IDAT", data[:at]),
            _chunk(b"IDAT", data[at:]),
            _chunk(b"IEND", b""),
        )
    )


_NUMERALS = (
    b"1",
    b"-1",
    b"2.5",
    b"0",
    b"1e-9",
    b"1e300",
    b"1e-40",
    b"nan",
    b".64",
    b"x",
    b"1 1 1",
    b"1 2",
    b"0 0 0",
    b"",
    b"12",
)


def _made_hdr(rng: Random) -> bytes:
    """A header of lines made up, an order of rows, pixels enough or not."""
    names = (b"EXPOSURE", b"COLORCORR", b"PRIMARIES", b"GAMMA", b"PIXASPECT", b"FORMAT", b"VIEW", b"SOFTWARE", b"#")
    lines = [b"#?RADIANCE", b"FORMAT=32-bit_rle_rgbe"]
    for _ in range(rng.randrange(4)):
        name = rng.choice(names)
        count = 8 if name == b"PRIMARIES" and rng.random() < 0.8 else 1
        lines.append(name + b"=" + b" ".join(rng.choices(_NUMERALS, k=count)))
    axes = [rng.choice((b"+", b"-")) + axis for axis in rng.choice(((b"X", b"Y"), (b"Y", b"X"), (b"Y", b"Y")))]
    axes = [b"-Y", b"+X"] if rng.random() < 0.4 else axes
    order = b" ".join(axis + b" %d" % (W if axis[1:] == b"X" else H) for axis in axes)
    runs = bytes((2, 2, 0, W)) + 4 * bytes((128 + W, rng.randrange(256)))
    row = rng.choice(
        (rng.randbytes(4 * W), runs, bytes((9, 9, 9, 128, 1, 1, 1, W - 1)), bytes((1, 1, 1, 5)), b"\2\2\0")
    )
    return b"\n".join((*lines, b"", order, row * rng.choice((H, H, W, 1))))


def _made_pfm(rng: Random) -> bytes:
    """A header of words made up, pixels enough or not."""
    space = (b" ", b"\n", b"\r\n", b"\r", b"# x\n", b"\n#\r", b"\t ")
    kind, count = rng.choice(((b"PF", 12), (b"Pf", 4), (b"PF4", 16)))
    words = [
        kind,
        b"%d" % W,
        b"%d" % H,
        rng.choice((b"-1", b"1.0", b"+2", b"-.5", b"0", b"1e999", b"-e", b"1.5.", b"nan")),
    ]
    head = b"".join(word + rng.choice(space) for word in words)
    return head + rng.randbytes(count * W * H + rng.choice((0, 0, 0, 1, -1, 4)))


def _made_exr(rng: Random) -> bytes:
    """One of the files with an attribute more, right or nearly so."""
    data = bytearray(rng.choice(whole(".exr")))
    names = (
        "chromaticities",
        "colorInteropID",
        "pixelAspectRatio",
        "whiteLuminance",
        "adoptedNeutral",
        "envmap",
        "tiles",
    )
    floats = struct.pack("<8f", *(rng.choice((0.3, 0.6, 0.15, 0.0, -0.1, 1.0, 1e9, float("nan"))) for _ in range(8)))
    kind, value = rng.choice(
        (
            ("chromaticities", floats),
            ("float", floats[:4]),
            ("v2f", floats[:8]),
            ("string", rng.choice((b"lin_ap0_scene", b"srgb_rec709_scene", b"data", b"\xff", b""))),
            ("envmap", b"\0"),
            ("\x9e", bytes(12)),
        )
    )
    data[8:8] = attribute(kind if kind == "chromaticities" else rng.choice(names), kind, value)
    return bytes(data)


MADE: dict[str, Callable[[Random], bytes]]
MADE = {".exr": _made_exr, ".hdr": _made_hdr, ".pfm": _made_pfm, ".png": _made_png}


def image_bytes(ending: str, rng: Random) -> bytes:
    """One input."""
    if rng.random() < 0.03:
        return rng.randbytes(rng.randrange(2000))
    files = (*whole(ending), *refused(ending))
    is_made = rng.random() < 0.3
    data = bytearray(MADE[ending](rng) if is_made else rng.choice(files))
    if not is_made or rng.random() < 0.2:
        _mutate(data, rng, rng.choice(files))
        while rng.random() < 0.4:
            _mutate(data, rng, rng.choice(files))
    return _checksummed(bytes(data)) if ending == ".png" and rng.random() < 0.7 else bytes(data)
