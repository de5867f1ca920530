"""Experiments: run, resumed, interrupted, refused; every one of them declared whole."""

from __future__ import annotations

import csv
import json
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from nusselt.experiments.cli import run as run_file
from nusselt.experiments.cli.main import main
from nusselt.experiments.results.figures import curves
from nusselt.experiments.results.store import Store
from nusselt.experiments.runs import run as command
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.experiments.runs.run import Request, run_experiments, run_one
from nusselt.experiments.runs.runner import run_jobs
from nusselt.experiments.runs.store import key
from nusselt.experiments.studies import suite
from nusselt.experiments.studies.analog_projection import disk_area
from nusselt.renderer.estimators import Area

CALLS: list[int] = []


def square(number: int, seed: int) -> Outcome:
    CALLS.append(number)
    if number == 99:
        raise KeyboardInterrupt
    rows = [{"number": number, "square": number**2, "odd": float("nan"), "as_claimed": True}]
    return Outcome(rows, {"curve": np.arange(number, dtype=float)})


def squares(numbers):
    return lambda settings: [Job(square, {"number": n, "seed": settings.seed}) for n in numbers]


def drawn(outcomes):
    line = [outcome.rows[0]["number"] for outcome in outcomes]
    return {"squares": curves({"squares": (line, line)}, "x", "y", "nothing, no samples, no seed")}


def tiny(numbers=(1, 2, 3)) -> Experiment:
    return Experiment("tiny", "squares", squares(numbers), drawn)


def run(*arguments: object) -> tuple[int, str, str]:
    result = CliRunner().invoke(main, [str(a) for a in arguments])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stdout, result.stderr


def test_a_run_writes_rows_figures_and_table_and_a_second_one_computes_nothing(tmp_path):
    request = Request(Settings(seed=5), out=tmp_path)
    CALLS.clear()
    first, _ = run_one(tiny(), request)
    assert CALLS == [1, 2, 3]
    again, outcomes = run_one(tiny(), request)
    assert CALLS == [1, 2, 3]
    assert again == first
    assert [outcome.arrays["curve"].tolist() for outcome in outcomes] == [[0], [0, 1], [0, 1, 2]]
    assert [row["experiment"] for row in first] == ["tiny"] * 3
    assert first[0]["command"] == "nusselt run tiny --seed 5"
    assert {p.name for p in (tmp_path / "tiny").iterdir()} == {"squares.png", "squares.svg", "rows.csv"}
    with (tmp_path / "tiny" / "rows.csv").open(newline="") as stream:
        assert [row["square"] for row in csv.DictReader(stream)] == ["1", "4", "9"]
    assert not list(tmp_path.rglob(".*"))


def test_what_was_finished_before_an_interrupt_is_kept(tmp_path):
    request = Request(Settings(), out=tmp_path)
    CALLS.clear()
    with pytest.raises(KeyboardInterrupt):
        run_one(tiny((1, 2, 99)), request)
    run_one(tiny((1, 2, 3)), request)
    assert CALLS == [1, 2, 99, 3]


def test_a_damaged_record_is_computed_again(tmp_path):
    store, (job, *_) = Store(tmp_path), squares((7,))(Settings())
    run_jobs([job], store)
    (tmp_path / f"{key(job)}.npz").write_bytes(b"not an archive")
    CALLS.clear()
    assert run_jobs([job], store)[0].rows[0]["square"] == 49
    assert CALLS == [7]


def test_any_executor_gives_the_same_rows(tmp_path):
    jobs = squares(range(1, 9))(Settings())
    with ThreadPoolExecutor(3) as pool:
        spread = run_jobs(jobs, Store(None), pool)
    assert [outcome.rows for outcome in spread] == [outcome.rows for outcome in run_jobs(jobs, Store(None))]


def test_a_jobs_key_knows_everything_it_is_given():
    def made(**change):
        return key(Job(square, {"number": 1, "estimator": Area(samples=4), "seed": 0} | change))

    keys = {made(), made(number=2), made(seed=1), made(estimator=Area(samples=9)), made(more=[1, 2])}
    assert len(keys) == 5
    assert made() == made()


