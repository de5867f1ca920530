"""The front door: what is called from Python does what the command does, and says the same of bad input."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from builders import floor, lamp, scene
from test_cli import SMALL, run

import nusselt
from nusselt.experiments.images.formats.exr import exr_planes
from nusselt.experiments.workers import PatientPool
from nusselt.renderer.estimators import Area

pytestmark = pytest.mark.mitsuba

OPEN = scene(floor(), lights=(lamp(),), size=(48, 36), light_samples=9, stratify=True, name="open")
"""Nothing blocks: the truth is the closed form, and no Mitsuba is asked."""


@pytest.fixture
def small(tmp_path) -> Path:
    path = tmp_path / "small.test"
    path.write_text(SMALL, encoding="utf-8")
    return path


def ours(made, samples: int, seed: int, gain: float = 1.0) -> np.ndarray:
    """A stranger's renderer: ours, too bright by a factor."""
    return gain * nusselt.render(made, estimator="area", samples=samples, stratified=True, seed=seed).array


def too_bright(made, samples: int, seed: int) -> np.ndarray:
    return ours(made, samples, seed, 1.05)


@dataclass(frozen=True, kw_only=True)
class Dim(Area):
    name: ClassVar[str] = "dim"

    def __call__(self, points, source, rng):
        return 0.9 * super().__call__(points, source, rng)


def test_the_name_and_the_renderer_wait_for_numpy_alone():
    code = (
        "import nusselt, nusselt.renderer.image, sys\n"
        "assert 'check' in dir(nusselt) and not hasattr(nusselt, 'nonsense')\n"
        "heavy = {'scipy', 'click', 'rich', 'PIL', 'mitsuba', 'matplotlib', 'OpenEXR', 'pytest'} & set(sys.modules)\n"
        "sys.exit(f'imported: {heavy}' if heavy else 0)"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False).stderr == ""


def test_images_may_be_arrays_files_or_both(tmp_path):
    first, second = (ours(OPEN, 9, seed) for seed in (1, 2))
    np.save(tmp_path / "second.npy", second)
    results = nusselt.check(OPEN, images=[first, tmp_path / "second.npy"], margin=0.02)
    assert results.agrees, str(results)
    assert results.row["brought"] == ["images[0]", str(tmp_path / "second.npy")]
    assert results.row["passes"] == 2
    assert results._repr_html_().count("data:image/png") == 3
    results.write(tmp_path / "out")
    assert (tmp_path / "out" / "open" / "brought.exr").exists()
    assert (tmp_path / "out" / "results.json").exists()


