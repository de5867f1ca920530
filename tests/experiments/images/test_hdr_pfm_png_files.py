"""HDR, PFM and PNG as other tools write them, and files of other kinds: read, or refused by name."""

from __future__ import annotations

import re
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from builders import floor, lamp, scene
from click.testing import CliRunner
from PIL import Image

from nusselt.experiments.cli.main import main
from nusselt.experiments.images.kinds import OTHERS, kind_of
from nusselt.experiments.images.read import is_image, read_image
from nusselt.experiments.images.write import write_image
from nusselt.experiments.scenes.catalogue import load
from nusselt.renderer.errors import InputError

W, H = 24, 18
ROOM = scene(floor(), lights=(lamp(),), size=(W, H))
IMAGE = np.random.default_rng(3).random((3, H, W)) * 1.5
IMAGE[:, 4:9] = IMAGE[:, 4:5, :1]  # where runs are long


def said(path: Path) -> str:
    return " / ".join(read_image(path, ROOM).notes)


# --- HDR ---


def quads(image: np.ndarray = IMAGE) -> np.ndarray:
    """RGBE (h, w, 4): mantissas cut off."""
    exponent = np.frexp(image.max(axis=0))[1]
    return np.dstack([*np.floor(image * np.exp2(8.0 - exponent)), exponent + 128]).astype(np.uint8)


def flat(row: np.ndarray) -> bytes:
    return row.tobytes()


def by_component(row: np.ndarray) -> bytes:
    out = bytes((2, 2, len(row) >> 8, len(row) & 255))
    for c in row.T:
        out += bytes((128 + len(row), c[0])) if (c == c[0]).all() else bytes((len(row),)) + c.tobytes()
    return out


def old_runs(row: np.ndarray, unit: int = 256) -> bytes:
    """1 1 1 n after a pixel; runs that follow each other count in units of 1, 256 …"""
    out, at = b"", 0
    while at < len(row):
        same = 1
        while at + same < len(row) and (row[at + same] == row[at]).all():
            same += 1
        out += row[at].tobytes()
        count = same - 1
        while count:
            out += bytes((1, 1, 1, count % unit))
            count //= unit
        at += same
    return out


def hdr(rows: bytes, size: str = f"-Y {H} +X {W}", lines: str = "FORMAT=32-bit_rle_rgbe\n", end: str = "\n") -> bytes:
    return ("#?RADIANCE\n" + lines + "\n" + size + "\n").replace("\n", end).encode() + rows


ROWS = {
    "flat": b"".join(map(flat, quads())),
    "runs by component": b"".join(map(by_component, quads())),
    "old runs": b"".join(map(old_runs, quads())),
    "rows of all kinds": b"".join((flat, by_component, old_runs)[y % 3](row) for y, row in enumerate(quads())),
}


def holds(path: Path, image: np.ndarray = IMAGE) -> None:
    """Within one step of the mantissas: each stands for its middle."""
    raw = read_image(path, ROOM)
    assert (np.abs(raw.values - image) <= raw.rounding.limit(image)).all()


@pytest.mark.parametrize("kind", ROWS)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_rows_of_every_kind(tmp_path, kind, end):
    (tmp_path / "a.hdr").write_bytes(hdr(ROWS[kind], end=end))
    holds(tmp_path / "a.hdr")
    assert said(tmp_path / "a.hdr") == ""


def test_old_runs_of_more_than_255_pixels_and_of_rows_too_narrow_for_others(tmp_path):
    wide = np.tile(quads()[:1, :1], (1, 65_000, 1))
    for size in (300, 65_000, 7):
        row = wide[:, :size]
        (tmp_path / "a.hdr").write_bytes(hdr(old_runs(row[0]), f"-Y 1 +X {size}"))
        found = read_image(tmp_path / "a.hdr", scene(floor(), lights=(lamp(),), size=(size, 1))).values
        assert (found == found[:, :, :1]).all()
        np.testing.assert_allclose(found[:, 0, 0], IMAGE[:, 0, 0], rtol=0.02)


