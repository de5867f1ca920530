"""The main job end to end: right images agree, planted defects differ, what cannot be judged is undecided."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from builders import floor, lamp, scene

from nusselt.experiments.check import check as check_module
from nusselt.experiments.check.check import References, check, seeds
from nusselt.experiments.check.estimators import told_name
from nusselt.experiments.check.question import Question
from nusselt.experiments.check.rows import as_claimed
from nusselt.experiments.results.document import exit_code
from nusselt.experiments.verdict.level import Level
from nusselt.mitsuba_bridge import reference as reference_module
from nusselt.mitsuba_bridge.llvm import Backend
from nusselt.mitsuba_bridge.process import ReferenceUnavailable
from nusselt.mitsuba_bridge.reference import render_reference
from nusselt.renderer.estimators import Area
from nusselt.renderer.surfaces import Material

pytestmark = pytest.mark.mitsuba

REFERENCES = References()
COARSE = 1e-2
"""A margin for what differs by far more, or is not judged: it needs a hundredth of the passes."""


def lit_floor(**options):
    """A lamp over a floor, part of the lamp in view."""
    return scene(floor(), lights=(lamp(1.0, 0.6),), size=(64, 48), **options)


def answer(made, question: Question | None = None):
    return check(made, question or Question(samples=16), command="", references=REFERENCES)


def test_a_right_image_agrees():
    row = answer(lit_floor()).row
    assert (row["verdict"], row["as_claimed"]) == ("agrees", True), row["reason"]
    low, high = row["bias_interval"]
    assert -row["margin"] < low < row["bias_relative"] < high < row["margin"]
    assert row["margin"] < row["minimum_detectable_bias"] < 3 * row["margin"]
    assert exit_code([row]) == 0


@dataclass(frozen=True, kw_only=True)
class NoCosine(Area):
    """The surface's cosine forgotten, as far as the lamp's centre tells."""

    name: ClassVar[str] = "no-cosine"

    def __call__(self, points, source, rng):
        to = np.array([[0.0], [1.0], [0.0]]) - points.position  # towards the lamp's centre
        cosine = (points.normal * to).sum(axis=0) / np.sqrt((to * to).sum(axis=0))
        return super().__call__(points, source, rng) / cosine


@dataclass(frozen=True, kw_only=True)
class HalfArea(Area):
    """Half the light's area."""

    name: ClassVar[str] = "half-area"

    def __call__(self, points, source, rng):
        return super().__call__(points, source, rng) / 2


@dataclass(frozen=True, kw_only=True)
class OneNaN(Area):
    """One pixel that is not a number."""

    name: ClassVar[str] = "one-nan"

    def __call__(self, points, source, rng):
        out = super().__call__(points, source, rng)
        out[:, 0] = np.nan
        return out


@pytest.mark.parametrize("defect", [NoCosine, HalfArea, OneNaN])
def test_a_defective_estimator_differs(defect):
    row = answer(lit_floor(), Question(estimator=defect, samples=16, margin=COARSE)).row
    assert (row["verdict"], row["as_claimed"]) == ("differs", False)
    assert exit_code([row]) == 1
    if defect is OneNaN:
        assert row["non_finite"] >= 1


def test_half_a_pixel_of_shift_differs(monkeypatch):
    import nusselt.renderer.camera.view as view

    straight = view.primary_directions
    monkeypatch.setattr(view, "primary_directions", lambda s, x, y: straight(s, x + 0.5, y + 0.5))
    row = answer(lit_floor(), Question(samples=16, margin=COARSE)).row
    assert row["verdict"] == "differs"
    assert "emitter or the background on one side only" in row["reason"]


def test_a_bias_within_the_declared_margin_agrees_and_beyond_it_differs():
    @dataclass(frozen=True, kw_only=True)
    class Gain(Area):
        name: ClassVar[str] = "gain"

        def __call__(self, points, source, rng):
            return super().__call__(points, source, rng) * 0.995

    assert answer(lit_floor(), Question(estimator=Gain, samples=16, margin=0.03)).row["verdict"] == "agrees"
    assert answer(lit_floor(), Question(estimator=Gain, samples=16, margin=2e-3)).row["verdict"] == "differs"


