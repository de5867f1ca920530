"""The command line: what it writes, and what it says of bad input."""

from __future__ import annotations

import gc
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from click.testing import CliRunner
from tev_listener import listening

from nusselt.experiments.cli.main import main
from nusselt.experiments.results.schema import SCHEMA
from nusselt.experiments.scenes import catalogue
from nusselt.renderer.estimators import ESTIMATORS

pytestmark = pytest.mark.mitsuba

SMALL = """size 24 18
camera 0 3 6 0 0 0 0 1 0 40
integrator direct
lightsamples 4
lightstratify on
vertex -2 0 2
vertex 2 0 2
vertex 2 0 -2
vertex -2 0 -2
diffuse .5 .5 .5
tri 0 1 2
tri 0 2 3
quadLight -.5 2 -.5 0 0 1 1 0 0 5 5 5
"""


@pytest.fixture
def small(tmp_path: Path) -> Path:
    path = tmp_path / "a scene ü.test"
    path.write_text(SMALL, encoding="utf-8")
    return path


def run(*arguments: object) -> tuple[int, str, str]:
    result = CliRunner().invoke(main, [str(a) for a in arguments])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stdout, result.stderr


def test_check_writes_results_and_pictures(small, tmp_path):
    out = tmp_path / "out put"
    status, said, _ = run("check", small, "--out", out, "--margin", 0.005)
    assert status == 0
    assert "agrees" in said
    results = json.loads((out / "results.json").read_text())
    assert results["schema"] == SCHEMA
    assert results["versions"]["mitsuba"]
    assert results["machine"]["cores"] >= 1
    (row,) = results["rows"]
    expected = {
        *("scene", "estimator", "claim", "as_claimed", "samples", "pixels", "bias", "bias_relative", "bias_interval"),
        *("margin", "minimum_detectable_bias", "rms", "rms_relative", "rms_denoised_relative", "variance", "seconds"),
        *("rms_denoised_interval", "course_bias", "course_mse", "non_finite", "verdict", "reason", "reference"),
        *("left_out", "seed", "command"),
    }
    assert expected <= row.keys()
    assert {"shaded", "emitter", "background", "unjudged"} == row["pixels"].keys()
    assert {"renderer", "version", "variant", "samples", "standard_error_relative"} <= row["reference"].keys()
    folder = out / "a scene ü"
    assert {p.name for p in folder.iterdir()} == {
        *("ours.png", "ours.exr", "reference.png", "reference.exr", "difference.png", "difference.exr", "overview.png")
    }
    with OpenEXR.File(str(out / "a scene ü.exr"), header_only=True) as file:
        layers = {channel.name for channel in file.header()["channels"]}
    assert {"R", "standardError.R", "reference.R", "referenceStandardError.R", "z.Y", "depth.Z", "normal.X"} <= layers
    assert not list(out.rglob(".*"))


def test_the_row_can_be_made_again_from_its_command(small, tmp_path):
    _, first, _ = run("check", small, "--json", "-", "--samples", 9, "--no-stratify", "--seed", 3, "--margin", 0.01)
    row = json.loads(first)["rows"][0]
    import shlex

    words = shlex.split(row["command"])
    assert words[0] == "nusselt"
    _, again, _ = run(*words[1:], "--json", "-")
    same = json.loads(again)["rows"][0]
    for timed in (row, same):
        timed.pop("seconds")
    assert row == same


def test_until_decided_keeps_its_passes_under_out(small, tmp_path):
    out = tmp_path / "out"
    options = ("--until-decided", "--budget", 60, "--margin", 0.02, "--samples", 4, "--out", out, "--json", "-")
    with listening() as (address, shown):
        status, printed, error = run("check", small, *options, "--tev", address)
        gc.collect()  # the connection is the command's own
    assert status == 0, error
    row = json.loads(printed)["rows"][0]
    assert row["looks"] >= 1
    assert sum(one[0] == "update" for one in shown) == 7 * row["looks"]  # two images in colour, and z
    assert "--tev" not in row["command"]
    import shlex

    words = shlex.split(row["command"])
    assert "--until-decided" in words
    assert words[words.index("--out") + 1] == str(out)  # without it the command would be refused
    assert {path.name for path in (out / "passes").rglob("*.npz")} == {"ours-1.npz", "reference-noisy-1.npz"}


def test_render_writes_each_format(small, tmp_path):
    for name in ("a.png", "a.exr", "a.npy"):
        assert run("render", small, "-o", tmp_path / name)[0] == 0
    image = np.load(tmp_path / "a.npy")
    assert image.shape == (18, 24, 3)
    assert image.max() > 0.01


def test_render_needs_no_mitsuba(small, tmp_path):
    """Neither imported nor looked for, in a process where importing it would fail."""
    script = tmp_path / "without.py"
    script.write_text(
        "import sys\nsys.modules['mitsuba'] = sys.modules['drjit'] = None\n"
        "from nusselt.experiments.cli.main import main\nif __name__ == '__main__':\n    main(sys.argv[1:])\n"
    )
    subprocess.run([sys.executable, script, "render", small, "-o", tmp_path / "x.npy"], check=True)
    assert (tmp_path / "x.npy").exists()


