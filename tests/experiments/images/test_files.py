"""Files are whole or not there."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from nusselt.experiments.files import folder_name, replacing
from nusselt.experiments.images.formats.exr import exr_planes
from nusselt.experiments.images.formats.png import to_levels
from nusselt.experiments.images.write import write_image
from nusselt.renderer.errors import InputError

RADIANCE = np.random.default_rng(0).random((3, 5, 7)) * 2


def test_png_is_clamped_truncated_and_has_no_gamma(tmp_path):
    values = np.array([-1.0, 0.0, 0.5, 254.999 / 255, 1.0, 7.0, np.nan, np.inf])
    radiance = np.broadcast_to(values, (3, 1, 8))
    write_image(tmp_path / "a.png", radiance)
    levels = np.asarray(Image.open(tmp_path / "a.png"))
    assert levels.shape == (1, 8, 3)
    assert levels[0, :, 0].tolist() == [0, 0, 127, 254, 255, 255, 0, 255]
    assert to_levels(radiance).dtype == np.uint8


def test_npy_keeps_every_bit(tmp_path):
    write_image(tmp_path / "a.npy", RADIANCE)
    np.testing.assert_array_equal(np.load(tmp_path / "a.npy", allow_pickle=False), RADIANCE.transpose(1, 2, 0))


@pytest.mark.parametrize("name", ["..", ".", "", "a/../../b", "/etc", "..\\x", "a\0b"])
def test_a_folder_named_after_a_scene_lies_inside(name, tmp_path):
    assert (tmp_path / folder_name(name)).resolve().parent == tmp_path.resolve()


def test_a_folder_has_no_character_that_artifacts_of_ci_refuse():
    assert folder_name('quad-my_module:Mine "a|b"*?') == "quad-my_module_Mine _a_b___"


@pytest.mark.parametrize("channels", [1, 3])
def test_exr_is_read_as_it_was_written(tmp_path, channels):
    write_image(tmp_path / "a.exr", RADIANCE[:channels])
    np.testing.assert_array_equal(exr_planes(tmp_path / "a.exr"), RADIANCE[:channels].astype(np.float32))
    (tmp_path / "b.exr").write_bytes((tmp_path / "a.exr").read_bytes()[:100])
    for name in ("b.exr", "gone.exr"):
        with pytest.raises(InputError, match="readable EXR"):
            exr_planes(tmp_path / name)


def test_exr_keeps_float32(tmp_path):
    import OpenEXR

    write_image(tmp_path / "a.exr", RADIANCE)
    with OpenEXR.File(str(tmp_path / "a.exr")) as file:
        np.testing.assert_array_equal(file.channels()["RGB"].pixels, RADIANCE.astype("f4").transpose(1, 2, 0))


@pytest.mark.parametrize("name", ["a", "a.jpg", "a.png.txt"])
def test_other_formats_are_refused(tmp_path, name):
    with pytest.raises(InputError, match=r"\.png, \.exr, \.npy"):
        write_image(tmp_path / name, RADIANCE)
    assert not list(tmp_path.iterdir())


def test_what_fails_halfway_leaves_the_old_file_and_nothing_else(tmp_path):
    target = tmp_path / "a.txt"
    target.write_text("old")

    def fail():
        with replacing(target) as beside:
            beside.write_text("half")
            raise RuntimeError("on purpose")

    with pytest.raises(RuntimeError, match="on purpose"):
        fail()
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]
    assert target.read_text() == "old"


def test_a_place_that_cannot_be_written_is_one_clear_error(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="can be written"):
        write_image(tmp_path / "file" / "a.npy", RADIANCE)