def test_boxed_pixels_agree_with_boxed_pixels_only():
    boxed = answer(lit_floor(spp=4), Question(samples=4, margin=0.01)).row
    assert boxed["verdict"] == "agrees", boxed["reason"]


def test_a_scene_without_light_leaves_nothing_to_judge():
    row = answer(scene(floor(), size=(16, 12))).row
    assert (row["verdict"], row["as_claimed"]) == ("undecided", None)
    assert "nothing to judge" in row["reason"]
    assert row["bias"] == 0
    assert row["reference"]["samples"] == 1


def test_emission_of_a_surface_is_seen_alike():
    glowing = Material((0.5, 0.4, 0.3), emission=(0.1, 0.2, 0.3))
    row = answer(scene(floor(material=glowing), lights=(lamp(),), size=(32, 24))).row
    assert row["verdict"] == "agrees", row["reason"]


def test_a_glossy_scene_without_llvm_is_undecided_and_says_why(monkeypatch):
    monkeypatch.setattr(reference_module, "backend", lambda: Backend("scalar_rgb", None, "no LLVM was found"))
    glossy = scene(floor(material=Material((0.5, 0.5, 0.5), (0.2, 0.2, 0.2), 9)), lights=(lamp(),))
    row = check(glossy, Question(margin=COARSE), command="", references=References()).row
    assert row["verdict"] == "undecided"
    assert "no LLVM was found" in row["reason"]
    assert exit_code([row]) == 3


def test_a_reference_that_cannot_run_is_undecided_with_status_4(monkeypatch):
    def fail(*_, **__):
        raise ReferenceUnavailable("Mitsuba's process was ended by SIGABRT")

    monkeypatch.setattr(check_module, "render_reference", fail)
    row = check(lit_floor(), Question(samples=4, margin=COARSE), command="", references=References()).row
    assert (row["verdict"], row["as_claimed"]) == ("undecided", None)
    assert "SIGABRT" in row["reason"]
    assert exit_code([row]) == 4


def test_scenes_that_look_alike_share_a_reference(monkeypatch):
    calls = []

    def counted(*arguments, **options):
        calls.append(arguments)
        return render_reference(*arguments, **options)

    monkeypatch.setattr(check_module, "render_reference", counted)
    shared = References()
    for samples in (4, 9):
        made = lit_floor(light_samples=samples, name=f"with-{samples}")
        check(made, Question(margin=0.01), command="", references=shared)
    assert len(calls) == 1


def test_claims():
    assert as_claimed("unbiased", "agrees", False) is True
    assert as_claimed("unbiased", "differs", False) is False
    assert as_claimed("exact", "undecided", False) is None
    assert as_claimed("biased", "differs", False) is True
    assert as_claimed("biased", "agrees", True) is False
    assert exit_code([]) == 1  # nothing measured is a failure


def test_somebodys_class_of_one_of_our_names_is_told_by_where_it_stands():
    mine = type("Mine", (Area,), {})
    named = type("Named", (Area,), {"name": "mine"})
    assert told_name(Area(samples=4)) == "area"
    assert told_name(mine(samples=4)).endswith(":Mine")
    assert told_name(named(samples=4)) == "mine"


def test_seeds_depend_on_names_and_not_on_order():
    assert seeds(1, "a") == seeds(1, "a")
    assert len({tuple(seeds(s, n)) for s in (1, 2) for n in ("a", "b")}) == 4


def test_too_little_noise_budget_is_undecided(monkeypatch):
    monkeypatch.setattr(check_module, "MAX_PASSES", 2)
    row = answer(lit_floor(), Question(samples=1, margin=1e-2, level=Level(1e-3, 1))).row
    assert row["verdict"] == "undecided"
    assert "times the samples" in row["reason"]