def test_a_flat_file_may_begin_as_runs_do(tmp_path):
    pixels = quads()
    pixels[0, 0] = 2, 2, 5, 120
    (tmp_path / "a.hdr").write_bytes(hdr(pixels.tobytes()))
    np.testing.assert_array_equal(read_image(tmp_path / "a.hdr", ROOM).values[:, 0, 0], np.ldexp([2.5, 2.5, 5.5], -16))


ORDERS = {
    "-Y {h} +X {w}": lambda a: a,
    "+Y {h} +X {w}": lambda a: a[::-1],
    "-Y {h} -X {w}": lambda a: a[:, ::-1],
    "+Y {h} -X {w}": lambda a: a[::-1, ::-1],
    "+X {w} -Y {h}": lambda a: a.transpose(1, 0, 2),
    "+X {w} +Y {h}": lambda a: a[::-1].transpose(1, 0, 2),
    "-X {w} -Y {h}": lambda a: a[:, ::-1].transpose(1, 0, 2),
    "-X {w} +Y {h}": lambda a: a[::-1, ::-1].transpose(1, 0, 2),
}
"""A size line, and the stored rows of an image whose first row is its top."""


@pytest.mark.parametrize("order", ORDERS)
def test_every_order_of_rows_and_columns(tmp_path, order):
    rows = b"".join(map(by_component, ORDERS[order](quads())))
    (tmp_path / "a.hdr").write_bytes(hdr(rows, order.format(h=H, w=W)))
    holds(tmp_path / "a.hdr")
    usual = order.startswith("-Y {h} +X")
    assert said(tmp_path / "a.hdr") == ("" if usual else f"its order {order[:2]} {order[7:9]} is turned to -Y +X")


def test_exposures_and_corrections_are_divided_out(tmp_path):
    factor = np.array([3.0, 1.5, 6.0])[:, None, None]
    lines = "EXPOSURE=2.0\nEXPOSURE= 1.5\nCOLORCORR=1 0.5 4\nCOLORCORR=1 1 .5\n\tEXPOSURE=7\nSOFTWARE=EXPOSURE=9\n"
    (tmp_path / "a.hdr").write_bytes(hdr(b"".join(map(flat, quads(IMAGE * factor))), lines=lines))
    raw = read_image(tmp_path / "a.hdr", ROOM)
    size = (IMAGE * factor).max(axis=0) / factor
    assert (np.abs(raw.values - IMAGE) <= raw.rounding.relative * size).all()
    assert said(tmp_path / "a.hdr") == "its EXPOSURE 3 is divided out / its COLORCORR 1 0.5 2 is divided out"


def test_primaries_of_the_file_are_converted(tmp_path):
    radiance = "PRIMARIES=0.64 0.33 0.29 0.60 0.15 0.06 0.3333 0.3333\nPIXASPECT=1\nGAMMA=1\n"
    (tmp_path / "a.hdr").write_bytes(hdr(ROWS["flat"], lines=radiance))
    assert "its PRIMARIES (0.64, 0.33, 0.29" in said(tmp_path / "a.hdr")
    grey = np.tile(IMAGE[:1], (3, 1, 1))
    (tmp_path / "b.hdr").write_bytes(hdr(quads(grey).tobytes(), lines=radiance))
    holds(tmp_path / "b.hdr", grey)  # white stays white
    same = "PRIMARIES=0.64 0.33 0.3 0.6 0.15 0.06 0.3127 0.329\n"
    (tmp_path / "c.hdr").write_bytes(hdr(ROWS["flat"], lines=same))
    holds(tmp_path / "c.hdr")
    (tmp_path / "d.hdr").write_bytes(hdr(ROWS["flat"], lines="PIXASPECT=2\nGAMMA=2.2\n"))
    assert said(tmp_path / "d.hdr").startswith("its PIXASPECT 2 is left out: pixels are taken for squares / its GAMMA")


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (hdr(ROWS["flat"], lines="FORMAT=32-bit_rle_xyze\n"), "FORMAT=32-bit_rle_xyze: expected FORMAT="),
        (hdr(ROWS["flat"], lines="EXPOSURE=0\n"), "its EXPOSURE"),
        (hdr(ROWS["flat"], lines="EXPOSURE=two\n"), "its EXPOSURE"),
        (hdr(ROWS["flat"], lines="EXPOSURE=1e30\nEXPOSURE=1e30\n"), "its EXPOSURE lines give 1e\\+60"),
        (hdr(ROWS["flat"], lines="COLORCORR=1 1\n"), "its COLORCORR"),
        (hdr(ROWS["flat"], lines="PRIMARIES=.3 .3 .3 .3 .3 .3 .3 .3\n"), "its PRIMARIES"),
        (hdr(ROWS["flat"], f"-Y {H} -Y {W}"), "no header"),
        (hdr(ROWS["flat"])[:-1], "truncated"),
        (hdr(ROWS["flat"]) + b"1234", "4 bytes after its pixels"),
        (hdr(b"\1\1\1\5" + ROWS["flat"]), "its runs"),
        (hdr(flat(quads()[0])[:-4] + b"\1\1\1\5" * 600), "its runs"),
        (hdr(ROWS["runs by component"][:900]), "truncated"),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_named(tmp_path, data, words):
    (tmp_path / "a.hdr").write_bytes(data)
    with pytest.raises(InputError, match=words):
        read_image(tmp_path / "a.hdr", ROOM)