def test_list_tells_of_every_scene_and_estimator():
    status, said, _ = run("list")
    assert status == 0
    for name in (*catalogue.CLASSIC, *(kind.name for kind in ESTIMATORS)):
        assert f"  {name} " in said


def test_doctor_says_which_variant_and_why():
    status, said, _ = run("doctor")
    assert status == 0
    assert "runs in" in said
    assert "mitsuba" in said


def test_export_writes_the_scene_and_its_meshes(small, tmp_path):
    status, _, _ = run("export", small, "-o", tmp_path / "x" / "scene.xml")
    assert status == 0
    assert {p.suffix for p in (tmp_path / "x").iterdir()} == {".xml", ".ply"}


BAD = {
    "no camera": SMALL.replace("camera 0 3 6 0 0 0 0 1 0 40\n", ""),
    "no size": SMALL.replace("size 24 18\n", ""),
    "size 0": SMALL.replace("size 24 18", "size 0 18"),
    "absurd size": SMALL.replace("size 24 18", "size 24 1000000"),
    "nan": SMALL.replace("vertex -2 0 2", "vertex nan 0 2"),
    "inf": SMALL.replace("5 5 5", "5 inf 5"),
    "missing argument": SMALL.replace("vertex -2 0 2", "vertex -2 0"),
    "spare argument": SMALL.replace("vertex -2 0 2", "vertex -2 0 2 1"),
    "index out of range": SMALL.replace("tri 0 2 3", "tri 0 2 4"),
    "zero-area light": SMALL.replace("0 0 1 1 0 0 5", "0 0 1 0 0 2 5"),
    "zero-area triangle": SMALL.replace("tri 0 2 3", "tri 0 0 3"),
    "negative albedo": SMALL.replace("diffuse .5", "diffuse -.5"),
    "negative radiance": SMALL.replace("5 5 5", "5 -5 5"),
    "negative exponent": SMALL.replace("diffuse", "shininess -1\ndiffuse"),
    "negative radius": SMALL + "sphere 0 0 0 -1\n",
    "fov 180": SMALL.replace("0 1 0 40", "0 1 0 180"),
    "camera at its target": SMALL.replace("0 3 6 0 0 0", "0 0 0 0 0 0"),
    "up along the view": SMALL.replace("0 1 0 40", "0 1 2 40"),
    "strata of no square": SMALL.replace("lightsamples 4", "lightsamples 5"),
    "unknown command": SMALL + "wibble 1\n",
    "pop of nothing": SMALL + "popTransform\n",
    "binary": "\x00\x01\x02",
    "empty": "",
}


@pytest.mark.parametrize("case", BAD)
@pytest.mark.parametrize("command", ["check", "render", "export"])
def test_bad_scenes_are_one_clear_error_and_nothing_is_written(tmp_path, case, command):
    scene = tmp_path / "bad.test"
    scene.write_text(BAD[case], encoding="utf-8")
    out = tmp_path / "out"
    target = {"check": ["--out", out], "render": ["-o", out / "a.png"], "export": ["-o", out / "a.xml"]}[command]
    status, said, error = run(command, scene, *target)
    assert status == 2
    assert said == ""
    assert 1 <= len(error.strip().splitlines()) <= 3
    assert "bad.test" in error
    assert "Traceback" not in error
    assert not out.exists()


