"""A short run of the long fuzz; the long one is `python tests/support/fuzz.py KIND... --inputs 1000000`."""

import os
import warnings
from dataclasses import replace
from pathlib import Path
from random import Random

import fuzz
import image_inputs
import pytest
import scene_inputs
from branches import Branches

from nusselt.experiments.images.read import read_image
from nusselt.renderer.errors import InputError


@pytest.mark.parametrize("kind", fuzz.KINDS)
def test_changed_inputs_are_read_or_one_clear_error_and_reach_most_branches(kind):
    done = fuzz.batch(kind, seed=7, number=0, count=300, is_traced=True)
    assert done["failures"] == []
    assert done["counts"]["read"] > 30
    assert done["counts"]["error"] > 30
    assert len(done["branches"]) > 0.7 * len(fuzz.branches_of(kind).lines)


@pytest.mark.parametrize("ending", image_inputs.ENDINGS)
def test_unchanged_image_files_are_images_or_refused_by_name(tmp_path, ending):
    path = tmp_path / f"a{ending}"
    for data in image_inputs.refused(ending):
        path.write_bytes(data)
        with pytest.raises(InputError):
            read_image(path, image_inputs.VIEWED)
    for data in image_inputs.whole(ending):
        path.write_bytes(data)
        assert read_image(path, image_inputs.VIEWED).values.shape == (3, *image_inputs.SIZE)


def batch_of(monkeypatch, kind, read) -> list[dict[str, object]]:
    """Failures of a batch of three, read so."""
    monkeypatch.setitem(fuzz.KINDS, kind, replace(fuzz.KINDS[kind], read=read))
    return fuzz.batch(kind, seed=7, number=0, count=3)["failures"]


@pytest.mark.parametrize("kind", fuzz.KINDS)
@pytest.mark.parametrize("wrong", [ValueError, MemoryError, RecursionError, InputError("a", 1, "b" * 3000)])
def test_any_other_exception_and_errors_that_are_not_clear_are_failures(monkeypatch, kind, wrong):
    """The control: a reader that raises something else is found out."""

    def read(*_: object) -> None:
        raise wrong

    assert len(batch_of(monkeypatch, kind, read)) == 3


def test_warnings_of_numpy_are_failures(monkeypatch):
    assert len(batch_of(monkeypatch, "pfm", lambda *_: warnings.warn("no", RuntimeWarning, stacklevel=1))) == 3


def test_what_is_printed_and_what_is_written_are_failures(monkeypatch):
    assert "hello" in str(batch_of(monkeypatch, "exr", lambda *_: os.write(1, b"hello")))
    assert "extra" in str(batch_of(monkeypatch, "exr", lambda path, _: path.with_name("extra").touch()))


@pytest.mark.parametrize("kind", fuzz.KINDS)
def test_inputs_differ_and_are_bounded(kind):
    rng = Random(5)
    made = [fuzz.KINDS[kind].make(rng) for _ in range(100)]
    assert len(set(made)) > 80
    assert max(map(len, made)) <= scene_inputs.LONGEST


def test_branches_are_counted_both_ways(tmp_path: Path):
    path = tmp_path / "small.py"
    path.write_text("def f(x):\n    y = 1 if x else 2\n    for _ in range(x):\n        y += 1\n    return y\n")
    branches, names = Branches([path]), {}
    exec(compile(path.read_text(), str(path), "exec"), names)
    assert len(branches.lines) == 4
    assert branches.run(lambda: names["f"](0)) == 2
    assert branches.missed() == ["small.py:2", "small.py:3"]
    assert len(branches.seen) == 2
    branches.run(lambda: names["f"](2))
    assert branches.missed() == []
