"""A sweep killed at a moment ends with the rows of an undisturbed one; fifty are tried by `kill_sweep.py`."""

from __future__ import annotations

import kill_sweep
import pytest
from click.testing import CliRunner

from nusselt.experiments.cli.main import main
from nusselt.experiments.results.store import read_archive, write_archive

pytestmark = pytest.mark.mitsuba


def swept(out):
    """The sweep's rows, run to the end in this process."""
    result = CliRunner().invoke(main, kill_sweep.command(out)[3:])
    assert result.exit_code == 0, result.output
    return kill_sweep.rows(out)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    out = tmp_path_factory.mktemp("undisturbed")
    return out, swept(out)


def test_a_killed_sweep_ends_with_the_same_rows(undisturbed, tmp_path):
    out, right = undisturbed
    jobs = kill_sweep.killed(tmp_path, lambda: kill_sweep.done(tmp_path) > 0)
    assert jobs < kill_sweep.done(out)
    assert swept(tmp_path) == right
    assert len(right) > 10


def test_a_lost_row_is_seen(undisturbed):
    """The planted defect: a job's rows, halved on disk."""
    out, right = undisturbed
    job = max((out / "jobs").glob("*.npz"), key=lambda path: len(read_archive(path)[0]["rows"]))
    words, arrays = read_archive(job)
    write_archive(job, {"rows": words["rows"][: len(words["rows"]) // 2]}, arrays)
    assert swept(out) != right