# --- PFM ---


def pfm(header: str, image: np.ndarray = IMAGE, order: str = "<") -> bytes:
    return header.encode() + image.transpose(1, 2, 0)[::-1].astype(order + "f4").tobytes()


@pytest.mark.parametrize(
    ("header", "order", "scale"),
    [
        (f"PF\n{W} {H}\n-1.0\n", "<", 1),
        (f"PF\r\n{W} {H}\r\n-1.0\r\n", "<", 1),
        (f"PF\n# made by hand\n{W} {H} # size\n# order:\n-1.0\n", "<", 1),
        (f"PF {W} {H} -1.0\n", "<", 1),
        (f"PF\n{W} {H}\n1.0\r", ">", 1),
        (f"PF\n{W} {H}\n-2e0\n", "<", 2),
        (f"PF\n{W}\n{H}\n.5\n", ">", 0.5),
    ],
)
def test_pfm_headers(tmp_path, header, order, scale):
    image = IMAGE.copy()
    image[0, -1, 0] = np.frombuffer(b"\n\n\n\x3f", dtype=order + "f4")[0]  # the first byte is a line's end
    (tmp_path / "a.pfm").write_bytes(pfm(header, image, order))
    np.testing.assert_allclose(read_image(tmp_path / "a.pfm", ROOM).values, scale * image, rtol=1e-7)
    assert said(tmp_path / "a.pfm") == ("" if scale == 1 else f"its values are multiplied by its scale, {scale:g}")


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (pfm(f"PF\n{W} {H}\n-1.0\n") + b"\n", "damaged PFM .5185 bytes after its header.: expected 5184 bytes"),
        (pfm(f"PF\n{W} {H}\n-1.0\n")[:-1], "truncated PFM"),
        (pfm(f"PF\n{W} {H}\n0\n"), "scale 0"),
        (pfm(f"PF4\n{W} {H}\n-1\n"), "no header"),
        (pfm(f"PF\n{W} {H}\n-1.0.0\n"), "no header"),
    ],
)
def test_pfm_files_that_are_refused(tmp_path, data, words):
    (tmp_path / "a.pfm").write_bytes(data)
    with pytest.raises(InputError, match=words):
        read_image(tmp_path / "a.pfm", ROOM)


# --- PNG ---


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


CHRM = np.array([31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000])
"""Rec. 709's, white first."""
WIDE = np.array([31270, 32900, 70800, 29200, 17000, 79700, 13100, 4600])
"""Rec. 2020's."""


