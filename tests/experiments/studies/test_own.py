"""A stranger's estimator and renderer stand beside ours and Mitsuba's in the studies' tables and figures."""

from __future__ import annotations

import shlex
import subprocess
import sys

import pytest
from builders import floor, lamp, scene
from test_cli import run

from nusselt.experiments.runs.experiment import Outcome
from nusselt.experiments.runs.own import own_of
from nusselt.experiments.studies import convergence, variance_table
from nusselt.experiments.studies.race import study as race
from nusselt.experiments.studies.race.measure import Plan
from nusselt.mitsuba_bridge.llvm import backend
from nusselt.mitsuba_bridge.race import DEFAULT, Way

pytestmark = pytest.mark.mitsuba

needs_llvm = pytest.mark.skipif(backend().variant == "scalar_rgb", reason="Mitsuba's LLVM variant does not run here")

ESTIMATOR = """
from dataclasses import dataclass
from typing import ClassVar
from nusselt.renderer.estimators import Area

@dataclass(frozen=True, kw_only=True)
class Halved(Area):
    '''Half of the samples asked for: twice the variance.'''
    name: ClassVar[str] = "halved"

    def __call__(self, points, source, rng):
        return Area(samples=max(self.samples // 2, 1))(points, source, rng)

@dataclass(frozen=True, kw_only=True)
class Area2(Area):
    pass
"""
RENDERER = """
import sys
from pathlib import Path
from nusselt.experiments.images.write import write_image
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render
from nusselt.renderer.scene_text import read_scene

scene, samples, seed, output = sys.argv[1:]
write_image(Path(output), render(read_scene(scene), Area(samples=int(samples)), seed=int(seed)).mean)
"""


@pytest.fixture
def strangers(tmp_path, monkeypatch):
    """A folder with a stranger's estimator and renderer; the words that name them."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "stranger.py").write_text(ESTIMATOR)
    (tmp_path / "render.py").write_text(RENDERER)
    yield "stranger:Halved", f"{shlex.quote(sys.executable)} render.py {{scene}} {{samples}} {{seed}} {{output}}"
    sys.modules.pop("stranger", None)


def tiny():
    return scene(floor(), lights=(lamp(),), size=(16, 12), name="floor")


def labels(figure) -> set[str]:
    return {line.get_label().partition(":")[0] for line in figure.axes[0].lines}


@needs_llvm
@pytest.mark.slow
def test_in_the_variance_table(strangers):
    estimator, command = strangers
    own = own_of([estimator], [command])
    rows = variance_table.scene_rows(tiny(), (16,), 4, 1, 60.0, own)
    found = {row["estimator"]: row for row in rows}
    assert {"halved", "own renderer", "area random", "Mitsuba independent"} <= found.keys()
    assert 1.4 < found["halved"]["variance"] / found["area random"]["variance"] < 2.8
    assert 0.4 < found["own renderer"]["variance"] / found["area random"]["variance"] < 2.5
    assert all(row["as_claimed"] for row in rows)
    assert "halved" in variance_table.markdown(rows)
    (figure,) = variance_table.figures([Outcome(rows)]).values()
    assert {"halved", "own renderer", "Mitsuba independent"} <= labels(figure)


def test_in_convergence(strangers):
    estimator, command = strangers
    outcome = convergence.fit(tiny(), (2, 3, 4), 1, 3, own_of([estimator], [command]))
    found = {row["series"]: row for row in outcome.rows}
    assert list(found) == ["random", "stratified", "halved", "own renderer"]
    assert -0.8 < found["halved"]["slope"] < -0.3
    assert -0.8 < found["own renderer"]["slope"] < -0.3
    (figure,) = convergence.figures([outcome]).values()
    assert labels(figure) == set(found)


@needs_llvm
@pytest.mark.slow
def test_in_error_against_time_with_a_figure(strangers):
    estimator, command = strangers
    plan = Plan(sizes=(4, 16), truth=1e-3, longest=60.0, ways=(Way("multijitter", 0), DEFAULT))
    rows, measured = race.run(["quad"], plan=plan, side=16, count=1, own=own_of([estimator], [command]))
    own = [row for row in rows if "own" in row]
    assert [(row["pixel_rule"], row["estimator"], row["target"]) for row in own[:2]] == [
        ("area", "halved", 1e-2),
        ("area", "own renderer", 1e-2),
    ]
    assert all(row["as_claimed"] and row["own"]["seconds"] > 0 and row["mitsuba_over_own"] > 0 for row in own)
    for name in ("halved", "own renderer"):
        few, many = (lap.error for lap in measured["quad/centre"][0].own[0] if lap.estimator == name)
        assert many < 0.8 * few < 1
    figure = race.figure("quad", [race.raw(one) for one in measured["quad/area"]])
    assert {"halved", "own renderer", "ours"} <= labels(figure)


def test_strata_are_a_row_of_their_own_where_they_make_a_difference(strangers):
    own = own_of([strangers[0]], [])
    assert list(own.estimators[0].ways(tiny())) == ["halved"]


def test_a_changed_source_is_another_job(strangers, tmp_path):
    estimator, command = strangers
    before = own_of([estimator], [command])
    assert own_of([estimator], [command]) == before
    (tmp_path / "stranger.py").write_text(ESTIMATOR + "\n")
    (tmp_path / "render.py").write_text(RENDERER + "\n")
    after = own_of([estimator], [command])
    assert after.estimators[0].digest != before.estimators[0].digest
    assert after.renderers[0].digest != before.renderers[0].digest


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("convergence", "--with", "no_such_module:Name"), "--with = no_such_module:Name"),
        (("convergence", "--with", "stranger:Area2"), "--with = stranger:Area2"),
        (("convergence", "--with-renderer", "a program"), "--with-renderer = a program"),
        (("analytic", "--with", "stranger:Halved"), "experiment = analytic"),
    ],
)
def test_what_cannot_join_is_one_clear_error(strangers, words, said):
    status, _, error = run("run", *words)
    assert status == 2
    assert said in error
    assert len(error.strip().splitlines()) == 1


SCENE = """size 48 36
camera 0 1.5 4 0 0 0 0 1 0 40
integrator direct
lightsamples 16
vertex -2 0 2
vertex 2 0 2
vertex 2 0 -2
vertex -2 0 -2
diffuse .5 .4 .3
tri 0 1 2
tri 0 2 3
quadLight -.5 3 -.5 0 0 1 1 0 0 5 5 5
"""

NUMPY_RENDERER = """
import numpy as np

