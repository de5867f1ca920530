"""Scenes on which a renderer fails, made small: delta debugging, held by a test at every step, and resumed."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import pytest
from builders import box, floor, lamp, scene
from click.testing import CliRunner

import nusselt.experiments.cli.reduce as command_file
from nusselt.experiments.cli.main import main
from nusselt.experiments.external.program import ProgramFailed
from nusselt.experiments.metamorphic.ask import Asking
from nusselt.experiments.reduce.ddmin import ddmin
from nusselt.experiments.reduce.failure import BESIDE, CRASHES, manner_of
from nusselt.experiments.reduce.reduce import Trials, reduced, told
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render
from nusselt.renderer.scene_text import parse_scene, write_scene
from nusselt.renderer.surfaces import Ellipsoid

RNG = np.random.default_rng(5)
PLACES = RNG.uniform([-1.8, 0.2, -1.8], [1.8, 0.9, 1.8], (24, 3))
BOXES = [box(tuple(p - 0.12), tuple(p + 0.12)) for p in PLACES[:20]]
BALLS = tuple(Ellipsoid.sphere(tuple(p), 0.15) for p in PLACES[20:])
LIGHTS = lamp(2.5), lamp(3.5, 0.3, (60.0, 60.0, 60.0))
MANY = scene(floor(), *BOXES, lights=LIGHTS, ellipsoids=BALLS, size=(20, 15), light_samples=9, stratify=True)
ASKING = Asking(seed=2, runs=4)


@dataclass(frozen=True)
class Renderer:
    """Ours, that crashes of a ball under two lights, or does not see the second light; it counts its images."""

    crashes: bool
    made: list[int] = field(default_factory=list, compare=False, repr=False)
    name: str = "planted"
    rounding: float = 2e-6
    knows: tuple[str, ...] = ()

    def claim(self, scene):
        return "unbiased"

    def image(self, shot, seed):
        self.made.append(seed)
        if self.crashes and shot.scene.ellipsoids and len(shot.scene.lights) > 1:
            raise ProgramFailed("it ended with status 139")
        lights = shot.scene.lights if self.crashes else shot.scene.lights[:1]
        area = Area(samples=shot.scene.light_samples, stratified=shot.scene.stratify)
        return render(shot.scene.with_(lights=lights), area, seed=seed).mean


def test_the_fewest_parts_that_fail_are_found():
    assert ddmin(range(100), lambda some: {17, 63} <= set(some)) == (17, 63)
    assert ddmin(range(7), lambda some: 3 in some) == (3,)
    assert ddmin((1, 2), lambda some: len(some) == 2) == (1, 2)


def _small(renderer, manner, kept=None, until=math.inf):
    failure, _ = manner_of(MANY, renderer, ASKING, (manner,))
    assert failure is not None
    trials = Trials(failure, until, kept)
    return reduced(MANY, trials), trials, failure


def test_a_crash_is_left_with_what_it_needs():
    small, trials, failure = _small(Renderer(crashes=True), CRASHES)
    assert (len(small.meshes), len(small.ellipsoids), len(small.lights)) == (0, 1, 2)
    text = told(small, failure, "nusselt reduce small.test")
    assert "status 139" in text.splitlines()[0]
    assert parse_scene(text).digest() == small.digest()
    assert trials.asked < 200


def test_a_wrong_image_is_shrunk_and_a_run_cut_short_goes_on(tmp_path):
    kept = tmp_path / "small.json"
    late, _, _ = _small(Renderer(crashes=False), BESIDE, kept, until=-math.inf)
    assert late == MANY  # no time, no step
    small, first, _ = _small(Renderer(crashes=False), BESIDE, kept)
    assert len(small.meshes) + len(small.ellipsoids) <= 4
    assert first.failure.there(small)
    again = Renderer(crashes=False)
    same, second, _ = _small(again, BESIDE, kept)
    assert same == small
    assert second.asked == 0
    assert len(again.made) == ASKING.runs  # of the whole scene, to see that it fails


def test_answers_of_a_program_that_was_changed_are_asked_again(tmp_path):
    program = tmp_path / "mine.py"
    program.write_text("first")
    failure, _ = manner_of(MANY, Renderer(crashes=True), ASKING, (CRASHES,))
    first = Trials(failure, math.inf, tmp_path / "small.json", files=(program,))
    assert first.fails(MANY)
    assert Trials(failure, math.inf, tmp_path / "small.json", files=(program,)).known
    program.write_text("mended")
    assert not Trials(failure, math.inf, tmp_path / "small.json", files=(program,)).known


def test_a_right_renderer_has_nothing_to_shrink():
    right, ways = Renderer(crashes=True), (CRASHES, BESIDE)
    assert manner_of(MANY.with_(ellipsoids=()), right, ASKING, ways)[0] is None


def test_what_noise_hides_or_no_time_was_left_for_is_undecided_and_not_right():
    noisy = MANY.with_(ellipsoids=(), light_samples=1, stratify=False, width=6, height=4)
    assert manner_of(noisy, Renderer(crashes=True), ASKING, (CRASHES, BESIDE)) == (None, [BESIDE])
    late = manner_of(MANY, Renderer(crashes=True), ASKING, (CRASHES, BESIDE), -math.inf)
    assert late == (None, [CRASHES, BESIDE])


@pytest.mark.parametrize("content", ["{", "[]", '{"rows": []}'])
def test_another_file_where_answers_are_kept_is_not_lost(tmp_path, content):
    kept = tmp_path / "small.json"
    kept.write_text(content)
    with pytest.raises(InputError, match="another file there would be lost"):
        _small(Renderer(crashes=True), CRASHES, kept)
    assert kept.read_text() == content


def test_where_no_scene_is_written_is_refused_and_an_early_end_says_that_nothing_was(tmp_path, monkeypatch):
    scene_file = tmp_path / "a.test"
    scene_file.write_text(write_scene(MANY))
    words = ["reduce", str(scene_file), "-o"]
    for name in ("x.png", "x.json", "x.usda"):
        assert CliRunner().invoke(main, [*words, str(tmp_path / name)]).exit_code == 2

    def cut(*args):
        raise KeyboardInterrupt

    monkeypatch.setattr(command_file, "manner_of", cut)
    ended = CliRunner().invoke(main, [*words, str(tmp_path / "small.test")])
    assert ended.exit_code == 130
    assert "nothing is written" in ended.output