def test_the_report_shows_the_truth_with_the_mistake_that_is_named(tmp_path):
    results = nusselt.check(OPEN, images=[1.1 * ours(OPEN, 9, seed) for seed in (1, 2)], margin=0.02)
    results.write(tmp_path / "out")
    shown, truth = (exr_planes(tmp_path / "out" / "open" / f"{name}.exr") for name in ("mistaken", "reference"))
    assert np.abs(shown - truth).max() > 0
    np.testing.assert_allclose(shown, 1.1 * truth, rtol=0.02)
    nusselt.write_report(tmp_path / "out", tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert 'value="mistaken"' in page
    assert "the reference rendered with gain" in page
    assert "A right image would be given a name in at most 2" in page
    assert 0 < results.row["likely_mistakes"][0]["named_wrongly"] < 0.05


def test_no_mistake_is_shown_where_none_is_named(tmp_path):
    results = nusselt.check(OPEN, images=[ours(OPEN, 9, seed) for seed in (1, 2)], margin=0.02)
    results.write(tmp_path / "out")
    assert not (tmp_path / "out" / "open" / "mistaken.exr").exists()
    nusselt.write_report(tmp_path / "out", tmp_path / "page.html")
    assert 'value="mistaken"' not in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_a_function_is_a_renderer_and_a_wrong_one_is_told_from_a_right_one():
    right = nusselt.check(OPEN, renderer=ours, samples=9, runs=4, steps=1, margin=0.02)
    assert right.verdict == "agrees", str(right)
    wrong = nusselt.check(OPEN, renderer=too_bright, samples=9, runs=4, steps=1, margin=0.02)
    assert (wrong.verdict, wrong.agrees) == ("differs", False)
    assert "it looks like gain" in str(wrong)
    assert wrong.row["command"].startswith("nusselt.check(<scene open>, renderer=too_bright, ")


def test_judged_are_the_images_of_most_samples():
    """A bias that the first ones' noise would hide."""

    def brighter(scene, samples, seed):
        return 1.005 * ours(scene, samples, seed)

    found = nusselt.check(OPEN, renderer=brighter, samples=4, steps=3, margin=2e-3)
    assert [row["samples"] for row in found.row["convergence"]["rows"]] == [4, 16, 64]
    assert (found.row["samples"], found.row["passes"], found.verdict) == (64, 4, "differs"), str(found)
    assert found.row["brought"] == ["seed 9", "seed 10", "seed 11", "seed 12"]
    assert nusselt.check(OPEN, renderer=brighter, samples=4, steps=1, margin=2e-3).verdict == "undecided"


def test_backs_that_are_seen_are_told_to_whose_renderer_lights_them():
    turned = replace(floor(), triangles=floor().triangles[::-1])
    back = scene(turned, lights=(lamp(),), size=(24, 18), name="back")
    both = ours(back.with_(two_sided=True), 9, 1)
    found = nusselt.check(back, images=[both], margin=0.05)
    assert found.verdict == "differs"
    assert any("back of a one-sided surface" in said and "--two-sided" in said for said in found.row["warnings"])
    assert nusselt.check(back, images=[both], margin=0.05, two_sided=True).verdict != "differs"


def test_a_scene_may_be_checked_in_fewer_pixels(tmp_path):
    expecting = tmp_path / "expecting.test"
    expecting.write_text(f"{SMALL}\nexpectPixel 23 17  .1 .1 .1  1000\n", encoding="utf-8")
    found = nusselt.check(
        expecting, images=[ours(nusselt.read_scene(expecting).with_(width=12, height=9), 9, 1)], width=12
    )
    assert sum(found.row["pixels"].values()) == 12 * 9
    assert "1 expectPixel left out: of another size" in found.row["warnings"]
    assert "--width 12" in found.row["command"] or "width=12" in found.row["command"]
    with pytest.raises(nusselt.InputError, match="width"):
        nusselt.check(OPEN, width=0)


def test_what_makes_a_row_again_has_names_that_can_be_typed_and_nothing_no_row_depends_on():
    from nusselt.experiments.front.again import again

    def my_render(scene, samples, seed):
        return None

    said = {"renderer": my_render, "cache": Path("/kept"), "margin": 0.02}
    assert again("a.test", said) == "nusselt.check('a.test', renderer=<my_render>, margin=0.02)"
    assert again("a.test", {"renderer": lambda *_: None}) == "nusselt.check('a.test', renderer=<lambda>)"
    assert again("a.test", {"renderer": too_bright}) == "nusselt.check('a.test', renderer=too_bright)"
    assert again("a.test", {"estimator": "exact", "cache": "/kept"}) == "nusselt check a.test --estimator exact"


def test_estimators_are_names_or_classes_a_row_each(small):
    results = nusselt.check(small, estimator=["exact", Dim], samples=4, margin=0.02)
    assert [row["verdict"] for row in results.rows] == ["agrees", "differs"]
    assert results.row is results.rows[1]  # the one that decides
    assert results.verdict == "differs"
    assert "test_front:Dim" in results.row["command"]
    with pytest.raises(TypeError, match=r"\.agrees"):
        bool(results)


def test_a_picture_shows_and_writes_itself(tmp_path):
    picture = nusselt.render(OPEN, estimator="exact")
    assert picture.array.shape == (36, 48, 3)
    assert picture._repr_png_().startswith(b"\x89PNG")
    picture.write(tmp_path / "a.npy")
    np.testing.assert_array_equal(np.load(tmp_path / "a.npy"), picture.array)


BAD = {
    "margin": [-1, 0, 2, float("nan"), "0.1", None, True],
    "alpha": [0, 0.6],
    "timeout": [0],
    "samples": [0, 2.5, "4"],
    "seed": [-1, 1.0],
    "stratified": [1, "yes"],
    "pixel_rule": ["corner"],
    "shadow_origin": ["elsewhere"],
    "tolerance": [1e-2, 2],
    "estimator": ["nonsense", 4, object, "no_such_module:Name"],
    "runs": [4.5],
    "transfer": ["srgb"],
    "reference": ["no-such.npz"],
}


@pytest.mark.parametrize(("name", "value"), [(name, value) for name, values in BAD.items() for value in values])
def test_bad_arguments_are_one_clear_error(small, name, value):
    with pytest.raises(nusselt.InputError) as caught:
        nusselt.check(small, **{name: value})
    assert "expected" in str(caught.value)
    assert caught.value.argument == name


@pytest.mark.parametrize(
    ("option", "name", "value"),
    [
        ("--margin", "margin", -1.0),
        ("--alpha", "alpha", 0.7),
        ("--estimator", "estimator", "nonsense"),
        ("--transfer", "transfer", "srgb"),
        ("--timeout", "timeout", 0.0),
    ],
)
def test_the_command_says_the_same_in_its_own_words(small, option, name, value):
    with pytest.raises(nusselt.InputError) as caught:
        nusselt.check(small, **{name: value})
    status, _, error = run("check", small, option, value)
    assert status == 2
    assert error.strip() == "nusselt: " + str(caught.value).replace(f"{name} =", f"{option} =", 1)


@pytest.mark.parametrize(
    ("call", "name", "said"),
    [
        (nusselt.check, "sample", "an argument of nusselt.check (samples?)"),
        (nusselt.check, "foo", "an argument of nusselt.check: images, renderer, "),
        (nusselt.check, "budget", "it left out: the command line alone has it"),
        (nusselt.render, "sampels", "an argument of nusselt.render (samples?)"),
        (nusselt.read_scene, "lenience", "an argument of nusselt.read_scene (lenient?)"),
    ],
)
def test_an_argument_that_there_is_not_is_one_clear_error(call, name, said):
    with pytest.raises(nusselt.InputError) as caught:
        call(OPEN, **{name: 1})
    assert str(caught.value).startswith(f"{name} = 1: expected {said}")


def test_channels_that_come_first_are_told():
    image = np.moveaxis(ours(OPEN, 9, 1), 2, 0)
    notes = nusselt.check(OPEN, images=image, margin=0.05).row["warnings"]
    assert any("channels first" in note for note in notes)
    assert not any("channels first" in note for note in nusselt.check(OPEN, images=ours(OPEN, 9, 1)).row["warnings"])


@pytest.mark.parametrize(
    "arguments",
    [
        {"images": []},
        {"images": [np.zeros((36, 47, 3))]},
        {"images": [np.full((36, 48, 3), np.nan)]},
        {"images": np.zeros((36, 48, 3), dtype=complex)},
        {"images": [None]},
        {"images": [np.zeros((36, 48, 3))], "renderer": ours},
        {"images": [np.zeros((36, 48, 3))], "runs": 2},
        {"renderer": 7},
        {"renderer": ours, "image_type": ".png"},
        {"renderer": ours, "shadow_origin": "mitsuba"},
        {"renderer": lambda *_: np.zeros((3, 3)), "steps": 1},
        {"renderer": "a program"},
    ],
)
def test_bad_images_and_renderers_are_one_clear_error(arguments):
    with pytest.raises(nusselt.InputError, match="expected"):
        nusselt.check(OPEN, **arguments)


def test_a_scene_is_a_file_a_name_or_a_scene(small):
    assert nusselt.read_scene(small) == nusselt.read_scene(str(small))
    assert nusselt.read_scene("quad").name == "quad"
    for wrong in ("no-such-scene", 3):
        with pytest.raises(nusselt.InputError, match="scene = "):
            nusselt.check(wrong)
    with pytest.raises(nusselt.InputError, match="scenes = "):
        nusselt.check()


def started(pool: PatientPool) -> bool:
    return pool._pool is not None


def test_small_work_starts_no_workers_and_gives_the_same_image():
    impatient, patient = PatientPool(2, 0.0), PatientPool(2, 60.0)
    from nusselt.renderer.image import render

    images = [render(OPEN, Area(samples=256), seed=1, executor=pool).mean for pool in (impatient, patient, None)]
    used = started(impatient), started(patient)
    impatient.shutdown()
    assert used == (True, False)
    np.testing.assert_array_equal(images[0], images[1])
    np.testing.assert_array_equal(images[0], images[2])


def test_what_workers_cannot_import_stays_here():
    @dataclass(frozen=True, kw_only=True)
    class Local(Area):
        pass

    from nusselt.renderer.image import render

    pool = PatientPool(2, 0.0)
    try:
        image = render(OPEN, Local(samples=256), seed=1, executor=pool)
    finally:
        pool.shutdown()
    np.testing.assert_array_equal(image.mean, render(OPEN, Area(samples=256), seed=1).mean)


SCRIPT = """
import os
from nusselt.experiments.workers import PatientPool
def here(parent): return os.getpid() == parent
def main():
    pool = PatientPool(1, 0.0)
    print("in one process" if pool.submit(here, os.getpid()).result() else "in a worker")
    pool.shutdown()
"""


@pytest.mark.parametrize(
    ("call", "said"),
    [("main()", "in one process"), ('if __name__ == "__main__":\n    main()', "in a worker")],
)
def test_a_script_without_a_guard_is_not_run_again_by_workers(tmp_path, call, said):
    script = tmp_path / "script.py"
    script.write_text(SCRIPT + call)
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.splitlines() == [said]
    assert ('if __name__ == "__main__":' in done.stderr) == (said == "in one process")


def test_every_option_is_of_some_way_of_checking_and_of_the_call():
    """One that is in no mode could never be used; one that the command has and the call has not is told here."""
    import inspect

    from nusselt.experiments.check.request import MODES
    from nusselt.experiments.cli.check import command

    of_modes = set().union(*(mode.options for mode in MODES)) - {"images"}
    assert {parameter.name for parameter in command.params} == of_modes
    of_call = inspect.signature(nusselt.check).parameters.keys() - {"images"}
    of_commands_alone = {"classic", "until_decided", "budget", "cluster", "out", "target", "csv", "junit", "summary"}
    of_commands_alone |= {"verbose", "tev"}
    assert of_modes - of_call == of_commands_alone
    assert of_call <= of_modes
