"""A short run of the long fuzz; the long one is `python tests/support/fuzz_files.py scene obj ply --inputs 1000000`."""

from pathlib import Path

import fuzz_files
import numpy as np
import pytest
from branches import Branches


@pytest.mark.parametrize("kind", fuzz_files.FILES)
def test_changed_inputs_are_read_or_one_clear_error_and_reach_most_branches(kind):
    done = fuzz_files.batch(kind, seed=7, number=0, count=300, is_traced=True)
    assert done["failures"] == []
    assert done["counts"]["read"] > 30
    assert done["counts"]["error"] > 30
    assert len(done["branches"]) > 0.75 * len(fuzz_files.branches_of(kind).lines)


@pytest.mark.parametrize("kind", fuzz_files.FILES)
@pytest.mark.parametrize("wrong", [ValueError, MemoryError, RecursionError, RuntimeWarning])
def test_any_other_exception_is_a_failure(monkeypatch, kind, wrong):
    """The control: a reader that raises something else is found out."""

    def refuse(*_: object, **__: object) -> None:
        raise wrong("no")

    monkeypatch.setattr(fuzz_files, "read_scene", refuse)
    monkeypatch.setattr(fuzz_files, "read_mesh_file", refuse)
    assert len(fuzz_files.batch(kind, seed=7, number=0, count=3)["failures"]) == 3


@pytest.mark.parametrize("kind", fuzz_files.FILES)
def test_inputs_differ_and_are_bounded(kind):
    rng = np.random.default_rng(5)
    made = [fuzz_files.made(kind, rng) for _ in range(100)]
    assert len(set(made)) > 80
    assert max(map(len, made)) <= fuzz_files.LONGEST


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
