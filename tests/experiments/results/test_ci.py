"""A renderer in CI: what is planted is named in each format and by the exit status; of a right one nothing is."""

from __future__ import annotations

import copy
import json
import os
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml
from builders import floor, lamp, scene
from places import ROOT

import nusselt
from nusselt.experiments.results.compare import compare_rows
from nusselt.experiments.results.compare.files import junit, markdown
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render
from nusselt.renderer.scene_text import write_scene

ROOM = scene(
    floor(4.0),
    lights=(lamp(2.0, 0.8), lamp(3.0, 0.4)),
    size=(128, 96),
    light_samples=16,
    stratify=True,
    name="room",
)
SMALL = ROOM.with_(width=80, height=60)
"""Where nothing is planted that pixels would have to find."""
ALPHA = 1e-7
"""Of one comparison; ten of right renderers are 1e-6."""


def mean_of(given, samples: int, seed: int) -> np.ndarray:
    return render(given, Area(samples=samples, stratified=True), seed=seed).mean.transpose(1, 2, 0)


def noisier(given, samples: int, seed: int) -> np.ndarray:
    """A tenth more variance: two images, weighed so that the squares of their weights add up to 1.1."""
    share = (1 - np.sqrt(1.2)) / 2
    return (1 - share) * mean_of(given, samples, seed) + share * mean_of(given, samples, seed + 1000)


PLANTED = {
    "biased": lambda *given: 1.002 * mean_of(*given),
    "noisier": noisier,
    "a light lost": lambda given, *rest: mean_of(given.with_(lights=given.lights[:1]), *rest),
}
NAMED = {"biased": "bias", "noisier": "variance", "a light lost": "bias"}


def rows_of(renderer, seed: int, room=ROOM) -> list[dict]:
    """A row, as `check --renderer` of four runs has it."""
    return nusselt.check(room, renderer=renderer, seed=seed, runs=6, steps=1, margin=5e-3, alpha=ALPHA).rows


@pytest.fixture(scope="module")
def baseline() -> list[dict]:
    return rows_of(mean_of, 0)


def test_ten_runs_of_a_right_renderer_are_silent():
    baseline = rows_of(mean_of, 0, SMALL)
    for seed in range(1, 11):
        found = compare_rows(baseline, rows_of(mean_of, 10 * seed, SMALL), ALPHA)
        assert found.lines()[0] == "Nothing changed beyond noise."
        assert (found.status, found.tests) == (0, 3)
        assert "<failure" not in junit(found)
        assert markdown(found).startswith("## ✅")


@pytest.mark.parametrize("name", PLANTED)
def test_what_is_planted_is_named_everywhere(baseline, name):
    rows = rows_of(PLANTED[name], 200)
    found = compare_rows(baseline, rows, ALPHA)
    assert found.status == 1
    assert NAMED[name] in {change.figure for change in found.changes}
    (case,) = ElementTree.fromstring(junit(found))
    failure = case.find("failure")
    assert failure is not None
    assert NAMED[name] in failure.get("message", "")
    assert f"{NAMED[name]} " in markdown(found).split("\n\n")[1]


def test_half_as_long_again_is_told_and_no_failure(baseline):
    slow = copy.deepcopy(baseline)
    slow[0]["convergence"]["rows"][0]["seconds_median"] *= 1.5
    found = compare_rows(baseline, slow, ALPHA)
    assert found.status == 0
    assert "took 1.50 times as long" in "\n".join(found.lines())
    assert "took 1.50 times" in markdown(found)


SCRIPT = """
import sys
import numpy as np
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render
from nusselt.renderer.scene_text import read_scene

scene, seed, output, gain = sys.argv[1:]
image = render(read_scene(scene), Area(samples=16, stratified=True), seed=int(seed))
np.save(output, float(gain) * image.mean.transpose(1, 2, 0))
"""


def judge(folder: Path, gain: float, seed: int, **further: str) -> int:
    """The recipe that the action and people's shells run."""
    command = f"{sys.executable} mine.py {{scene}} {{seed}} {{output}} {gain}"
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    options = f"--runs 2 --steps 1 --image-type .npy --margin 0.05 --seed {seed}"
    said = {"PATH": path, "SCENES": "room.test", "RENDERER": command, "OPTIONS": options, **further}
    recipe = ["sh", str(ROOT / ".github" / "judge.sh")]
    return subprocess.run(recipe, cwd=folder, env=os.environ | said, capture_output=True, check=False).returncode


def test_the_recipe_leaves_verdicts_changes_and_a_report(tmp_path):
    (tmp_path / "mine.py").write_text(SCRIPT)
    (tmp_path / "room.test").write_text(write_scene(SMALL))
    assert judge(tmp_path, 1.0, 0, OUT="first") == 0
    summary = tmp_path / "summary.md"
    status = judge(tmp_path, 1.02, 50, OUT="second", BASELINE="first/results.json", SUMMARY=str(summary))
    assert status == 1  # within its margin of the truth, and yet worse than it was
    assert json.loads((tmp_path / "second" / "results.json").read_text())["rows"][0]["verdict"] == "agrees"
    left = {path.name for path in (tmp_path / "second").iterdir()}
    assert {"report.html", "verdicts.xml", "changes.xml", "changes.json"} <= left
    assert "bias" in summary.read_text()
    again = {"OUT": "second", "BASELINE": "first/results.json", "RENDERER": "no-such-program {output}"}
    assert judge(tmp_path, 1.0, 0, **again) == 2  # what the run before left there is not compared
    assert not (tmp_path / "second" / "results.json").exists()


def test_the_action_runs_the_recipe_with_what_it_is_given():
    action = yaml.safe_load((ROOT / "action.yml").read_text())
    (step,) = (step for step in action["runs"]["steps"] if "judge.sh" in step.get("run", ""))
    assert {f"${{{{ inputs.{name.lower()} }}}}" for name in step["env"]} == set(step["env"].values())
    assert {name.lower() for name in step["env"]} == set(action["inputs"])
    recipe = (ROOT / ".github" / "judge.sh").read_text()
    assert all(name in recipe for name in step["env"])