@pytest.mark.parametrize(
    ("chunks", "encoding", "note"),
    [
        ({}, "", ""),
        ({b"gAMA": struct.pack(">I", 100000)}, "", ""),
        ({b"gAMA": struct.pack(">I", 45455)}, "its gAMA chunk says 0.45455 (--transfer gamma:2.2)", ""),
        ({b"gAMA": struct.pack(">I", 45455), b"sRGB": b"\0"}, "its sRGB chunk says sRGB (--transfer srgb)", ""),
        ({b"sRGB": b"\0", b"iCCP": b"Film\0\0x"}, "its iCCP chunk names the profile 'Film'", ""),
        ({b"cICP": bytes((9, 16, 0, 1))}, "its cICP chunk says 9 16 0 1", ""),
        ({b"cHRM": CHRM.astype(">u4").tobytes()}, "", ""),
        ({b"cHRM": WIDE.astype(">u4").tobytes()}, "", "cHRM chunk names other primaries"),
        ({b"tRNS": bytes(6)}, "", "tRNS chunk (what is transparent) is left out"),
    ],
)
def test_what_chunks_say_of_the_curve_is_quoted(tmp_path, chunks, encoding, note):
    path = tmp_path / "a.png"
    write_image(path, IMAGE)
    data = path.read_bytes()
    path.write_bytes(data[:33] + b"".join(chunk(name, value) for name, value in chunks.items()) + data[33:])
    raw = read_image(path, ROOM)
    assert raw.encoding.startswith(encoding)
    assert bool(raw.encoding) == bool(encoding)
    assert note in said(path)
    assert bool(said(path)) == bool(note)


ADAM7 = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2))
"""Of each pass of an interlaced file: first column, first row, steps."""
KINDS = [(d, c) for c, depths in ((0, (1, 2, 4, 8, 16)), (3, (1, 2, 4, 8))) for d in depths]
KINDS += [(d, c) for c in (2, 4, 6) for d in (8, 16)]