@pytest.fixture
def without_workers(monkeypatch):
    """Jobs of no length run here: starting workers would take longer than the test."""
    monkeypatch.setattr(command, "worker_pool", nullcontext)


def test_no_row_is_a_failure(without_workers):
    nothing = Experiment("nothing", "no row", lambda settings: [], lambda outcomes: {})
    assert run_experiments([nothing], Request(Settings())) == 1
    assert run_experiments([tiny()], Request(Settings())) == 0
    assert run_experiments([tiny(), nothing], Request(Settings())) == 1


def test_results_go_to_standard_output(monkeypatch, without_workers):
    monkeypatch.setattr(run_file, "EXPERIMENTS", (tiny(),))
    status, said, told = run("run", "tiny", "--json", "-", "--seed", 3)
    results = json.loads(said)
    assert status == 0
    assert [row["square"] for row in results["rows"]] == [1, 4, 9]
    assert results["rows"][0]["odd"] is None
    assert results["seed"] == 3
    assert "squares" in told


@pytest.mark.parametrize("arguments", [("nonsense",), (), ("tiny", "nonsense"), ("analytic", "--scenes", "no-such")])
def test_bad_names_are_one_line_and_status_2(arguments, tmp_path):
    status, said, error = run("run", *arguments, "--out", tmp_path / "out")
    assert status == 2
    assert said == ""
    assert len(error.strip().splitlines()) <= 4
    assert not (tmp_path / "out").exists()


def test_scenes_an_experiment_cannot_use_are_refused():
    status, _, error = run("run", "analytic", "--quick", "--scenes", "cornell")
    assert status == 2
    assert "nothing blocks" in error


def test_every_experiment_is_declared_once_and_is_a_script():
    names = [experiment.name for experiment in suite.EXPERIMENTS]
    assert len(set(names)) == len(names)
    folder = Path(suite.__file__).parent
    scripts = []
    for path in folder.rglob("*.py"):
        called = re.search(r"^    script\(([\w, ]+)\)$", path.read_text(), re.MULTILINE)
        if called:
            parts = path.relative_to(folder).with_suffix("").parts
            module = import_module(".".join(("nusselt.experiments.studies", *parts)))
            scripts += [getattr(module, name) for name in called[1].split(", ")]
    _, said, _ = run("list")
    for experiment in suite.EXPERIMENTS:
        assert f"  {experiment.name} " in said
        assert experiment in scripts
        jobs = experiment.jobs(Settings(quick=True))
        assert jobs
        assert len({key(job) for job in jobs}) == len(jobs)


def test_an_experiment_runs_as_a_script(tmp_path):
    """In a folder of its own name's module: its neighbours must not hide the standard library."""
    script = Path(suite.__file__).parent / "nusselt_analog.py"
    done = subprocess.run(
        [sys.executable, script, "--quick", "--out", tmp_path], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    rows = json.loads((tmp_path / "results.json").read_text())["rows"]
    assert len(rows) == 20
    assert all(row["as_claimed"] for row in rows)
    assert {p.name for p in (tmp_path / "nusselt-analog").iterdir()} == {"emblem.png", "emblem.svg", "rows.csv"}


def test_the_disk_knows_where_a_horizon_cuts():
    """A square that stands on the horizon: the closed integral over its azimuths, and half of it sunk."""
    corners = np.array([[1, 1, 1, 1], [-1, 1, 1, -1], [0, 0, 1, 1]], dtype=float)
    up, here = np.array([0.0, 0.0, 2.0]), np.zeros(3)
    exact = np.pi / 4 - np.arctan(1 / np.sqrt(2)) / np.sqrt(2)
    assert disk_area(here, up, corners) == pytest.approx(exact, abs=1e-14)
    sunk = corners * [[1], [1], [2]] - [[0], [0], [1]]
    assert disk_area(here, up, sunk) == pytest.approx(exact, abs=1e-14)
    assert disk_area(here, -up, corners) == 0.0


def test_no_experiment_hides_a_module_of_the_standard_library():
    """A script's folder comes first where Python looks."""
    names = {path.stem for path in Path(suite.__file__).parent.iterdir()}
    assert not names & sys.stdlib_module_names
