"""Other people's files: every format read right, and every damaged one refused in one line."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from builders import floor, lamp, scene
from click.testing import CliRunner
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from nusselt.experiments.cli.main import main
from nusselt.experiments.images.read import READERS, is_image, quantiser_of, read_image
from nusselt.experiments.images.write import write_image
from nusselt.renderer.errors import InputError

pytestmark = pytest.mark.mitsuba

WIDTH, HEIGHT = 24, 18
ROOM = scene(floor(), lights=(lamp(),), size=(WIDTH, HEIGHT))
RADIANCE = np.random.default_rng(3).random((3, HEIGHT, WIDTH)) * 1.5
TEXT = """size 24 18
camera 0 3 6 0 0 0 0 1 0 40
integrator direct
vertex -2 0 2
vertex 2 0 2
vertex 2 0 -2
diffuse .5 .5 .5
tri 0 1 2
quadLight -.5 2 -.5 0 0 1 1 0 0 5 5 5
"""


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(width: int, height: int, depth: int, colour: int, rows: bytes) -> bytes:
    head = struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def png16(values: np.ndarray) -> bytes:
    """Sixteen bits, its rows filtered by subtraction from the row above where that is odd."""
    rows = np.ascontiguousarray(values.transpose(1, 2, 0)).astype(">u2").view(np.uint8).reshape(values.shape[1], -1)
    told = b""
    for y, row in enumerate(rows):
        told += bytes([2]) + (row - rows[y - 1]).tobytes() if y % 2 else bytes([0]) + row.tobytes()
    return png(values.shape[2], values.shape[1], 16, 2, told)


def hdr(radiance: np.ndarray, runs: bool) -> bytes:
    """Ward's RGBE, truncating."""
    top = radiance.max(axis=0)
    exponent = np.where(top > 0, np.floor(np.log2(np.maximum(top, 1e-30))).astype(int) + 1, -128)
    mantissa = np.floor(radiance * np.exp2(8.0 - exponent)).astype(np.uint8)
    rgbe = np.concatenate((mantissa, (exponent + 128).astype(np.uint8)[None])).transpose(1, 0, 2)  # (h, 4, w)
    h, _, w = rgbe.shape
    body = b""
    for row in rgbe:
        if not runs:
            body += row.T.tobytes()
            continue
        body += bytes((2, 2, w >> 8, w & 255))
        for component in row:
            assert w < 128
            body += (
                bytes([128 + w, component[0]])
                if (component == component[0]).all()
                else bytes([w]) + component.tobytes()
            )
    return b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (h, w) + body


def pfm(radiance: np.ndarray, order: str = "<") -> bytes:
    rows = radiance.transpose(1, 2, 0)[::-1].astype(order + "f4")
    return (
        b"PF\n%d %d\n%s\n" % (radiance.shape[2], radiance.shape[1], b"-1.0" if order == "<" else b"1.0")
        + rows.tobytes()
    )


def test_sixteen_bits_are_read_whole(tmp_path):
    values = np.random.default_rng(0).integers(0, 65536, (3, HEIGHT, WIDTH)).astype(np.uint16)
    (tmp_path / "a.png").write_bytes(png16(values))
    raw = read_image(tmp_path / "a.png", ROOM)
    assert raw.levels == 65535
    np.testing.assert_array_equal(raw.values, values)


def test_eight_bits_grey_and_alpha(tmp_path):
    values = np.random.default_rng(0).integers(0, 256, (HEIGHT, WIDTH, 4)).astype(np.uint8)
    Image.fromarray(values, "RGBA").save(tmp_path / "alpha.png")
    raw = read_image(tmp_path / "alpha.png", ROOM)
    np.testing.assert_array_equal(raw.values, values[..., :3].transpose(2, 0, 1))
    assert "alpha" in raw.notes[0]
    Image.fromarray(values[..., 0]).save(tmp_path / "grey.png")
    np.testing.assert_array_equal(read_image(tmp_path / "grey.png", ROOM).values, np.tile(values[..., 0], (3, 1, 1)))


