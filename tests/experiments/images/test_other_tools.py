"""Codec by tool: what others write is read to the last bit, or to what the codec keeps; they read what is written."""

from __future__ import annotations

import subprocess
import sys

import imageio.v3 as imageio
import matplotlib.image
import numpy as np
import OpenEXR
import pytest
import skimage.io
from builders import floor, lamp, scene
from PIL import Image

from nusselt.experiments.images.formats.exr import LOSSLESS
from nusselt.experiments.images.read import read_image
from nusselt.experiments.images.write import write_image

W, H = 24, 18
ROOM = scene(floor(), lights=(lamp(),), size=(W, H))
RNG = np.random.default_rng(3)
RADIANCE = (RNG.random((H, W, 3)) * 1.5).astype(np.float32)
BYTES = RNG.integers(0, 256, (H, W, 4), dtype=np.uint8)
WORDS = RNG.integers(0, 65536, (H, W), dtype=np.uint16)
COMPRESSIONS = sorted(name for name in dir(OpenEXR) if name.endswith("_COMPRESSION"))


def grey(values: np.ndarray) -> np.ndarray:
    return np.tile(values, (3, 1, 1))


def planes(values: np.ndarray) -> np.ndarray:
    return values[..., :3].transpose(2, 0, 1)


@pytest.mark.parametrize("compression", COMPRESSIONS)
@pytest.mark.parametrize("kind", [np.float16, np.float32])
@pytest.mark.parametrize("storage", ["scanlineimage", "tiledimage"])
def test_openexr(tmp_path, compression, kind, storage):
    """Every compression that it has: one that is new and loses something fails here, or is taken to be lossy."""
    header = {"compression": getattr(OpenEXR, compression), "type": getattr(OpenEXR, storage)}
    if storage == "tiledimage":
        header["tiles"] = OpenEXR.TileDescription()
        header["tiles"].xSize = header["tiles"].ySize = 8
    values = RADIANCE.astype(kind)
    with OpenEXR.File(header, {"RGB": values}) as file:
        file.write(str(tmp_path / "a.exr"))
    raw = read_image(tmp_path / "a.exr", ROOM)
    name = compression.removesuffix("_COMPRESSION")
    if name == "PXR24" and kind is np.float32:
        assert (np.abs(raw.values - planes(values)) <= raw.rounding.limit(raw.values)).all()
    elif name in LOSSLESS or (name.startswith("B44") and kind is np.float32):
        np.testing.assert_array_equal(raw.values, planes(values))
        assert raw.rounding.lossy == ""
    else:
        assert raw.rounding.lossy == name


def saved(mode: str, values: np.ndarray, **how: object):  # type: ignore[no-untyped-def]
    return lambda path: Image.fromarray(values).convert(mode).save(path, **how)