def unit(v):
    return v / np.linalg.norm(v)

def render(scene, samples, seed):
    rng, camera, light = np.random.default_rng(seed), scene.camera, scene.lights[0]
    eye = np.array(camera.position)
    forward = unit(np.array(camera.target) - eye)
    right = unit(np.cross(forward, camera.up))
    up, half = np.cross(right, forward), np.tan(np.radians(camera.fov_y) / 2)
    y, x = np.mgrid[: scene.height, : scene.width] + 0.5
    across = (2 * x / scene.width - 1) * scene.width / scene.height
    d = forward + half * (across[..., None] * right + (1 - 2 * y / scene.height)[..., None] * up)
    p = eye - d * (eye[1] / d[..., 1])[..., None]
    hit = (d[..., 1] < 0) & (np.abs(p[..., ::2]) < 2).all(axis=-1)
    u, v = rng.random((2, *hit.shape, samples, 1))
    to = np.array(light.corner) + u * light.ab + v * light.ac - p[..., None, :]
    square = (to**2).sum(axis=-1)
    area = np.linalg.norm(np.cross(light.ab, light.ac))
    geometry = (area * COSINES / square**2).mean(axis=-1) * hit
    return geometry[..., None] / np.pi * scene.meshes[0].material.diffuse * light.radiance
"""

TEN_LINES = """
import nusselt
from my_renderer import render

results = nusselt.check("floor.test", renderer=render, samples=16, runs=4, steps=1, margin=0.02)
print(results.verdict, *(mistake["name"] for mistake in results.row["likely_mistakes"]))
results.write("out")
"""


@pytest.mark.parametrize(
    ("cosines", "verdict", "mistake"),
    [("to[..., 1] ** 2", "agrees", ""), ("to[..., 1] * np.sqrt(square)", "differs", "missing-cosine")],
)
def test_a_script_of_ten_lines_judges_a_strangers_renderer(tmp_path, cosines, verdict, mistake):
    (tmp_path / "floor.test").write_text(SCENE)
    (tmp_path / "my_renderer.py").write_text(NUMPY_RENDERER.replace("COSINES", cosines))
    (tmp_path / "judge.py").write_text(TEN_LINES)
    done = subprocess.run([sys.executable, "judge.py"], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.stdout.split()[:1] == [verdict], done.stdout + done.stderr
    assert mistake in done.stdout
    assert (tmp_path / "out" / "floor" / "brought.exr").exists()