@pytest.mark.parametrize(
    ("name", "data", "rtol"),
    [
        ("little.pfm", pfm(RADIANCE), 1e-7),
        ("big.pfm", pfm(RADIANCE, ">"), 1e-7),
        ("flat.hdr", hdr(RADIANCE, False), 2.0**-6),
        ("runs.hdr", hdr(RADIANCE, True), 2.0**-6),
    ],
)
def test_radiance_files(tmp_path, name, data, rtol):
    (tmp_path / name).write_bytes(data)
    found = read_image(tmp_path / name, ROOM).values
    np.testing.assert_allclose(found, RADIANCE, rtol=rtol, atol=rtol * RADIANCE.max())


@pytest.mark.parametrize("ending", [".exr", ".npy"])
def test_what_we_write_is_read(tmp_path, ending):
    write_image(tmp_path / f"a{ending}", RADIANCE)
    np.testing.assert_allclose(read_image(tmp_path / f"a{ending}", ROOM).values, RADIANCE, rtol=1e-6)


def test_an_array_may_have_its_channels_first(tmp_path):
    np.save(tmp_path / "a.npy", RADIANCE)
    np.testing.assert_array_equal(read_image(tmp_path / "a.npy", ROOM).values, RADIANCE)


def pickled(path: Path) -> None:
    np.save(path, np.array([{"a": 1}], dtype=object), allow_pickle=True)


def exr_of(shape: tuple[int, ...], path: Path) -> None:
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {"RGB": np.full(shape, np.nan, dtype=np.float32)}) as file:
        file.write(str(path))


PLAIN = b"".join(b"\0" + np.random.default_rng(y).bytes(3 * WIDTH) for y in range(HEIGHT))
BOMB = zlib.compress(bytes(1 << 26), 9)
BAD: dict[str, bytes] = {
    "empty.png": b"",
    "text.png": b"not an image\n" * 100,
    "truncated.png": png(WIDTH, HEIGHT, 8, 2, PLAIN)[:600],
    "short-rows.png": png(WIDTH, HEIGHT, 8, 2, PLAIN[:100]),
    "checksum.png": png(WIDTH, HEIGHT, 8, 2, PLAIN).replace(b"IDAT", b"IDAX"),
    "size.png": png(WIDTH + 1, HEIGHT, 8, 2, PLAIN),
    "huge-header.png": png(2**31 - 1, 2**31 - 1, 8, 2, PLAIN),
    "bomb.png": b"\x89PNG\r\n\x1a\n"
    + chunk(b"IHDR", struct.pack(">IIBBBBB", 60000, 60000, 8, 2, 0, 0, 0))
    + chunk(b"IDAT", BOMB),
    "text-bomb.png": png(WIDTH, HEIGHT, 8, 2, PLAIN)[:33] + chunk(b"zTXt", b"a\0\0" + BOMB),
    "empty.exr": b"",
    "magic.exr": b"\x76\x2f\x31\x01" + bytes(50),
    "no-header.pfm": b"PF\n",
    "size.pfm": pfm(RADIANCE[:, 1:]),
    "huge.pfm": b"PF\n999999999 999999999\n-1.0\n" + bytes(40),
    "truncated.pfm": pfm(RADIANCE)[:-9],
    "scale.pfm": pfm(RADIANCE).replace(b"-1.0", b"nan"),
    "nan.pfm": pfm(np.full_like(RADIANCE, np.nan)),
    "no-header.hdr": b"#?RADIANCE\n",
    "size.hdr": hdr(RADIANCE[:, 1:], True),
    "truncated.hdr": hdr(RADIANCE, True)[:-30],
    "runs.hdr": hdr(RADIANCE, True)[:-30] + b"\xff" * 60,
    "zero-runs.hdr": hdr(RADIANCE, True)[:200] + bytes(4000),
    "huge.hdr": b"#?RADIANCE\n\n-Y 99999999 +X 99999999\n\2\2\2\2",
    "empty.npy": b"",
    "huge.npy": b"\x93NUMPY\x01\x00v\x00"
    + b"{'descr': '<f8', 'fortran_order': False, 'shape': (9999999999, 18, 3), }".ljust(117)
    + b"\n",
    "evil-header.npy": b"\x93NUMPY\x02\x00" + struct.pack("<I", 2**31) + b"{'descr'",
}


