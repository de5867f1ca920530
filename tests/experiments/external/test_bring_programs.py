"""Somebody's renderer, references in files, estimators by name: what works, and how each fails."""

from __future__ import annotations

import json
import shlex
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from builders import floor, lamp, scene
from click.testing import CliRunner

from nusselt.experiments.check.references import Cache, read_reference, write_reference
from nusselt.experiments.check.rounded import as_kept
from nusselt.experiments.cli.main import main
from nusselt.experiments.external.program import Program, ProgramFailed, ProgramRenderer
from nusselt.experiments.images.write import write_image
from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Analytic, Area
from nusselt.renderer.image import render
from nusselt.renderer.scene_text import write_scene

pytestmark = pytest.mark.mitsuba

ROOM = scene(floor(), lights=(lamp(),), size=(48, 36), light_samples=9, stratify=True)


def run(*arguments: object) -> tuple[int, str, str]:
    result = CliRunner().invoke(main, [str(a) for a in arguments])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture
def room(tmp_path) -> Path:
    path = tmp_path / "room.test"
    path.write_text(write_scene(ROOM))
    return path


def call(script: str, *, timeout: float = 60.0, words: str = "{output} {seed} {samples}") -> Program:
    return Program(f"{PYTHON} -c '{script}' {words}", ".npy", timeout)


PYTHON = shlex.quote(sys.executable)
WRITE = "import sys, numpy as np; np.save(sys.argv[1], np.full((36, 48, 3), float(sys.argv[2])))"


def test_a_program_is_run_with_its_words_filled_in(room):
    with ProgramRenderer(call(WRITE), ROOM, str(room)) as renderer:
        run_ = renderer.run(9, 5)
    assert run_.raw.values.mean() == 5
    assert run_.seconds > 0


@pytest.mark.parametrize(
    ("script", "said"),
    [
        ('import sys; print("no lights"); sys.exit(3)', "status 3: no lights"),
        ("pass", "no such file"),
        ("import sys, numpy as np; np.save(sys.argv[1], np.zeros((3, 3)))", "shape"),
        ("import os; os.abort()", "status -6"),
    ],
)
def test_a_program_that_fails_is_one_sentence_that_says_which_run_it_was(room, script, said):
    with ProgramRenderer(call(script), ROOM, str(room)) as renderer, pytest.raises(ProgramFailed, match=said) as caught:
        renderer.run(9, 5)
    assert f"(seed 5, 9 samples: {PYTHON} " in str(caught.value)


def test_a_program_that_hangs_is_ended_with_all_it_started(room, tmp_path):
    flag = tmp_path / "alive"
    child = f'import time; time.sleep(3); open("{flag}", "w")'
    script = f'import subprocess, sys, time; subprocess.Popen([sys.executable, "-c", {child!r}]); time.sleep(60)'
    path = tmp_path / "hang.py"
    path.write_text(script)
    started = time.monotonic()
    program = Program(f"{PYTHON} {shlex.quote(str(path))} {{output}}", ".npy", 1.0)
    with ProgramRenderer(program, ROOM, str(room)) as renderer, pytest.raises(ProgramFailed, match="more than 1 s"):
        renderer.run(9, 1)
    time.sleep(max(0.0, 4.5 - (time.monotonic() - started)))
    assert not flag.exists()


@pytest.mark.parametrize("command", ["", "a b", "a {output} {nonsense}", "a '{output}", "a {output", "a {output} {0}"])
def test_commands_that_cannot_be_filled_in_are_refused(command):
    with pytest.raises(InputError, match="renderer"):
        Program(command)


def test_no_shell_reads_the_command(room, tmp_path):
    program = Program(
        f"{PYTHON} -c 'import sys; sys.exit(len(sys.argv) - 1)' ; touch {shlex.quote(str(tmp_path))}/x {{output}}"
    )
    with ProgramRenderer(program, ROOM, str(room)) as renderer, pytest.raises(ProgramFailed, match="status 4"):
        renderer.run(1, 1)
    assert not (tmp_path / "x").exists()


def test_a_program_that_cannot_start_is_bad_input(room):
    status, _, error = run("check", room, "--renderer", "/no/such/program {output}")
    assert status == 2
    assert error.startswith("nusselt: --renderer = /no/such/program: expected a program that can be started (")


def reference():
    return Reference.of_image(render(ROOM, Analytic()), "ours", 1)


def test_a_kept_reference_comes_back_to_the_bit(tmp_path):
    path = tmp_path / "ref.npz"
    write_reference(path, ROOM, reference(), 1e-4)
    found, head = read_reference(path, ROOM)
    np.testing.assert_array_equal(found.mean, as_kept(reference()).mean)
    assert head["made_by"]["numpy"] == np.__version__
    assert head["rule"].endswith("pixel centres")


@pytest.mark.parametrize("other", [ROOM.with_(width=40), ROOM.with_(lights=(lamp(2.1),)), ROOM.with_(spp=4)])
def test_a_foreign_reference_is_refused_with_the_reason(tmp_path, other):
    write_reference(tmp_path / "ref.npz", ROOM, reference(), 1e-4)
    with pytest.raises(InputError, match=r"another scene|rule"):
        read_reference(tmp_path / "ref.npz", other)


def test_what_the_estimators_read_is_no_part_of_a_reference(tmp_path):
    write_reference(tmp_path / "ref.npz", ROOM, reference(), 1e-4)
    read_reference(tmp_path / "ref.npz", ROOM.with_(light_samples=16, name="other"))


