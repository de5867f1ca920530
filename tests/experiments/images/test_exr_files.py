"""EXR as renderers and compositors write it: layers, parts, windows, chroma, primaries; read, or refused by name."""

from __future__ import annotations

import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from builders import floor, lamp, scene
from exr_bytes import attribute, exr_bytes
from image_inputs import HALVES

from nusselt.experiments.images.formats.chroma import FILTER, doubled, from_luminance
from nusselt.experiments.images.formats.primaries import REC709, SPACES, luminance_weights
from nusselt.experiments.images.read import is_image, read_image
from nusselt.experiments.images.write import write_image
from nusselt.renderer.errors import InputError

W, H = 24, 18
ROOM = scene(floor(), lights=(lamp(),), size=(W, H))
RED, GREEN, BLUE = IMAGE = np.random.default_rng(3).random((3, H, W)).astype(np.float32) * 1.5
GREY = np.ones((H, W), dtype=np.float32)
XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)
"""From linear sRGB, as Lindbloom lists it."""
ACESCG = (0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767)
TO_ACESCG = np.array([[0.613097, 0.339523, 0.047379], [0.070194, 0.916354, 0.013452], [0.020616, 0.109570, 0.869815]])
"""From linear Rec. 709, as ACES publishes it (with Bradford's adaptation)."""


def rgb(prefix: str = "", image: np.ndarray = IMAGE) -> dict[str, np.ndarray]:
    return {prefix + name: np.ascontiguousarray(plane) for name, plane in zip("RGB", image, strict=True)}


def write(path: Path, *parts: tuple[str, dict[str, np.ndarray]], **header: object) -> Path:
    """One part, or several named ones."""
    head = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **header}
    made = [OpenEXR.Part(dict(head), channels, name) for name, channels in parts]
    with OpenEXR.File(head, parts[0][1]) if len(parts) == 1 else OpenEXR.File(made) as file:
        file.write(str(path))
    return path


def windows(data: tuple[int, int, int, int], display: tuple[int, int, int, int]) -> dict[str, object]:
    """Header entries of windows (left, top, right, bottom)."""
    box = [tuple(np.array(v, dtype=np.int32) for v in (w[:2], w[2:])) for w in (data, display)]
    return {"dataWindow": box[0], "displayWindow": box[1]}


def said(path: str | Path) -> str:
    return " / ".join(read_image(path, ROOM).notes)


@pytest.mark.parametrize(
    ("parts", "notes"),
    [
        ([("", rgb())], ""),
        ([("", rgb("ViewLayer.Combined.") | {"ViewLayer.Depth.Z": GREY})], "its layer ViewLayer.Combined is taken"),
        ([("", rgb("rgba.") | {"rgba.A": GREY})], "its alpha is left out"),
        ([("", rgb() | rgb("albedo.", IMAGE / 2) | {"N.X": GREY, "N.Y": GREY, "N.Z": GREY})], "left out: N, albedo"),
        ([("", {k.lower(): v for k, v in rgb().items()})], "its channels r, g, b are taken for red, green and blue"),
        ([("", dict(zip(("red", "green", "blue"), IMAGE, strict=True)))], "red, green, blue are taken"),
        ([("beauty", rgb()), ("depth", {"Z": GREY})], "its layer beauty is taken / what else"),
        ([("depth", {"Z": GREY}), ("beauty", rgb("beauty."))], "its layer beauty is taken"),
        ([("N", dict.fromkeys("XYZ", GREY)), ("beauty", rgb("beauty."))], "taken / what else it holds is left out: N"),
    ],
)  # fmt: skip
def test_the_one_image_in_a_file_is_read_and_the_rest_is_said(tmp_path, parts, notes):
    path = write(tmp_path / "a.exr", *parts)
    np.testing.assert_array_equal(read_image(path, ROOM).values, IMAGE)
    assert notes in said(path)
    assert bool(notes) == bool(said(path))


