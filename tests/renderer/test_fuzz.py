"""A short run of the long fuzz; the long one is `python tests/support/fuzz_scenes.py --inputs 1000000`."""

import fuzz_scenes
import numpy as np
import pytest


def test_mutated_scenes_give_a_scene_or_one_clear_error_and_write_nothing():
    done = fuzz_scenes.batch(seed=7, number=0, count=400)
    assert done["failures"] == []
    assert done["counts"]["scene"] > 10
    assert done["counts"]["error"] > 100


@pytest.mark.parametrize("wrong", [ValueError, MemoryError, RecursionError])
def test_any_other_exception_is_a_failure(monkeypatch, wrong):
    """The control: a reader that raises something else is found out."""

    def refuse(*_: object, **__: object) -> None:
        raise wrong("no")

    monkeypatch.setattr(fuzz_scenes, "read_scene", refuse)
    done = fuzz_scenes.batch(seed=7, number=0, count=3)
    assert len(done["failures"]) == 3


def test_inputs_differ_and_are_bounded():
    rng = np.random.default_rng(5)
    made = [fuzz_scenes.text(rng) for _ in range(100)]
    assert len(set(made)) == 100
    assert max(map(len, made)) <= fuzz_scenes.LONGEST
