"""The worked examples of the README, run as they are written."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from places import ROOT
from test_cli import SMALL

import nusselt
from nusselt.experiments.cli.main import main
from nusselt.renderer.estimators import Area
from nusselt.renderer.scene_text import parse_scene

pytestmark = pytest.mark.mitsuba

TEXT = (ROOT / "README.md").read_text(encoding="utf-8")
OWN = TEXT[TEXT.index("## Bring your own") :]
FRONT = TEXT[TEXT.index("## From Python") : TEXT.index("## The report")]
SHELL = re.findall(r"```sh\n(.*?)```", OWN, re.DOTALL)
PYTHON = re.findall(r"```python\n(.*?)```", OWN, re.DOTALL)
CALLS, TEST, RENDERER = re.findall(r"```python\n(.*?)```", FRONT, re.DOTALL)


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    """An empty folder, and this interpreter's commands."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    root = str(ROOT)
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


def test_the_three_lines(tmp_path):
    """As they stand, but for fewer pixels, samples and so another margin; ./mine is our own renderer."""
    _, check, report = re.findall(r"```\n(.*?)```", TEXT, re.DOTALL)[0].strip().splitlines()
    own(tmp_path / "mine", "import sys\n_, scene, _, samples, _, seed, _, output = sys.argv")
    less = ("--width", "48", "--steps", "2", "--margin", "0.01")
    rows = run(check.removeprefix(".venv/bin/"), *less, "--json", "out/results.json")["rows"]
    assert [(row["scene"], row["samples"]) for row in rows] == [("quad", 64), ("cornell-boxes", 64)]
    for row in rows:
        assert row["verdict"] == "agrees", row["reason"]
        assert row["pixels"]["shaded"] < 48 * 48
    run(report.removeprefix(".venv/bin/"))
    assert (tmp_path / "out" / "report.html").stat().st_size > 10_000


def test_the_example_of_a_scene():
    (text,) = re.findall(
        r"```\n(# A square.*?)```", (ROOT / "docs" / "scenes.md").read_text(encoding="utf-8"), re.DOTALL
    )
    assert parse_scene(text).with_(name="quad").digest() == nusselt.read_scene("quad").digest()


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


@pytest.mark.slow
def test_the_example_of_an_estimator_in_a_study(tmp_path, monkeypatch):
    (tmp_path / "my_estimator.py").write_text(PYTHON[0], encoding="utf-8")
    monkeypatch.setattr(sys, "path", [*sys.path])
    try:
        rows = run(SHELL[2], "--json", "results.json")["rows"]
    finally:
        sys.modules.pop("my_estimator", None)
    assert [row["series"] for row in rows] == ["random", "stratified", "shifted-lattice"]
    assert (tmp_path / "out" / "convergence" / "quad.svg").exists()


def test_the_example_of_a_renderer():
    (row,) = run(SHELL[3], "--json", "results.json")["rows"]
    assert row["verdict"] == "agrees", row["reason"]
    assert row["estimator"] == "renderer"
    assert [entry["samples"] for entry in row["convergence"]["rows"]] == [16, 64]
    assert all(len(entry["seconds"]) == 2 for entry in row["convergence"]["rows"])
    assert row["convergence"]["slope_samples"] < -0.4


MINE = """
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render

def my_render(scene, samples, seed):
    return render(scene, Area(samples=samples, stratified=True), seed=seed).mean.transpose(1, 2, 0)
"""


OWN_PROGRAM = """#!{python}
from pathlib import Path
{arguments}
from nusselt.experiments.images.write import write_image
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render
from nusselt.renderer.scene_text import read_scene
write_image(Path(output), render(read_scene(scene), Area(samples=int(samples)), seed=int(seed)).mean)
"""


def own(path: Path, arguments: str) -> None:
    """A program of one's own."""
    path.write_text(OWN_PROGRAM.format(python=sys.executable, arguments=arguments))
    path.chmod(0o755)


def box(folder: Path) -> None:
    (folder / "box.test").write_text(SMALL.replace("size 24 18", "size 64 48"))


@pytest.mark.slow
def test_the_examples_of_the_front_door(tmp_path):
    names: dict = {}
    exec(MINE, names)
    box(tmp_path)
    scene = nusselt.read_scene("box.test")
    names |= {"MyEstimator": Area, "first": names["my_render"](scene, 64, 1)}
    np.save("second.npy", names["my_render"](scene, 64, 2))
    own(tmp_path / "mine", "import sys\n_, scene, samples, seed, output = sys.argv")
    exec(CALLS, names)
    assert names["results"].agrees, str(names["results"])
    assert names["image"].shape == (*names["image"].shape[:2], 3)
    assert (tmp_path / "report.html").exists()


def test_the_example_of_the_plug_in(tmp_path):
    (tmp_path / "my_renderer.py").write_text(MINE)
    (tmp_path / "test_mine.py").write_text(TEST)
    box(tmp_path)
    words = [sys.executable, "-m", "pytest", "-q", "-p", "nusselt.pytest_plugin", "-p", "no:xdist", "--rootdir", "."]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_the_example_of_the_renderer(tmp_path):
    (tmp_path / "my.test").write_text(SMALL)
    names: dict = {}
    exec(RENDERER, names)
    assert names["image"].mean.shape == (3, 18, 24)