@pytest.mark.parametrize("name", BAD)
def test_damaged_files_are_one_line_and_status_2(tmp_path, name):
    (tmp_path / name).write_bytes(BAD[name])
    refused(tmp_path, tmp_path / name)


def test_files_that_are_no_images_of_the_scene(tmp_path):
    pickled(tmp_path / "pickled.npy")
    np.save(tmp_path / "shape.npy", np.zeros((HEIGHT + 1, WIDTH, 3)))
    np.save(tmp_path / "complex.npy", np.zeros((HEIGHT, WIDTH, 3), dtype=complex))
    exr_of((HEIGHT, WIDTH, 3), tmp_path / "nan.exr")
    exr_of((HEIGHT + 2, WIDTH, 3), tmp_path / "size.exr")
    whole = (tmp_path / "nan.exr").read_bytes()
    (tmp_path / "truncated.exr").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "folder.png").mkdir()
    for name in (
        "pickled.npy",
        "shape.npy",
        "complex.npy",
        "nan.exr",
        "size.exr",
        "truncated.exr",
        "folder.png",
        "none.png",
    ):
        refused(tmp_path, tmp_path / name)


def refused(folder: Path, path: Path) -> None:
    room = folder / "room.test"
    room.write_text(TEXT)
    result = CliRunner().invoke(main, ["check", str(room), str(path), "--out", str(folder / "out")])
    assert result.exit_code == 2, result.output
    lines = result.stderr.strip().splitlines()
    assert len(lines) == 1, lines
    assert path.name in lines[0]
    assert "expected" in lines[0]
    assert len(lines[0]) < 600
    assert not (folder / "out").exists()


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    ending=st.sampled_from(sorted(READERS)),
    place=st.integers(0, 2000),
    byte=st.integers(0, 255),
    cut=st.integers(0, 40),
)
def test_flipped_bytes_give_an_image_or_one_error(tmp_path, ending, place, byte, cut):
    whole = {".png": png(WIDTH, HEIGHT, 8, 2, PLAIN), ".pfm": pfm(RADIANCE), ".hdr": hdr(RADIANCE, True)}
    if ending in whole:
        data = bytearray(whole[ending])
    else:
        write_image(tmp_path / f"whole{ending}", RADIANCE)
        data = bytearray((tmp_path / f"whole{ending}").read_bytes())
    data[place % len(data)] = byte
    path = tmp_path / f"flipped{ending}"
    path.write_bytes(bytes(data[: len(data) - cut]))
    with np.errstate(all="ignore"):
        try:
            shape = read_image(path, ROOM).values.shape
        except InputError:
            shape = (3, HEIGHT, WIDTH)  # the one error that is allowed
        assert shape == (3, HEIGHT, WIDTH)


def test_scenes_and_images_are_told_apart_by_their_ending():
    assert is_image("a.PNG")
    assert is_image("folder/b.npy")
    assert not is_image("quad")
    assert not is_image("my.test")


@pytest.mark.parametrize("transfer", ["gamma", "gamma:0", "gamma:x", "rec709", ""])
def test_unknown_curves_are_refused(tmp_path, transfer):
    write_image(tmp_path / "a.png", RADIANCE)
    with pytest.raises(InputError, match="transfer"):
        quantiser_of([read_image(tmp_path / "a.png", ROOM)], transfer, "auto")