@pytest.mark.parametrize(
    ("parts", "label"),
    [
        ([("", rgb("one.", IMAGE / 2) | rgb("two."))], "two"),
        ([("one", rgb("", IMAGE / 2)), ("two", rgb())], "two"),
        ([("one", rgb("", IMAGE / 2)), ("two", rgb("eye."))], "two.eye"),
    ],
)
def test_of_several_layers_one_is_named(tmp_path, parts, label):
    path = write(tmp_path / "a.exr", *parts)
    if len(parts) == 1 or label == "two":
        with pytest.raises(InputError, match=r"2 layers: expected one of them, named as a.exr:LAYER: one, two"):
            read_image(path, ROOM)
    named = f"{path}:{label}"
    assert is_image(named)
    np.testing.assert_array_equal(read_image(named, ROOM).values, IMAGE)
    with pytest.raises(InputError, match=rf"layer three: expected one of its layers: one, {label}"):
        read_image(f"{path}:three", ROOM)


def test_a_file_whose_name_has_a_colon_is_that_file(tmp_path):
    write(tmp_path / "a.exr", ("", rgb("one.") | rgb("two.")))
    write_image(tmp_path / "a.exr:one.npy", 2 * IMAGE)
    write(tmp_path / "b.exr:two", ("", rgb("", IMAGE / 2)))
    np.testing.assert_array_equal(read_image(tmp_path / "a.exr:one.npy", ROOM).values, 2 * IMAGE)
    np.testing.assert_array_equal(read_image(tmp_path / "b.exr:two", ROOM).values, IMAGE / 2)
    with pytest.raises(InputError, match=r"no such file"):
        read_image(tmp_path / "c.exr:two", ROOM)


def test_grey_in_no_layer_beside_a_layer_of_colours_is_to_be_chosen(tmp_path):
    path = write(tmp_path / "a.exr", ("", rgb("albedo.", IMAGE / 2) | {"Y": RED}))
    with pytest.raises(InputError, match=r"named as a.exr:LAYER: Y, albedo"):
        read_image(path, ROOM)
    np.testing.assert_array_equal(read_image(f"{path}:Y", ROOM).values[2], RED)


def test_directions_are_no_colours(tmp_path):
    path = write(tmp_path / "a.exr", ("", {f"Normal.{axis}": GREY for axis in "XYZ"}))
    with pytest.raises(InputError, match=r"channels Normal.X, Normal.Y, Normal.Z: expected channels R, G, B; Y;"):
        read_image(path, ROOM)
    whole = write(tmp_path / "b.exr", ("", {name: np.ones((H, W), dtype=np.uint32) for name in "RGB"}))
    with pytest.raises(InputError, match="whole numbers in channels R, G, B"):
        read_image(whole, ROOM)


@pytest.mark.parametrize(
    ("data", "display", "rows", "columns"),
    [
        ((2, 5, W - 1, H - 1), (0, 0, W - 1, H - 1), slice(5, H), slice(2, W)),
        ((102, 103, 99 + W, 99 + H), (100, 100, 99 + W, 99 + H), slice(3, H), slice(2, W)),
    ],
)
def test_a_trimmed_data_window_is_black_outside(tmp_path, data, display, rows, columns):
    part = np.ascontiguousarray(IMAGE[:, rows, columns])
    path = write(tmp_path / "a.exr", ("", rgb("", part)), **windows(data, display))
    right = np.zeros_like(IMAGE)
    right[:, rows, columns] = part
    np.testing.assert_array_equal(read_image(path, ROOM).values, right)
    place = (
        f"{part.shape[2]} x {part.shape[1]} pixels from ({columns.start}, {rows.start}) on: cut to the display window"
    )
    assert place in said(path)