@pytest.mark.parametrize(
    "arguments",
    [
        ("check",),
        ("check", "no-such-scene"),
        ("check", "quad", "--estimator", "nonsense"),
        ("check", "quad", "--samples", "0"),
        ("check", "quad-random", "--samples", "5", "--stratify"),
        ("check", "quad", "--margin", "0"),
        ("check", "quad", "--margin", "nan"),
        ("check", "quad", "--alpha", "-1"),
        ("check", "quad", "--until-decided"),
        ("check", "quad", "--shadow-origin", "elsewhere"),
        ("check", "quad", "--runs", "4"),
        ("check", "quad", "--transfer", "srgb"),
        ("check", "quad", "--budget", "4"),
        ("check", "quad", "--tolerance", "1e-2"),
        ("check", "quad", "--until-decided", "--out", "out", "--cache", "kept"),
        ("check", "quad", "image.png", "--run-timeout", "4"),
        ("check", "quad", "image.png", "--renderer", "a {output}"),
        ("check", "quad", "image.png", "--estimator", "area", "--estimator", "exact"),
        ("check", "quad", "--renderer", "a {output}", "--shadow-origin", "mitsuba"),
        ("render", "quad", "-o", "a.png", "--tolerance", "1e-2"),
        ("render", "quad", "-o", "a.png", "--error", "1e-2", "--samples", "4"),
        ("check", "quad", "--seed", "-1"),
        ("render", "quad"),
        ("render", "quad", "-o", "image.jpg"),
        ("export", "quad", "-o", "scene.txt"),
        ("check", "quad", "--smaples", "4"),
        ("check", "quad", "--margin", "wide"),
        ("check", "quad", "--runs", "0.5"),
        ("check", "quad", "--run-timeout", "0"),
        ("check", "quad", "--pixel-rule", "corner"),
        ("check", "quad", "--margin"),
        ("run",),
        ("--nonsense",),
        ("nonsense",),
    ],
)
def test_bad_usage_is_status_2_and_one_line(arguments, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, said, error = run(*arguments)
    assert status == 2
    assert said == ""
    assert error.count("\n") == 1
    assert "expected" in error or "--help" in error
    assert not list(tmp_path.iterdir())
    if arguments[2:3] and arguments[-2].startswith("--"):
        assert arguments[-2] in error  # in the user's own words


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("check", "--smaples", "4"), "no such option '--smaples' (did you mean one of: '--samples'"),
        (("check", "--samples", "x"), "--samples = x: expected a whole number from 1 to 16777216"),
        (("check", "--run-timeout", "0"), "--run-timeout = 0.0: expected a number above 0"),
        (("check", "--pixel-rule", "corner"), "--pixel-rule = corner: expected one of centre, area"),
        (("render", "quad"), "--output = missing: expected IMAGE.png, .exr or .npy"),
        (("render",), "SCENE = missing: expected one"),
        (("chekc",), "command = chekc: expected one of check, render, "),
        (("check", "quad", "--tolerance", "1e-2"), "--tolerance = 0.01: expected --pixel-rule area beside it"),
        (("check", "quad", "nofile.png"), "nofile.png: image = no such file: expected an image file"),
        (("stability", "nofile.json"), "cases = nofile.json: expected a file that can be read"),
    ],
)
def test_bad_usage_says_what_is_accepted_and_nothing_twice(arguments, said):
    status, _, error = run(*arguments)
    assert status == 2
    assert error.startswith(f"nusselt: {said}")
    assert error.count("expected") <= 1


OUTPUTS = [
    *((["check", "quad"], option) for option in ("--out", "--json", "--csv", "--junit", "--summary")),
    *((["run", "all"], option) for option in ("--out", "--json", "--csv", "--junit", "--summary")),
    *((["stability"], option) for option in ("--out", "--json")),
    *(([command, "quad"], "--output") for command in ("render", "export", "reference")),
    (["report", "."], "--output"),
    (["test-estimator", "a_module:Name"], "--json"),
]


@pytest.mark.parametrize(("words", "option"), OUTPUTS)
def test_what_cannot_be_written_is_refused_before_any_work(words, option, tmp_path, monkeypatch):
    """A place below a file, one of the wrong kind, and one in a file system that takes no file."""
    monkeypatch.chdir(tmp_path)
    file, folder = tmp_path / "file", tmp_path / "folder"
    file.touch()
    folder.mkdir()
    for place in (file / "below", file if option == "--out" else folder, Path("/proc/self/attr/x/y")):
        status, said, error = run(*words, option, place)
        assert (status, said) == (2, "")
        assert error.startswith(f"nusselt: {option} = ")
        assert "that can be written to (" in error
    assert {path.name for path in tmp_path.rglob("*")} == {"file", "folder"}


def test_several_estimators_are_a_row_each(small, tmp_path):
    asked = ("--estimator", "exact", "--estimator", "area", "--margin", 0.02, "--out", tmp_path / "out")
    status, _, error = run("check", small, *asked)
    assert status == 0, error
    rows = json.loads((tmp_path / "out" / "results.json").read_text())["rows"]
    assert [row["estimator"] for row in rows] == ["exact", "area"]
    assert [row["command"].count("--estimator") for row in rows] == [1, 1]
    assert {path.name for path in (tmp_path / "out").iterdir() if path.is_dir()} == {
        "a scene ü-exact",
        "a scene ü-area",
    }


def test_the_module_is_the_command():
    result = subprocess.run([sys.executable, "-m", "nusselt", "--version"], capture_output=True, text=True, check=True)
    assert "0.1.0" in result.stdout


def test_pixels_by_area_from_the_command_line(tmp_path):
    image = tmp_path / "area.npy"
    asked = ["render", "near-light", "--pixel-rule", "area", "-o", str(image)]
    found = CliRunner().invoke(main, [*asked, "--tolerance", "1e-2"])
    assert found.exit_code == 0, found.output
    by_area = np.load(image)
    assert CliRunner().invoke(main, ["render", "near-light", "-o", str(image)]).exit_code == 0
    at_centres = np.load(image)
    assert by_area.shape == at_centres.shape
    changed = (np.abs(by_area - at_centres) > 0.02).any(axis=2)
    assert 0 < changed.mean() < 0.1  # edges alone
    refused = CliRunner().invoke(main, [*asked, "--tolerance", "2"])
    assert refused.exit_code == 2
    assert "tolerance" in refused.output