TOOLS = {
    "Pillow RGB": (".png", saved("RGB", BYTES), planes(BYTES)),
    "Pillow RGBA": (".png", saved("RGBA", BYTES), planes(BYTES)),
    "Pillow grey": (".png", saved("L", BYTES[..., 0]), grey(BYTES[..., 0])),
    "Pillow grey and alpha": (".png", saved("LA", BYTES[..., 0]), grey(BYTES[..., 0])),
    "Pillow black and white": (".png", saved("1", BYTES[..., 0] // 128 * 255), grey(BYTES[..., 0] // 128 * 255)),
    "Pillow palette": (".png", saved("P", BYTES[..., 0] // 64 * 85), grey(BYTES[..., 0] // 64 * 85)),
    "Pillow 16-bit grey": (".png", lambda path: Image.fromarray(WORDS).save(path), grey(WORDS)),
    "Pillow PFM": (".pfm", lambda path: Image.fromarray(RADIANCE[..., 0]).save(path), grey(RADIANCE[..., 0])),
    "imageio 16-bit grey": (".png", lambda path: imageio.imwrite(path, WORDS), grey(WORDS)),
    "imageio RGB": (".png", lambda path: imageio.imwrite(path, BYTES[..., :3]), planes(BYTES)),
    "scikit-image": (".png", lambda path: skimage.io.imsave(path, BYTES[..., :3], check_contrast=False), planes(BYTES)),
    "matplotlib": (".png", lambda path: matplotlib.image.imsave(path, BYTES[..., :3]), planes(BYTES)),
    "NumPy float32": (".npy", lambda path: np.save(path, RADIANCE), planes(RADIANCE)),
    "NumPy float16": (".npy", lambda path: np.save(path, RADIANCE.astype("f2")), planes(RADIANCE.astype("f2"))),
    "NumPy big-endian": (".npy", lambda path: np.save(path, RADIANCE.astype(">f8")), planes(RADIANCE)),
    "NumPy Fortran order": (".npy", lambda path: np.save(path, np.asfortranarray(RADIANCE)), planes(RADIANCE)),
    "NumPy uint16": (".npy", lambda path: np.save(path, WORDS), grey(WORDS)),
}
"""What a tool writes, and what is in it."""


@pytest.mark.parametrize("tool", TOOLS)
def test_tools_that_write(tmp_path, tool):
    ending, write, values = TOOLS[tool]
    path = tmp_path / f"a{ending}"
    write(path)
    np.testing.assert_array_equal(read_image(path, ROOM).values, values)


MITSUBA = """
import sys
import mitsuba as mi
import numpy as np
mi.set_variant("scalar_rgb")
image = mi.Bitmap(np.load(sys.argv[1]))
kinds, pixels = mi.Struct.Type, mi.Bitmap.PixelFormat
image.write("float.exr")
image.write("a.pfm")
image.write("a.hdr")
image.convert(pixels.RGB, kinds.Float16).write("half.exr")
image.convert(pixels.XYZ, kinds.Float32).write("xyz.exr")
image.convert(pixels.Y, kinds.Float32).write("grey.exr")
image.convert(pixels.RGB, kinds.UInt8, srgb_gamma=True).write("srgb.png")
image.convert(pixels.RGB, kinds.UInt16, srgb_gamma=False).write("wide.png")
np.save("grey.npy", np.array(mi.Bitmap("grey.exr")).reshape(18, 24))
np.save("srgb.npy", np.array(mi.Bitmap("srgb.png")))
np.save("wide.npy", np.array(mi.Bitmap("wide.png")))
"""


@pytest.mark.mitsuba
def test_mitsuba(tmp_path):
    np.save(tmp_path / "image.npy", RADIANCE)
    subprocess.run([sys.executable, "-c", MITSUBA, "image.npy"], cwd=tmp_path, check=True, timeout=120)
    right = planes(RADIANCE)
    for name in ("float.exr", "a.pfm"):
        np.testing.assert_array_equal(read_image(tmp_path / name, ROOM).values, right)
    np.testing.assert_array_equal(read_image(tmp_path / "half.exr", ROOM).values, right.astype(np.float16))
    np.testing.assert_array_equal(read_image(tmp_path / "grey.exr", ROOM).values, grey(np.load(tmp_path / "grey.npy")))
    for name in ("srgb", "wide"):
        levels = read_image(tmp_path / f"{name}.png", ROOM)
        np.testing.assert_array_equal(levels.values, planes(np.load(tmp_path / f"{name}.npy")))
    assert "sRGB" in read_image(tmp_path / "srgb.png", ROOM).encoding
    for name in ("xyz.exr", "a.hdr"):
        raw = read_image(tmp_path / name, ROOM)
        assert (np.abs(raw.values - right) <= raw.rounding.limit(right)).all()


def test_tools_that_read(tmp_path):
    image = planes(RADIANCE).astype(np.float64)
    for name, bits in (("a.png", None), ("b.png", 16), ("a.exr", None), ("a.npy", None)):
        write_image(tmp_path / name, image, bits)
    levels = (255 * np.clip(RADIANCE.astype(np.float64), 0, 1)).astype(np.uint8)
    for read in (imageio.imread, skimage.io.imread, lambda path: np.asarray(Image.open(path))):
        np.testing.assert_array_equal(read(tmp_path / "a.png"), levels)
    wide = (65535 * np.clip(RADIANCE.astype(np.float64), 0, 1)).astype(np.uint16)
    np.testing.assert_array_equal(imageio.imread(tmp_path / "b.png"), wide >> 8)  # Pillow keeps the upper half
    with OpenEXR.File(str(tmp_path / "a.exr")) as file:
        np.testing.assert_array_equal(file.channels()["RGB"].pixels, RADIANCE)
    np.testing.assert_array_equal(np.load(tmp_path / "a.npy"), RADIANCE)