def test_overscan_is_cut_and_a_window_elsewhere_is_black_or_refused(tmp_path):
    wide = np.pad(IMAGE, ((0, 0), (3, 3), (4, 4)), constant_values=9)
    path = write(tmp_path / "a.exr", ("", rgb("", wide)), **windows((-4, -3, W + 3, H + 2), (0, 0, W - 1, H - 1)))
    np.testing.assert_array_equal(read_image(path, ROOM).values, IMAGE)
    beside = windows((W, H, 2 * W - 1, 2 * H - 1), (0, 0, W - 1, H - 1))
    assert not read_image(write(tmp_path / "b.exr", ("", rgb()), **beside), ROOM).values.any()
    other = write(tmp_path / "c.exr", ("", rgb()), **windows((7, 3, W + 6, H + 2), (0, 0, W + 19, H + 19)))
    with pytest.raises(InputError, match=r"44 x 38 pixels, of which 24 x 18 are there: expected the scene's 24 x 18"):
        read_image(other, ROOM)


def test_luminance_alone_is_grey(tmp_path):
    path = write(tmp_path / "a.exr", ("", {"Y": RED, "Z": GREY}))
    np.testing.assert_array_equal(read_image(path, ROOM).values, np.tile(RED, (3, 1, 1)))
    assert "its grey is taken for three equal channels" in said(path)


def test_x_y_z_are_converted(tmp_path):
    made = np.einsum("ij,jyx->iyx", XYZ, IMAGE.astype(float)).astype(np.float32)
    path = write(tmp_path / "a.exr", ("", dict(zip("XYZ", made, strict=True))))
    raw = read_image(path, ROOM)
    assert (np.abs(raw.values - IMAGE) <= raw.rounding.limit(IMAGE)).all()
    assert "taken for CIE's and converted to Rec. 709" in said(path)


def test_primaries_that_are_not_rec_709_are_converted(tmp_path):
    made = np.einsum("ij,jyx->iyx", TO_ACESCG, IMAGE.astype(float)).astype(np.float32)
    for header in ({"chromaticities": ACESCG}, {"colorInteropID": "lin_ap1_scene"}):
        path = write(tmp_path / "a.exr", ("", rgb("", made)), **header)
        raw = read_image(path, ROOM)
        assert (np.abs(raw.values - IMAGE) <= raw.rounding.limit(IMAGE)).all()
        assert f"its {next(iter(header))} (0.713, 0.293" in said(path)
    same = write(tmp_path / "b.exr", ("", rgb()), chromaticities=REC709)
    np.testing.assert_array_equal(read_image(same, ROOM).values, IMAGE)
    assert said(same) == ""
    flat = write(tmp_path / "c.exr", ("", rgb()), chromaticities=(0.3,) * 8)
    with pytest.raises(InputError, match="expected primaries that span colours"):
        read_image(flat, ROOM)


def test_what_a_header_says_and_nobody_applies_is_said(tmp_path):
    path = write(tmp_path / "a.exr", ("", rgb()), pixelAspectRatio=2.0, whiteLuminance=100.0, colorInteropID="data")
    for word in ("pixelAspectRatio 2", "whiteLuminance (100", "colorInteropID is data"):
        assert word in said(path)


def test_spaces_are_those_of_openexr():
    known = getattr(OpenEXR, "colorInteropIDToChromaticities", None)
    if known is None:
        pytest.skip("OpenEXR before 3.5 has no names of spaces")
    for name, chromaticities in SPACES.items():
        np.testing.assert_allclose(chromaticities, known(name), atol=1e-6)


def test_names_that_cannot_be_printed_are_quoted_without(tmp_path):
    path = write(tmp_path / "a.exr", ("", rgb() | {"x\x1b[2J.Z": GREY}))
    assert "left out: x?[2J" in said(path)


def test_luminance_and_chroma(tmp_path):
    """The definitions of the format: RY = (R - Y) / Y, BY = (B - Y) / Y."""
    y = np.tensordot([0.2126, 0.7152, 0.0722], IMAGE, 1)
    chroma = {"Y": y, "RY": (RED - y) / y, "BY": (BLUE - y) / y}
    path = write(tmp_path / "a.exr", ("", {k: v.astype(np.float32) for k, v in chroma.items()}))
    np.testing.assert_allclose(read_image(path, ROOM).values, IMAGE, rtol=2e-4, atol=2e-4)
    assert "luminance and chroma (Y, RY, BY) are converted" in said(path)


