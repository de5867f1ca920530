"""A long fuzz of the image readers: every file gives an image or one clear error, in bounded time and memory.

    python tests/support/fuzz_images.py --inputs 20000 --seed 1

Files are those of every kind that is read, changed, cut, mixed, and made up, each written under its own ending. Each
worker may use 2 GiB; an input over a second of processor time, any other exception, anything printed, a file written
and a worker that dies are failures. Where coverage.py is installed, the branches that were reached are printed too.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import resource
import struct
import sys
import tempfile
import time
import traceback
import zlib
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
from exr_bytes import attribute, exr_bytes

import nusselt.experiments.images.formats.exr
from nusselt.experiments.images.read import read_image
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Camera, Scene

W, H = 24, 18
SCENE = Scene(W, H, Camera((0.0, 3.0, 6.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 40.0))
FORMATS = Path(nusselt.experiments.images.formats.exr.__file__).parent
SECONDS = 1.0
MEMORY = 2 << 30
BATCH = 250
ENDINGS = (".exr", ".hdr", ".pfm", ".png")
HALVES = tuple(map(int, OpenEXR.__version__.split(".")[:2])) >= (3, 5)
"""Whether this OpenEXR reads chroma of half the size."""
NUMBERS = (0, 1, 2, 3, 17, 23, 24, 255, 256, 65535, 1 << 20, (1 << 31) - 1, -1, -2, -24, -(1 << 31))
IMAGE = np.round(np.random.default_rng(0).random((3, H, W)) * 16) / 8
IMAGE[:, :5] = 0.5


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
    tiles.xSize = tiles.ySize = 16
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
    return [
        *found,
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


def _png_files() -> list[bytes]:
    chunks = {b"gAMA": struct.pack(">I", 45455), b"sRGB": b"\0", b"iCCP": b"Film\0\0" + zlib.compress(bytes(200))}
    chunks |= {b"cHRM": np.arange(8, dtype=">u4").tobytes(), b"cICP": bytes((9, 16, 0, 1)), b"tRNS": bytes(6)}
    chunks |= {b"acTL": bytes(8)}
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
        for name, value in [(b"", b""), *chunks.items()]:
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


def _mutate(data: bytearray, rng: np.random.Generator, other: bytes) -> None:
    """One change, in place; most are where headers are."""
    if not data:
        return
    at = int(rng.integers(min(len(data), 600) if rng.random() < 0.7 else len(data)))
    kind = int(rng.integers(8))
    if kind <= 1:
        data[at] = int(rng.choice([0, 1, 2, 32, 127, 128, 255, rng.integers(256)]))
    elif kind == 2:
        data[at : at + 4] = struct.pack(str(rng.choice(["<i", ">i"])), int(rng.choice(NUMBERS)))
    elif kind == 3:
        del data[at : at + int(rng.integers(1, 40))]
    elif kind == 4:
        data[at:at] = rng.bytes(int(rng.integers(1, 20)))
    elif kind == 5:
        start = int(rng.integers(len(other)))
        data[at : at + 60] = other[start : start + int(rng.integers(1, 200))]
    elif kind == 6:
        data[at:at] = str(
            rng.choice(["9" * 9, "-1", "nan", "1e400", "=", "\n", "\n\n", "# x\r", "EXPOSURE=0\n"])
        ).encode()
    else:
        data[:] = data.replace(b"\n", b"\r\n") if rng.random() < 0.3 else data[: int(rng.integers(len(data) + 1))]


def _checksummed(data: bytes) -> bytes:
    """A PNG's chunks with their checksums right again, so that what they hold is looked at."""
    out, at = data[:8], 8
    while at + 12 <= len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        out += _chunk(data[at + 4 : at + 8], data[at + 8 : at + 8 + length])
        at += 12 + length
    return out


def content(ending: str, rng: np.random.Generator) -> bytes:
    """One input."""
    files = [*whole(ending), *refused(ending)]
    if rng.random() < 0.03:
        return rng.bytes(int(rng.integers(2000)))
    data = bytearray(files[int(rng.integers(len(files)))])
    other = files[int(rng.integers(len(files)))]
    if ending == ".exr" and rng.random() < 0.1:
        kinds = [
            ("chromaticities", "chromaticities", rng.bytes(32)),
            ("envmap", "envmap", b"\0"),
            (str(rng.choice(["envmap", "colorInteropID", "pixelAspectRatio", "tiles", "a"])), "\x9e", bytes(12)),
        ]
        name, kind, value = kinds[int(rng.integers(len(kinds)))]
        data[8:8] = attribute(name, kind, value)
    for _ in range(int(rng.geometric(0.5)) - (rng.random() < 0.1)):
        _mutate(data, rng, other)
    return _checksummed(bytes(data)) if ending == ".png" and rng.random() < 0.7 else bytes(data)


