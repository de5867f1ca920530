"""A sweep killed at a moment ends with the rows of an undisturbed one; fifty are tried by `kill_sweep.py`."""

from __future__ import annotations

import kill_sweep
import pytest

from nusselt.experiments.results.store import read_archive, write_archive

pytestmark = pytest.mark.mitsuba


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    out = tmp_path_factory.mktemp("undisturbed")
    return out, kill_sweep.whole(out), kill_sweep.rows(out)


def test_a_killed_sweep_ends_with_the_same_rows(undisturbed, tmp_path):
    _, seconds, right = undisturbed
    kill_sweep.killed(tmp_path, 0.6 * seconds)
    kill_sweep.whole(tmp_path)
    assert kill_sweep.rows(tmp_path) == right
    assert len(right) > 10


def test_a_lost_row_is_seen(undisturbed):
    """The planted defect: a job's rows, halved on disk."""
    out, _, right = undisturbed
    job = max((out / "jobs").glob("*.npz"), key=lambda path: len(read_archive(path)[0]["rows"]))
    words, arrays = read_archive(job)
    write_archive(job, {"rows": words["rows"][: len(words["rows"]) // 2]}, arrays)
    kill_sweep.whole(out)
    assert kill_sweep.rows(out) != right
