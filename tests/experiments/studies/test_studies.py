"""Every experiment, tiny: its rows are what the schema says, its figures are drawn, its table and texts are told.

No claim is looked at: with next to no samples none needs to hold.
"""

from __future__ import annotations

import csv
from contextlib import nullcontext

import pytest

from nusselt.experiments.results.document import read_json
from nusselt.experiments.results.report import write_report
from nusselt.experiments.results.schema import ROW, names
from nusselt.experiments.runs import run
from nusselt.experiments.runs.experiment import Settings
from nusselt.experiments.runs.run import Request, run_experiments
from nusselt.experiments.studies.suite import EXPERIMENTS

pytestmark = pytest.mark.mitsuba

SLOW = ("calibration", "error-against-time", "mesh-cost")
"""Over ten seconds of processor time."""


def marked(experiment):
    slow = (pytest.mark.slow,) if experiment.name in SLOW else ()
    return pytest.param(experiment, id=experiment.name, marks=slow)


@pytest.mark.parametrize("experiment", [marked(experiment) for experiment in EXPERIMENTS])
def test_all_of_a_study_runs(experiment, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(run, "worker_pool", nullcontext)  # starting workers takes longer than the jobs
    monkeypatch.setenv("COLUMNS", "80")
    run_experiments([experiment], Request(Settings(tiny=True, seed=3), out=tmp_path))
    told = capsys.readouterr().out.splitlines()
    assert not [line for line in told if "…" in line], "a cell that is cut off"
    assert max((len(line) for line in told if "─" in line), default=0) <= 80
    rows = read_json(tmp_path / "results.json")["rows"]
    assert rows
    for row in rows:
        assert not set(row) - set(names(ROW)), "an entry that nobody explains"
        assert "as_claimed" in row
        assert row["command"].startswith(f"nusselt run {experiment.name}")
    files = {path.suffix: path for path in (tmp_path / experiment.name).iterdir()}
    assert files.keys() >= {".png", ".svg", ".csv"}
    assert ".md" in files or experiment.text is None
    with files[".csv"].open(newline="") as stream:
        assert len(list(csv.DictReader(stream))) == len(rows)
    assert write_report(tmp_path, tmp_path / "page.html") == len(rows)
