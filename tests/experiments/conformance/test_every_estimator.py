"""Every registered estimator through what any estimator is put through: claims, trials, and a check end to end."""

from __future__ import annotations

import pytest
from builders import box, floor, lamp, scene

from nusselt.experiments.check import question as question_module
from nusselt.experiments.check.check import Answer, Question, References, check
from nusselt.experiments.conformance.trials import CLAIMS, TRIALS, run_trial
from nusselt.experiments.verdict.judge import judge
from nusselt.experiments.verdict.level import Level
from nusselt.renderer.estimators import ESTIMATORS, CommonPoints
from nusselt.renderer.prepared import prepare

pytestmark = pytest.mark.mitsuba

REFERENCES = References()
EVERY = pytest.mark.parametrize("kind", ESTIMATORS, ids=lambda kind: kind.name)


def box_over_floor():
    """A scene that needs visibility: half the floor lies in shadow or penumbra."""
    return scene(floor(), box((-0.7, 0.3, -0.4), (0.0, 0.8, 0.3)), lights=(lamp(2.0, 0.8),), size=(64, 48), name="box")


def answer(estimator, monkeypatch) -> Answer:
    monkeypatch.setattr(question_module, "chosen_estimator", lambda *_: estimator)
    return check(box_over_floor(), Question(margin=1e-2), command="", references=REFERENCES)


@EVERY
def test_it_says_what_it_is(kind):
    estimator = kind(samples=9, stratified=True)
    needs = prepare(box_over_floor()).needs
    assert estimator.claim(needs) in CLAIMS
    assert isinstance(estimator.shares_points, bool)
    assert not (estimator.claim(needs) == "exact" and estimator.is_random(needs))


@pytest.mark.parametrize("trial", TRIALS, ids=lambda trial: trial.__name__)
@EVERY
def test_it_passes_every_trial(kind, trial):
    outcome = run_trial(trial, kind)
    assert outcome.passed, outcome.found


@EVERY
def test_its_verdict_is_as_claimed(kind, monkeypatch):
    """One report of one row each, at a false-alarm rate of 1e-3 and fixed seeds."""
    row = answer(kind(samples=9), monkeypatch).row
    assert row["as_claimed"] is True, row["reason"]
    if row["claim"] in ("exact", "unbiased"):
        assert row["verdict"] == "agrees", row["reason"]
    if row["claim"] == "biased":
        assert row["verdict"] == "differs", row["reason"]


def test_pixels_may_vary_together_where_they_say_so(monkeypatch):
    """The spread of passes that points in common bring is no defect; unsaid, it is one."""
    said = answer(CommonPoints(samples=8), monkeypatch)
    passes = said.row["passes"]
    assert said.row["verdict"] == "agrees", said.row["reason"]
    assert passes >= 32
    unsaid = judge(said.ours, said.reference, passes=passes, margin=1e-2, level=Level())
    assert unsaid.word == "differs"
    assert "as much as independent pixels would" in unsaid.reason
