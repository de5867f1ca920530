"""Beyond the range in which Mitsuba is right: right images are never called wrong, wrong ones still are."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from limit_scenes import BODIES, text

from nusselt.experiments.check.check import References, check
from nusselt.experiments.check.draw import Drawing, draw
from nusselt.experiments.check.excuse import reconsidered, rule_error
from nusselt.experiments.check.question import Question
from nusselt.experiments.check.unlit import unlit
from nusselt.experiments.verdict.judge import judge
from nusselt.experiments.verdict.level import Level
from nusselt.renderer.image import Image
from nusselt.renderer.scene import Scene
from nusselt.renderer.scene_text import parse_scene

pytestmark = pytest.mark.mitsuba

MARGIN = 1e-2


WRONG = {
    "light-through-ball": "touches light 1",
    "plate-under-point": "lies 0.0001 before light 1",
    "plate-under-lamp": "lies 0.0005 before light 1",
    "lights-nearly-coincide": "light 2 touches light 1",
    "reverse-of-itself": "two faces of mesh 1 lie in one place",
    "two-balls": "sphere 1 and sphere 2 lie in one place",
    "light-in-ceiling": "mesh 1 and light 1 lie in one place",
}


def made(name: str, size: str = "32 24") -> Scene:
    return parse_scene(text(name, size)).with_(name=name)


@cache
def answer(name: str, size: str = "32 24"):
    return check(made(name, size), Question(estimator="exact", margin=MARGIN), command="", references=References())


@pytest.mark.parametrize("name", [name for name in BODIES if name not in WRONG][::2])
def test_a_right_image_is_never_called_wrong_and_never_waited_for(name):
    started = time.process_time()
    row = answer(name).row
    assert row["verdict"] != "differs", row["reason"]
    assert time.process_time() - started < 60


@pytest.mark.parametrize("name", WRONG)
def test_the_cause_is_named_with_its_place(name):
    found = answer(name, "48 36")
    limits = found.reference.limits
    assert found.row["verdict"] != "differs"
    assert any(WRONG[name] in limit for limit in limits), limits


def told(name: str, change) -> tuple[str, str]:
    """The words for an image of ours that is changed, before and after the reference's own limits are looked at."""
    found = answer(name, "48 36")
    ours, known = change(found.ours), {"passes": 1, "margin": 1e-3, "level": Level()}
    verdict = judge(ours, found.reference, **known)
    return verdict.word, reconsidered(verdict, made(name, "48 36"), ours, found.reference, **known).word


def brighter(image: Image) -> Image:
    return replace(image, mean=image.mean * 1.05)


def dark_corner(image: Image) -> Image:
    mean = image.mean.copy()
    mean[:, 24:, :12] *= 0.5
    return replace(image, mean=mean)


@pytest.mark.parametrize("name", ["plate-under-lamp", "lights-nearly-coincide"])
def test_what_the_rule_explains_is_forgiven(name):
    assert told(name, lambda image: image) == ("differs", "undecided")


@pytest.mark.parametrize("change", [brighter, dark_corner])
@pytest.mark.parametrize("name", ["light-through-ball", "ball-under-lamp", "ball-on-floor"])
def test_a_defect_in_such_a_scene_is_still_found(name, change):
    assert told(name, change) == ("differs", "differs")


def test_the_rules_error_is_where_it_is_and_nowhere_else():
    added, error = rule_error(made("ball-on-floor", "48 36"), 1)
    mean = answer("ball-on-floor", "48 36").reference.mean
    off = np.abs(added) > 5 * error + 1e-3 * mean.max()
    assert off.mean() < 0.01
    added, _ = rule_error(made("plate-under-point"), 1)
    assert (added.sum(axis=0) > 0).mean() > 0.2


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("faces-away", "faces away from it all: swap its two edges"),
        ("light-in-ball", "something always stands before it"),
        ("plate-under-point", "something always stands before it"),
        ("light-flat-in-floor", "faces away from it all"),
        ("ball-on-floor", ""),
        ("ground-sun", ""),
        ("no-light", ""),
    ],
)
def test_a_light_that_lights_nothing_says_why(name, why):
    said = unlit(made(name))
    assert bool(said) == bool(why)
    assert all(why in sentence for sentence in said)


def test_a_black_image_says_which_light_faces_away():
    row = answer("faces-away").row
    assert (row["verdict"], row["as_claimed"]) == ("undecided", None)
    assert "nothing to judge" in row["reason"]
    assert "swap its two edges" in row["reason"]


def test_a_black_render_says_it_and_why():
    (said,) = (warning for warning in draw(made("faces-away"), Drawing()).warnings if "black" in warning)
    assert "swap its two edges" in said
    assert not any("black all over" in warning for warning in draw(made("ball-on-floor"), Drawing()).warnings)


def test_a_light_below_the_horizon_lights_nothing():
    below = parse_scene(text("no-light") + "point 0 -3 0 1 1 1\ndirectional 0 -1 0 1 1 1\n")
    assert [sentence.split(": ")[1] for sentence in unlit(below)] == ["it lies below every horizon"] * 2