def halved(y: np.ndarray, ry: np.ndarray, by: np.ndarray) -> bytes:
    channels = {"Y": (y, 1), "RY": (ry, 2), "BY": (by, 2)}
    return exr_bytes({name: (values.astype("<f4"), step) for name, (values, step) in channels.items()}, H, W)


@pytest.mark.skipif(not HALVES, reason="OpenEXR before 3.5 reads no chroma of half the size")
def test_chroma_of_half_the_size(tmp_path):
    path, y = tmp_path / "a.exr", RED + 0.1
    colour = np.array([0.9, 0.5, 0.2])
    ry, by = (colour[[0, 2]] / (colour @ luminance_weights(REC709)) - 1)[:, None, None] * np.ones((2, H // 2, W // 2))
    path.write_bytes(halved(y, ry, by))
    raw = read_image(path, ROOM)
    right = colour[:, None, None] * (y / (colour @ luminance_weights(REC709)))
    np.testing.assert_allclose(raw.values, right, rtol=1e-5)  # one hue
    assert raw.rounding.lossy == "chroma at half its size"
    assert "its chroma has half the size" in said(path)
    path.write_bytes(halved(y, 0 * ry, 0 * by))
    np.testing.assert_array_equal(read_image(path, ROOM).values, np.tile(y, (3, 1, 1)))  # greys to the last bit


def test_missing_chroma_is_interpolated_by_the_formats_filter():
    values = np.random.default_rng(1).random((3, 20))
    between = doubled(values, 40, 1)
    np.testing.assert_array_equal(between[:, ::2], values)
    np.testing.assert_allclose(between[:, 21], values[:, 4:18] @ FILTER)
    assert sum(FILTER) == pytest.approx(1, abs=1e-5)
    np.testing.assert_allclose(between[:, 39], values[:, 13:] @ FILTER[:7] + values[:, 19] * FILTER[7:].sum())


def test_a_pixel_far_more_saturated_than_its_neighbours_is_toned_down_at_equal_luminance():
    weights = luminance_weights(REC709)
    y, ry, by = np.ones((8, 8)), np.full((4, 4), 0.0), np.full((4, 4), 0.0)
    ry[2, 2] = 3.0
    found = from_luminance(y, ry, by, weights)
    np.testing.assert_allclose(np.tensordot(weights, found, 1), 1)
    assert found[0, 4, 4] < 4
    np.testing.assert_allclose(from_luminance(y, np.kron(ry, np.ones((2, 2))), 0 * y, weights)[0, 4, 4], 4)


def test_channels_of_half_the_size_that_are_no_chroma_are_refused(tmp_path):
    path = tmp_path / "a.exr"
    half = np.ones((H // 2, W // 2), dtype="<f4")
    path.write_bytes(exr_bytes({"R": (half, 2), "G": (GREY, 1), "B": (half, 2)}, H, W))
    with pytest.raises(InputError, match="subsampled channels"):
        read_image(path, ROOM)


def test_what_cannot_be_decoded_is_one_error_and_nothing_is_printed(tmp_path, capfd):
    whole = write(tmp_path / "a.exr", ("", rgb())).read_bytes()
    several = write(tmp_path / "b.exr", ("one", rgb()), ("two", rgb("", IMAGE / 2))).read_bytes()
    for data, layer in ((whole[: len(whole) // 2], ""), (several[: len(several) * 3 // 4], ":one")):
        (tmp_path / "c.exr").write_bytes(data)
        with pytest.raises(InputError, match="damaged EXR"):
            read_image(f"{tmp_path / 'c.exr'}{layer}", ROOM)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(("data", "told"), [(b"", "empty"), (b"hello there", "a file that begins with b'hell'")])
def test_what_only_its_name_calls_exr_is_said_so(tmp_path, data, told):
    (tmp_path / "a.exr").write_bytes(data)
    with pytest.raises(InputError, match=f"{told}: expected a whole OpenEXR file"):
        read_image(tmp_path / "a.exr", ROOM)


def test_a_header_that_asks_for_more_than_an_image_is_refused(tmp_path):
    many = {f"L{k}.R": GREY for k in range(130)}
    with pytest.raises(InputError, match="130 channels: expected at most 128"):
        read_image(write(tmp_path / "a.exr", ("", many)), ROOM)
    large = write(tmp_path / "b.exr", ("", rgb("", np.ones((3, 100, 100), dtype=np.float32))))
    data = large.read_bytes().replace(
        b"displayWindow\0box2i\0\x10\0\0\0" + np.array([0, 0, 99, 99], "<i4").tobytes(),
        b"displayWindow\0box2i\0\x10\0\0\0" + np.array([0, 0, W - 1, H - 1], "<i4").tobytes(),
    )
    large.write_bytes(data)
    with pytest.raises(InputError, match="a data window of 10000 pixels: expected at most 5824"):
        read_image(large, ROOM)


def test_deep_pixels_are_refused_before_any_is_read(tmp_path):
    samples = np.empty((H, W), dtype=object)
    samples[:] = [[np.ones(2, dtype=np.float32) for _ in range(W)] for _ in range(H)]
    header = {"type": OpenEXR.deepscanline, "compression": OpenEXR.ZIPS_COMPRESSION}
    path = write(tmp_path / "a.exr", ("", dict.fromkeys("RGB", samples)), **header)
    with pytest.raises(InputError, match="deep pixels: expected one colour a pixel"):
        read_image(path, ROOM)


def test_a_tile_far_larger_than_the_image_is_refused_before_it_is_decoded(tmp_path):
    """1.7 kB that ask for 5 GB and 20 s."""
    tiles = OpenEXR.TileDescription()
    tiles.xSize = tiles.ySize = 16
    path = write(tmp_path / "a.exr", ("", rgb()), type=OpenEXR.tiledimage, tiles=tiles)
    np.testing.assert_array_equal(read_image(path, ROOM).values, IMAGE)
    size = np.array([16, 16], dtype="<u4").tobytes()
    data = path.read_bytes()
    assert data.count(b"tiledesc\0\x09\0\0\0" + size) == 1
    path.write_bytes(data.replace(size, np.array([16, 1 << 24], dtype="<u4").tobytes(), 1))
    with pytest.raises(InputError, match="tiles of 805306368 values: expected at most 16777216"):
        read_image(path, ROOM)


@pytest.mark.parametrize("name", ["envmap", "colorInteropID", "pixelAspectRatio", "chromaticities"])
def test_attributes_of_a_type_that_nobody_knows_are_no_surprise(tmp_path, name):
    data = exr_bytes({"Y": (GREY, 1)}, H, W)
    begin = data.replace(b"pixelAspectRatio\0float\0\4\0\0\0" + struct.pack("<f", 1), b"")
    (tmp_path / "a.exr").write_bytes(begin[:8] + attribute(name, "\x9e", b"\0") + begin[8:])
    with pytest.raises(InputError, match="damaged EXR"):
        read_image(tmp_path / "a.exr", ROOM)


@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-"])
def test_streams_may_be_closed(tmp_path, closed):
    write(tmp_path / "a.exr", ("", rgb()))
    (tmp_path / "read.py").write_text(
        "from pathlib import Path\n"
        "from nusselt.experiments.images.formats import exr, Wanted\n"
        f"raw = exr.read_exr(Path('a.exr'), Wanted({W}, {H}))\n"
        "exr.write_exr(Path('b.exr'), raw.values)\n"
    )
    done = subprocess.run(["sh", "-c", f"{sys.executable} read.py {closed}"], cwd=tmp_path, timeout=60)
    assert done.returncode == 0
    np.testing.assert_array_equal(read_image(tmp_path / "b.exr", ROOM).values, IMAGE)