def test_damaged_references_are_refused(tmp_path, room):
    good = tmp_path / "good.npz"
    write_reference(good, ROOM, reference(), 1e-4)
    whole = good.read_bytes()
    np.savez(tmp_path / "arrays.npz", mean=np.zeros((3, 36, 48)))
    np.savez(tmp_path / "pickle.npz", head=np.array([{"kind": 1}], dtype=object))
    np.savez_compressed(tmp_path / "bomb.npz", head=np.zeros(1 << 26, dtype=np.uint8))
    (tmp_path / "cut.npz").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "empty.npz").write_bytes(b"")
    for name in ("arrays", "pickle", "bomb", "cut", "empty", "none"):
        status, _, error = run("check", room, "--reference", tmp_path / f"{name}.npz")
        assert status == 2, name
        assert len(error.strip().splitlines()) == 1
        assert f"{name}.npz" in error


def test_the_cache_gives_back_what_it_kept_and_only_that(tmp_path):
    cache = Cache(tmp_path / "cache")
    assert cache.find(ROOM, 1e-4) is None
    cache.keep(ROOM, reference(), 1e-4)
    found = cache.find(ROOM, 1e-4)
    assert found is not None
    assert cache.find(ROOM, 1e-5) is None
    assert cache.find(ROOM.with_(width=40), 1e-4) is None
    for path in (tmp_path / "cache").iterdir():
        path.write_bytes(b"damaged")
    assert cache.find(ROOM, 1e-4) is None


def test_images_against_a_kept_reference(room, tmp_path):
    write_reference(tmp_path / "ref.npz", ROOM, reference(), 1e-4)
    files = []
    for seed in (1, 2, 3):
        files.append(tmp_path / f"mine-{seed}.exr")
        write_image(files[-1], render(ROOM, Area(samples=9, stratified=True), seed=seed).mean)
    status, said, _ = run("check", room, *files, "--reference", tmp_path / "ref.npz", "--margin", 0.02, "--json", "-")
    (row,) = json.loads(said)["rows"]
    assert row["verdict"] == "agrees", row["reason"]
    assert status == 0
    assert row["passes"] == 3
    assert not row["single_image"]
    assert row["likely_mistakes"] == []
    assert "kept reference" in row["reference"]["notes"][0]


def test_a_wrong_image_differs_and_a_repeated_one_is_told(room, tmp_path):
    mean = render(ROOM, Area(samples=9, stratified=True), seed=1).mean
    write_image(tmp_path / "bright.exr", 1.3 * mean)
    status, said, _ = run("check", room, tmp_path / "bright.exr", "--json", "-")
    (row,) = json.loads(said)["rows"]
    assert (status, row["verdict"]) == (1, "differs")
    assert row["likely_mistakes"][0]["name"] == "gain"
    assert row["single_image"]
    write_image(tmp_path / "again.exr", 1.3 * mean)
    _, said, _ = run("check", room, tmp_path / "bright.exr", tmp_path / "again.exr", "--json", "-")
    (row,) = json.loads(said)["rows"]
    assert row["passes"] == 1
    assert any("does not use the seed" in note for note in row["warnings"])


@pytest.mark.parametrize(
    "name",
    [
        "os:system",
        "no_such_module:Name",
        "nusselt.renderer.estimators:Nothing",
        "a b:C",
        "nusselt.renderer.estimators:",
        ":x",
    ],
)
def test_estimators_that_are_none_are_status_2(name, room):
    for command in (("test-estimator", name), ("render", room, "--estimator", name, "-o", "x.npy")):
        status, _, error = run(*command)
        assert status == 2
        assert len(error.strip().splitlines()) == 1
        assert "expected" in error


COPY = "import sys, shutil; shutil.copy(sys.argv[1][:-5] + sys.argv[2] + '.npy', sys.argv[3])"
"""Image number {seed} that lies beside {scene}, for {output}."""


def test_several_scenes_are_a_row_each_and_one_that_cannot_be_drawn_stops_no_other(tmp_path):
    names = []
    for name, gain in (("bright", 1.0), ("broken", 0.0), ("dim", 0.9)):
        (tmp_path / f"{name}.test").write_text(write_scene(ROOM))
        names.append(tmp_path / f"{name}.test")
        for seed in (1, 2) if gain else ():
            image = gain * render(ROOM, Area(samples=64, stratified=True), seed=seed).mean
            np.save(tmp_path / f"{name}{seed}.npy", image.transpose(1, 2, 0))
    command = shlex.join([sys.executable, "-c", COPY, "{scene}", "{seed}", "{output}"])
    told = ("--json", tmp_path / "results.json", "--junit", tmp_path / "cases.xml")
    options = ("--runs", 2, "--steps", 1, "--image-type", ".npy", "--margin", 0.02, *told)
    status, said, error = run("check", *names, "--renderer", command, *options)
    assert status == 1
    assert "nusselt: broken: " in error
    rows = json.loads((tmp_path / "results.json").read_text())["rows"]
    assert [(row["scene"], row["verdict"]) for row in rows] == [("bright", "agrees"), ("dim", "differs")]
    assert all(str(name) in row["command"] for name, row in zip(names[::2], rows, strict=True))
    assert said.splitlines()[-1] == "1 of 2 agrees; dim renderer 9 stratified differs; broken could not be drawn"
    assert 'tests="2"' in (tmp_path / "cases.xml").read_text()
