"""A short run of the long fuzz; the long one is `python tests/support/fuzz_images.py --inputs 20000`."""

import os

import fuzz_images
import numpy as np
import pytest

from nusselt.experiments.images.read import READERS, read_image
from nusselt.renderer.errors import InputError


@pytest.mark.parametrize("ending", fuzz_images.ENDINGS)
def test_changed_files_give_an_image_or_one_clear_error_and_print_nothing(ending):
    done = fuzz_images.batch(seed=7, number=fuzz_images.ENDINGS.index(ending), count=150)
    assert done["failures"] == []
    assert done["counts"]["image"] > 3
    assert done["counts"]["error"] > 50


@pytest.mark.parametrize("ending", fuzz_images.ENDINGS)
def test_unchanged_files_are_images_or_refused_by_name(tmp_path, ending):
    path = tmp_path / f"a{ending}"
    for data in fuzz_images.refused(ending):
        path.write_bytes(data)
        with pytest.raises(InputError):
            read_image(path, fuzz_images.SCENE)
    for data in fuzz_images.whole(ending):
        path.write_bytes(data)
        if not (ending == ".png" and data[24:26] == b"\x10\x04"):
            assert read_image(path, fuzz_images.SCENE).values.shape == (3, fuzz_images.H, fuzz_images.W)


@pytest.mark.parametrize("wrong", [ValueError, MemoryError, IndexError])
def test_any_other_exception_is_a_failure(monkeypatch, wrong):
    """The control: a reader that raises something else is found out."""

    def refuse(*_: object) -> None:
        raise wrong("no")

    monkeypatch.setitem(READERS, ".pfm", refuse)
    monkeypatch.setattr(fuzz_images, "content", lambda *_: fuzz_images.whole(".pfm")[0])
    assert len(fuzz_images.batch(seed=7, number=fuzz_images.ENDINGS.index(".pfm"), count=3)["failures"]) == 3


def test_what_is_printed_is_a_failure(monkeypatch):
    def talk(*_: object) -> None:
        os.write(1, b"hello")
        raise fuzz_images.InputError("image", "x", "y")

    monkeypatch.setattr(fuzz_images, "read_image", talk)
    assert "hello" in str(fuzz_images.batch(seed=7, number=2, count=1)["failures"])


def test_inputs_differ():
    rng = np.random.default_rng(5)
    assert len({fuzz_images.content(".exr", rng) for _ in range(100)}) > 90