def filtered_rows(samples: np.ndarray, depth: int) -> bytes:
    """Samples (h, w, c) of so many bits, each byte less the one of the pixel before: filter 1."""
    bits = samples[..., None] >> np.arange(depth)[::-1] & 1
    rows = np.packbits(bits.reshape(len(samples), -1).astype(np.uint8), axis=1)
    before = np.pad(rows, ((0, 0), (max(depth * samples.shape[2] // 8, 1), 0)))[:, : rows.shape[1]]
    return b"".join(b"\1" + row.tobytes() for row in rows - before)


def png(samples: np.ndarray, depth: int, colour: int, interlace: bool, *chunks: bytes) -> bytes:
    passes = ADAM7 if interlace else ((0, 0, 1, 1),)
    rows = b"".join(filtered_rows(samples[y::down, x::right], depth) for x, y, right, down in passes)
    head = struct.pack(">IIBBBBB", W, H, depth, colour, 0, 0, interlace)
    parts = (chunk(b"IHDR", head), *chunks, chunk(b"IDAT", zlib.compress(rows)), chunk(b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


@pytest.mark.parametrize("interlace", [False, True], ids=["rows", "interlaced"])
@pytest.mark.parametrize(("depth", "colour"), KINDS)
def test_png_of_every_kind_has_the_levels_that_were_written(tmp_path, depth, colour, interlace):
    """Grey 0, colours 2, a palette 3, grey with alpha 4, colours with alpha 6."""
    rng, path = np.random.default_rng(depth + 100 * colour), tmp_path / "a.png"
    samples = rng.integers(0, 1 << depth, (H, W, {2: 3, 4: 2, 6: 4}.get(colour, 1)))
    palette = rng.integers(0, 256, (1 << depth, 3), dtype=np.uint8) if colour == 3 else None
    chunks = [] if palette is None else [chunk(b"PLTE", palette.tobytes())]
    if colour in (0, 2, 3):  # what is transparent: a value, or the first two of a palette
        chunks.append(chunk(b"tRNS", {0: bytes(2), 2: bytes(6), 3: bytes(2)}[colour]))
    path.write_bytes(png(samples, depth, colour, interlace, *chunks))
    right = palette[samples[..., 0]] if palette is not None else samples[..., : 3 if colour in (2, 6) else 1]
    right = right * (255 // ((1 << depth) - 1)) if colour == 0 and depth < 8 else right
    raw = read_image(path, ROOM)
    np.testing.assert_array_equal(raw.values.transpose(1, 2, 0), np.broadcast_to(right, (H, W, 3)))
    assert raw.levels == (65535 if depth == 16 else 255)
    if depth <= 8:
        with Image.open(path) as image:
            np.testing.assert_array_equal(np.asarray(image.convert("RGBA"))[..., :3], raw.values.transpose(1, 2, 0))
    words = {"alpha": colour in (4, 6), "tRNS": colour in (0, 2, 3), "grey": colour in (0, 4), "palette": colour == 3}
    words["for levels of eight"] = depth < 8 or colour == 3
    assert {word: word in said(path) for word in words} == words


@pytest.mark.parametrize("more", [(), (b"tRNS",)], ids=["opaque", "transparent"])
def test_a_palette_that_is_missing_is_told(tmp_path, more):
    path = tmp_path / "a.png"
    path.write_bytes(png(np.zeros((H, W, 1), dtype=int), 8, 3, False, *(chunk(name, bytes(1)) for name in more)))
    with pytest.raises(InputError, match=r"damaged PNG \(no palette\)"):
        read_image(path, ROOM)


def test_sixteen_bits_are_written_as_they_are_read(tmp_path):
    write_image(tmp_path / "a.png", IMAGE, bits=16)
    raw = read_image(tmp_path / "a.png", ROOM)
    np.testing.assert_array_equal(raw.values, (65535 * np.clip(IMAGE, 0, 1)).astype(int))
    assert raw.levels == 65535
    with Image.open(tmp_path / "a.png") as image:  # another reader keeps the upper half
        np.testing.assert_array_equal(np.asarray(image), raw.values.transpose(1, 2, 0) >> 8)
    for name, bits in (("a.exr", 16), ("a.npy", 8), ("a.png", 12)):
        with pytest.raises(InputError, match=f"bits = {bits}"):
            write_image(tmp_path / name, IMAGE, bits=bits)


# --- other kinds ---


def kinds(folder: Path) -> dict[str, Path]:
    """Files of kinds that are not read."""
    levels = Image.fromarray(np.zeros((H, W, 3), dtype=np.uint8))
    for ending in ("tif", "jpg", "bmp", "gif", "ppm", "webp", "tga"):
        levels.save(folder / f"a.{ending}")
    np.savez(folder / "a.npz", IMAGE)
    return {path.suffix[1:]: path for path in folder.iterdir()}


def test_other_kinds_are_named_where_an_image_or_a_scene_is_expected(tmp_path):
    room = tmp_path / "room.test"
    room.write_text(f"size {W} {H}\ncamera 0 3 6 0 0 0 0 1 0 40\nintegrator direct\n")
    (tmp_path / "images").mkdir()
    for ending, path in kinds(tmp_path / "images").items():
        name = next(name for name, endings, _ in OTHERS if re.fullmatch(endings, ending))
        assert is_image(str(path))
        with pytest.raises(InputError, match=f"a {name} file: expected an image that is one of .png, .exr, .pfm"):
            read_image(path, ROOM)
        with pytest.raises(InputError, match=f"a {name} image: expected a scene file, which is text"):
            load(str(path))
        bare = path.rename(path.with_suffix(".data"))
        assert is_image(str(bare)) == (ending != "tga")  # it has no first bytes of its own
        bare.unlink()
    path = tmp_path / "x.tif"
    path.write_bytes(b"II*\0" + bytes(100))
    result = CliRunner().invoke(main, ["check", str(room), str(path)])
    assert result.exit_code == 2
    assert "a TIFF file: expected an image that is one of .png" in result.stderr


@pytest.mark.parametrize("text", ["#? a comment\nsize 24 18\n", "BMW\n", "P one\n", "size 1 1\n", ""])
def test_text_is_no_image(tmp_path, text):
    (tmp_path / "a.test").write_text(text)
    assert kind_of(tmp_path / "a.test") == ""


def test_a_file_is_what_its_first_bytes_say(tmp_path):
    (tmp_path / "a.pic").write_bytes(hdr(ROWS["flat"]))
    holds(tmp_path / "a.pic")
    assert "it is read as .hdr" in said(tmp_path / "a.pic")
    write_image(tmp_path / "a.npy", IMAGE)
    (tmp_path / "a.npy").rename(tmp_path / "a.png")
    np.testing.assert_array_equal(read_image(tmp_path / "a.png", ROOM).values, IMAGE)
