"""The pytest plug-in: right renderers pass, wrong ones fail with the verdict's words, and a report is kept."""

from __future__ import annotations

import json

import pytest
from places import ROOT
from test_cli import SMALL

pytestmark = pytest.mark.mitsuba

pytest_plugins = ["pytester"]

OPEN = SMALL.replace("lightstratify on", "lightstratify off")
"""Nothing blocks: the truth is a closed form, and no Mitsuba is asked."""

TESTS = """
import pytest
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render

def mine(scene, samples, seed):
    return render(scene, Area(samples=samples), seed=seed).mean.transpose(1, 2, 0)

def bright(scene, samples, seed):
    return 1.2 * mine(scene, samples, seed)

def test_right(nusselt):
    nusselt.agrees("open.test", renderer=mine, samples=64, margin=0.05)

def test_wrong(nusselt):
    nusselt.agrees("open.test", renderer=bright, samples=64, margin=0.05)

@pytest.mark.parametrize("gain", [1.0, 1.2])
def test_looks_itself(nusselt, gain):
    images = [gain * mine(read_open(), 64, seed) for seed in range(4)]
    results = nusselt.check("open.test", images=images, margin=0.05)
    assert results.agrees == (gain == 1.0)

def read_open():
    import nusselt
    return nusselt.read_scene("open.test")

def test_asks_nonsense(nusselt):
    nusselt.agrees("open.test", renderer=mine, margin=-1)
"""


@pytest.fixture
def project(pytester):
    pytester.makefile(".test", open=OPEN)
    pytester.makepyfile(test_renderer=TESTS)
    return pytester


def run(project, *arguments: str):
    return project.runpytest_subprocess("-p", "nusselt.pytest_plugin", "-p", "no:xdist", *arguments)


def rows_of(project) -> list[dict]:
    return json.loads((project.path / "kept" / "results.json").read_text())["rows"]


def test_a_failure_is_the_verdicts_words_and_a_report_is_kept_of_which_an_earlier_one_is_no_part(project):
    stale = project.path / "kept" / ".parts"
    stale.mkdir(parents=True)
    (stale / "gw7.json").write_text(json.dumps({"schema": 1, "rows": [{"scene": "of a run that was killed"}]}))
    result = run(project, "--nusselt-report", "kept")
    result.assert_outcomes(passed=3, failed=2)
    result.stdout.fnmatch_lines(["open, renderer: differs: *", "it looks like * (*%*", "again: nusselt.check(*"])
    result.stdout.fnmatch_lines(["InputError: margin = -1: expected a number above 0*"])
    assert result.stdout.str().count("margin=-1") == 0  # no line of the test's source, and none of ours
    result.stdout.no_fnmatch_line("again:*cache=*")
    result.stdout.fnmatch_lines(["nusselt: *report.html"])
    rows = rows_of(project)
    assert [row["verdict"] for row in rows] == ["agrees", "differs", "agrees", "differs"]
    assert rows[0]["command"] == "pytest 'test_renderer.py::test_looks_itself[1.0]'"
    for row in rows:
        assert all((project.path / "kept" / name).exists() for name in row["images"].values())
    page = (project.path / "kept" / "report.html").read_text(encoding="utf-8")
    assert "differs" in page
    for name in ("test_right", "test_wrong", "test_looks_itself[1.0]", "test_looks_itself[1.2]"):
        assert f"open, test_renderer.py::{name}</button>" in page
    assert page.count('class="viewer"') == 4
    assert page.count("<td>gain</td>") == 2
    assert not list((project.path / "kept").glob(".*"))


def test_a_report_that_cannot_be_written_is_refused_at_once(pytester):
    pytester.makepyfile("def test_of_something_else(): pass")
    pytester.makefile(".txt", kept="a file")
    result = run(pytester, "--nusselt-report", "kept.txt")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["ERROR: --nusselt-report = *: expected a folder that can be written to*"])


def test_nothing_checked_is_said(pytester):
    pytester.makepyfile("def test_of_something_else(): pass")
    run(pytester, "--nusselt-report", "kept").stdout.fnmatch_lines(["nusselt: no report: nothing was checked"])


@pytest.mark.slow
def test_processes_write_their_parts_and_one_report_has_them_all(project):
    project.makepyfile(test_renderer=TESTS[: TESTS.index("@pytest.mark.parametrize")])
    result = project.runpytest_subprocess("-p", "nusselt.pytest_plugin", "-n", "2", "--nusselt-report", "kept")
    result.assert_outcomes(passed=1, failed=1)
    assert [row["verdict"] for row in rows_of(project)] == ["agrees", "differs"]
    assert not list((project.path / "kept").glob(".*"))


SHADOW = SMALL + "vertex -.5 1 0\nvertex .5 1 0\nvertex 0 1 -1\ntri 4 5 6\n"
KEPT = """
def test_kept(nusselt):
    results = nusselt.check("shadow.test", estimator="exact", margin=0.05)
    assert results.row["reference"]["samples"] > 0
"""
ANOTHER = """
def test_another(nusselt):
    nusselt.check("another.test", estimator="exact", margin=0.05)
"""
OFFLINE = """
from nusselt.experiments.check import check

def unavailable(*_, **__):
    raise AssertionError("asked for again")

check.render_reference = unavailable
"""


def test_references_are_kept_between_runs(pytester):
    pytester.makefile(".test", shadow=SHADOW)
    pytester.makepyfile(KEPT)
    run(pytester).assert_outcomes(passed=1)
    (kept,) = (pytester.path / ".pytest_cache/d/nusselt").glob("shadow-*.npz")
    pytester.makeconftest(OFFLINE)
    run(pytester).assert_outcomes(passed=1)
    kept.rename(pytester.mkdir("references") / kept.name)
    pytester.makefile(".test", another=SHADOW.replace("5 5 5", "6 6 6"))
    pytester.makepyfile(test_another=ANOTHER)
    # Another scene is not served by what is kept.
    run(pytester, "--nusselt-cache", "references").assert_outcomes(passed=1, failed=1)


def test_a_run_that_does_not_use_it_imports_nothing(pytester):
    pytester.makepyfile(
        "import sys\n"
        "def test_light():\n"
        "    assert 'nusselt.pytest_plugin' in sys.modules\n"
        "    assert not {'numpy', 'scipy', 'click', 'nusselt.experiments'} & set(sys.modules)\n"
    )
    pytester.runpytest_subprocess("-p", "nusselt.pytest_plugin", "-p", "no:xdist").assert_outcomes(passed=1)


def test_the_entry_point_and_the_option_are_one_plug_in():
    """By the name of its module, so that pytest never registers it twice."""
    import tomllib

    told = tomllib.loads((ROOT / "pyproject.toml").read_text())
    assert told["project"]["entry-points"]["pytest11"] == {"nusselt.pytest_plugin": "nusselt.pytest_plugin"}