def _outcome(path: Path, layer: str) -> tuple[str, float]:
    started = time.process_time()
    try:
        raw = read_image(f"{path}{layer}", SCENE)
        right = raw.values.shape == (3, H, W) and all(note.isprintable() for note in (*raw.notes, raw.encoding))
        said = "image" if right else f"{raw.values.shape}, {raw.notes}"
    except InputError as error:
        message = str(error)
        said = "error" if message.isprintable() and len(message) < 2000 else f"unclear error: {message!r}"
    except Exception:  # every kind is a finding here
        said = traceback.format_exc(limit=-3)
    return said, time.process_time() - started


def batch(seed: int, number: int, count: int, measured: bool = False) -> dict[str, Any]:
    """Outcomes of ``count`` inputs by ending, the slowest, what failed, and the branches that were reached."""
    rng = np.random.default_rng([seed, number])
    ending = ENDINGS[number % len(ENDINGS)]
    counts: Counter[str] = Counter()
    slowest, failures = 0.0, []
    cover = _coverage() if measured else None
    refused(ending), whole(ending)
    if cover:
        cover.start()
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryFile() as printed, _into(printed):
        path = Path(folder) / f"fuzz{ending}"
        for k in range(count):
            given = content(ending, rng)
            path.write_bytes(given)
            said, seconds = _outcome(path, ":a" if ending == ".exr" and rng.random() < 0.1 else "")
            slowest = max(slowest, seconds)
            counts[said if said in ("image", "error") else "failure"] += 1
            if said not in ("image", "error") or seconds > SECONDS:
                failures.append({"input": [seed, number, k], "bytes": len(given), "said": said, "seconds": seconds})
        if sorted(os.listdir(folder)) != [path.name]:
            failures.append({"said": f"files written: {os.listdir(folder)}"})
        if printed.seek(0, os.SEEK_END):
            printed.seek(0)
            failures.append({"input": [seed, number], "said": f"printed: {printed.read(300)!r}"})
    lines = {}
    if cover:
        cover.stop()
        lines = {name: cover.get_data().arcs(name) for name in cover.get_data().measured_files()}
    return {"ending": ending, "counts": dict(counts), "slowest": slowest, "failures": failures, "arcs": lines}


@contextlib.contextmanager
def _into(file: Any):  # type: ignore[no-untyped-def]
    """What is printed, by C++ too, goes into a file."""
    kept = [os.dup(1), os.dup(2)]
    for stream in (1, 2):
        os.dup2(file.fileno(), stream)
    try:
        yield
    finally:
        sys.stdout.flush()
        for stream, copy in zip((1, 2), kept, strict=True):
            os.dup2(copy, stream)
            os.close(copy)


def _coverage() -> Any:
    import coverage

    return coverage.Coverage(data_file=None, branch=True, include=[f"{FORMATS}/*"], config_file=False)


def branches(arcs: dict[str, set[tuple[int, int]]]) -> dict[str, str]:
    """Share of each reader's branches that were reached, by file."""
    cover = _coverage()
    cover.get_data().add_arcs({name: list(lines) for name, lines in arcs.items()})
    found = {}
    for name in sorted(arcs):
        told = cover._analyze(name)
        lines = ", ".join(map(str, sorted(told.missing_branch_arcs()))) or "none"
        numbers = told.numbers
        found[Path(name).name] = f"{numbers.n_executed_branches} of {numbers.n_branches}; not all at lines {lines}"
    return found


def _limited() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, resource.getrlimit(resource.RLIMIT_AS)[1]))


def main() -> int:
    """Run batches; exit status 1 if any input failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--inputs", type=int, default=4_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=None)
    given = parser.parse_args()
    with contextlib.suppress(ImportError):
        _coverage()
    measured = "coverage" in sys.modules
    counts: dict[str, Counter[str]] = {ending: Counter() for ending in ENDINGS}
    arcs: dict[str, set[tuple[int, int]]] = {}
    slowest, failures = 0.0, []
    sizes = [min(BATCH, given.inputs - start) for start in range(0, given.inputs, BATCH)]
    one = partial(batch, given.seed, measured=measured)
    with ProcessPoolExecutor(given.workers, initializer=_limited) as pool:
        work = [pool.submit(one, number, size) for number, size in enumerate(sizes)]
        for number, future in enumerate(work):
            try:
                done = future.result()
            except BrokenProcessPool:
                failures.append({"input": [given.seed, number], "said": "a worker died"})
                break
            counts[done["ending"]].update(done["counts"])
            slowest = max(slowest, done["slowest"])
            failures += done["failures"]
            for name, lines in done["arcs"].items():
                arcs.setdefault(name, set()).update(lines)
    told = {"counts": {ending: dict(count) for ending, count in counts.items()}, "slowest_seconds": slowest}
    told |= {"branches": branches(arcs) if measured else "coverage.py is not installed"}
    print(json.dumps(told | {"failed": len(failures), "failures": failures[:5]}, indent=1))
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
