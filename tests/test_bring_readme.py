"""The worked examples of the README, run as they are written."""

from __future__ import annotations

import json
import os
import re
import shlex
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from nusselt.experiments.cli.main import main

TEXT = (Path(__file__).parent.parent / "README.md").read_text(encoding="utf-8")
OWN = TEXT[TEXT.index("## Bring your own") :]
SHELL = re.findall(r"```sh\n(.*?)```", OWN, re.DOTALL)
PYTHON = re.findall(r"```python\n(.*?)```", OWN, re.DOTALL)


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    """An empty folder, and this interpreter's commands."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    root = str(Path(__file__).parent.parent)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, [root, os.environ.get("PYTHONPATH")])))
    return tmp_path


def run(block: str, *more: str) -> dict:
    """Run every command of a block; the last one's results."""
    commands = [shlex.split(line) for line in block.strip().splitlines()]
    for words in commands:
        last = words is commands[-1]
        assert words[0] == "nusselt"
        result = CliRunner().invoke(main, [*words[1:], *(more if last else ())], catch_exceptions=False)
        assert result.exit_code == 0, result.output
    return json.loads(Path(more[-1]).read_text()) if more else {}


def test_the_example_of_images():
    (row,) = run(SHELL[0], "--json", "results.json")["rows"]
    assert row["verdict"] == "agrees"
    assert row["passes"] == 2
    assert [round(abs(score["bias"]), 1) for score in row["course_scores"]] == [0.0, 0.0]
    assert [round(score["mse"], 1) for score in row["course_scores"]] == [3.8, 3.8]  # as the course printed
    low, high = row["course_expected"]["mse"]
    assert low < 3.8 < high
    assert row["quantisation"]["rule"] == "truncate"
    assert row["likely_mistakes"] == []


def test_the_example_of_an_estimator(tmp_path):
    code = PYTHON[0]
    assert len(code.strip().splitlines()) < 30
    (tmp_path / "my_estimator.py").write_text(code, encoding="utf-8")
    try:
        found = run(SHELL[1], "--json", "trials.json")
    finally:
        sys.modules.pop("my_estimator", None)
        sys.path[:] = [entry for entry in sys.path if entry != str(tmp_path)]
    assert len(found["trials"]) == 6
    assert all(trial["passed"] for trial in found["trials"])
    assert found["rows"][0]["verdict"] == "agrees"
    assert [row["samples"] for row in found["error_against_time"]] == [4, 16, 64]


def test_the_example_of_a_renderer():
    (row,) = run(SHELL[2], "--json", "results.json")["rows"]
    assert row["verdict"] == "agrees", row["reason"]
    assert row["estimator"] == "renderer"
    assert [entry["samples"] for entry in row["convergence"]["rows"]] == [16, 64]
    assert all(len(entry["seconds"]) == 2 for entry in row["convergence"]["rows"])
    assert row["convergence"]["slope_samples"] < -0.4
