"""What pixels should show: said in the scene, written again, and judged with the rest at the declared level."""

import numpy as np
import pytest
from builders import floor, lamp, scene
from scipy import stats

from nusselt.experiments.check.check import References, check
from nusselt.experiments.check.question import Question
from nusselt.experiments.verdict.expected import SHARE, from_expected, rest, with_pixels
from nusselt.experiments.verdict.judge import judge
from nusselt.experiments.verdict.level import Level
from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Area, Exact
from nusselt.renderer.expected_pixel import ExpectedPixel
from nusselt.renderer.image import render
from nusselt.renderer.scene_text import parse_scene, write_scene

HEAD = "size 4 3\ncamera 0 0 4 0 0 0 0 1 0 45\n"
ROOM = scene(floor(), lights=(lamp(),), size=(32, 24))
AT = (15, 14)


def test_they_are_read_and_written_and_change_no_pixel():
    made = parse_scene(HEAD + "expectPixel 3 2 1 2 3 0.5\nexpectPixel 0 0 0 0 0 1\n")
    assert made.pixels == (ExpectedPixel(3, 2, (1, 2, 3), 0.5), ExpectedPixel(0, 0, (0, 0, 0), 1))
    assert parse_scene(write_scene(made)) == made
    assert made.digest() == made.with_(pixels=()).digest()


@pytest.mark.parametrize(
    ("line", "named"),
    [
        ("4 0 1 1 1 1", "a pixel of 4 x 3"),
        ("0 -1 1 1 1 1", "expectPixel y"),
        ("0.5 0 1 1 1 1", "expectPixel x"),
        ("0 0 1 1 -1 1", "expectPixel radiance"),
        ("0 0 1 1 1 -1", "expectPixel percent"),
        ("0 0 1 1 1 1\nexpectPixel 0 0 1 1 1 1", "a second time"),
    ],
)
def test_what_is_none_is_refused(line, named):
    with pytest.raises(InputError, match=named):
        parse_scene(f"{HEAD}expectPixel {line}\n")


@pytest.fixture(scope="module")
def right():
    """The exact image, and one with noise in eight passes."""
    return render(ROOM, Exact()), render(ROOM, Area(samples=64, stratified=True), seed=4, passes=8)


def verdict_of(right, factor, percent, noisy=True):
    exact, image = right
    ours, passes = (image, 8) if noisy else (exact, 1)
    radiance = tuple((factor * exact.mean[:, AT[1], AT[0]]).tolist())
    pixels = (ExpectedPixel(*AT, radiance, percent),)
    level = Level()
    known = judge(ours, Reference.of_image(exact, "ours", 1), passes=passes, margin=0.05, level=rest(level, pixels))
    assert known.word == "agrees", known.reason
    return with_pixels(known, ours, passes, pixels, level)


@pytest.mark.parametrize(
    ("factor", "percent", "noisy", "word"),
    [
        (1.0, 30.0, True, "agrees"),
        (2.0, 1.0, True, "differs"),
        (1.0, 0.01, True, "undecided"),
        (1.0, 0.0, False, "agrees"),
        (1.001, 0.05, False, "differs"),
        (1.0004, 0.05, False, "agrees"),
    ],
)
def test_a_row_holds_for_them_too(right, factor, percent, noisy, word):
    found = verdict_of(right, factor, percent, noisy)
    assert found.word == word
    assert ("pixel 15, 14 is off what is expected by" in found.reason) == (word != "agrees")


def test_right_readings_differ_no_more_often_than_declared():
    """A false alarm in 20,000 readings of a level of 1 % each: binomial, at 1e-6; without noise's share far more."""
    rng, level, n, passes = np.random.default_rng(5), 0.01, 20_000, 8
    noise = rng.standard_normal((passes, 3, n))
    mean, variance = 1 + 0.1 * noise.mean(axis=0), 0.01 * noise.var(axis=0, ddof=1)
    found = from_expected(mean, variance, passes, np.ones((3, n)), np.zeros(n), level * n)
    alarms = sum(found.said("it", k)[0] == "differs" for k in range(n))
    assert stats.binom.sf(alarms - 1, n, level) > 1e-6
    naive = sum(np.abs(found.value[:, k]).max() > found.half[:, k].max() / 2 for k in range(n))
    assert stats.binom.sf(naive - 1, n, level) < 1e-6


def test_the_rules_leave_them_their_share():
    pixel = (ExpectedPixel(0, 0, (1, 1, 1)),)
    assert rest(Level(), ()) == Level()
    assert rest(Level(), pixel).alpha + SHARE * Level().alpha == pytest.approx(Level().alpha)


@pytest.mark.mitsuba
def test_a_check_judges_them():
    radiance = tuple(1.1 * render(ROOM, Exact()).mean[:, AT[1], AT[0]])
    made = ROOM.with_(pixels=(ExpectedPixel(*AT, radiance, 1.0),))
    row = check(made, Question(estimator="exact", margin=0.01), command="", references=References()).row
    assert (row["verdict"], row["as_claimed"]) == ("differs", False)
    assert "pixel 15, 14 is off what is expected by [-9.09" in row["reason"]
    with pytest.raises(InputError, match="pixels of 4 x 3"):
        check(made.with_(width=4, height=3), Question(margin=0.5), command="", references=References())
