"""`nusselt compare`: nothing is named where nothing changed, a tenth more variance is, time never is."""

from __future__ import annotations

import copy
import json
import re
from dataclasses import dataclass
from typing import ClassVar
from xml.etree import ElementTree

import numpy as np
import pytest
from builders import floor, lamp, scene
from scipy import stats
from test_cli import run

from nusselt.experiments.check.check import References, check
from nusselt.experiments.check.question import Question
from nusselt.experiments.results.compare import compare_rows
from nusselt.experiments.results.compare.figures import holm
from nusselt.experiments.results.compare.history import history
from nusselt.experiments.results.document import document, write_json
from nusselt.experiments.verdict.intervals import error_of_mean
from nusselt.renderer.estimators import Area

pytestmark = pytest.mark.mitsuba

FALSE_ALARM = 1e-6

# (scene, variance, its standard error, mse, its standard error, bias's standard error and freedom): a run of the
# classic scenes, to four digits.
CLASSIC = (
    ("quad", 0, 0, -6.243e-07, 1.255e-06, 4.409e-05, 31),
    ("quad-random", 0.001005, 8.908e-07, 0.02957, 0.0001438, 9.829e-05, 760.7),
    ("quad-stratified", 0.0001293, 3.548e-07, 0.003809, 1.926e-05, 9.687e-05, 716.1),
    ("three-lights", 9.065e-05, 4.843e-07, 0.002169, 2.106e-05, 6.729e-05, 1770),
    ("cornell", 1.214e-05, 6.022e-08, 0.000713, 8.552e-06, 4.298e-05, 94.08),
    ("cornell-boxes", 5.244e-05, 3.537e-07, 0.002014, 3.047e-05, 0.0001075, 150.1),
    ("glossy", 2.357e-05, 2.11e-07, 0.0003521, 7.096e-06, 6.201e-05, 141.3),
    ("unshadowed", 0, 0, 1.725e-07, 3.962e-07, 2.126e-05, 31),
    ("horizon", 0, 0, 2.145e-06, 1.38e-05, 0.0001443, 31),
    ("near-light", 0, 0, 4.274e-05, 2.326e-05, 0.0001116, 31),
)


def simulated(rng: np.random.Generator, gain: float = 1.0) -> list[dict]:
    """Rows of a run of the classic scenes; ``gain`` multiplies the variance of the first noisy one."""
    rows = []
    planted = False
    for name, variance, variance_error, mse, mse_error, bias_error, freedom in CLASSIC:
        factor = gain if variance and not planted else 1.0
        planted = planted or bool(variance)
        # A standard error with so much freedom, and a t around it.
        error = bias_error * np.sqrt(rng.chisquare(freedom) / freedom)
        rows.append(
            {
                **{"scene": name, "estimator": "area", "samples": 16, "stratified": True, "as_claimed": True},
                **{"verdict": "agrees", "non_finite": 0, "passes": 4, "seconds": {"ours": 4 * rng.random()}},
                **{"bias_relative": bias_error * rng.normal(), "bias_relative_standard_error": error},
                "bias_relative_freedom": freedom,
                **{"variance": factor * variance + variance_error * rng.normal()},
                "variance_standard_error": variance_error,
                **{"mse_relative": factor * mse + mse_error * rng.normal(), "mse_relative_standard_error": mse_error},
            }
        )
    return rows


def test_the_family_wise_level_is_kept_where_nothing_changed():
    """300 pairs of null runs at 5 %: binomial upper bound at 1e-6."""
    rng = np.random.default_rng(1)
    alarms = sum(bool(compare_rows(simulated(rng), simulated(rng), 0.05).changes) for _ in range(300))
    assert alarms <= stats.binom.isf(FALSE_ALARM, 300, 0.05)
    assert alarms > 0  # a level that never alarms would hide changes


def test_a_tenth_more_variance_is_named_every_time():
    rng = np.random.default_rng(2)
    for _ in range(50):
        found = compare_rows(simulated(rng), simulated(rng, gain=1.1))
        assert "variance" in {change.figure for change in found.changes}
        assert {change.row for change in found.changes} == {"quad-random area 16 stratified"}
        assert found.status == 1


def test_a_tenth_less_variance_is_named_and_is_no_failure():
    rng = np.random.default_rng(3)
    found = compare_rows(simulated(rng, gain=1.1), simulated(rng))
    assert found.changes
    assert found.status == 0
    assert "better" in found.lines()[0]


REFERENCES = References()


def small_run(seed: int, estimator: type[Area] | None = None) -> list[dict]:
    made = scene(floor(), lights=(lamp(1.0, 0.6),), size=(160, 120), name="floor")
    question = Question(estimator=estimator, samples=9, margin=5e-3, seed=seed)
    return [check(made, question, command="", references=REFERENCES).row]


@dataclass(frozen=True, kw_only=True)
class Noisier(Area):
    """A tenth more variance: the estimate times 1 or so, independent of it."""

    name: ClassVar[str] = "area"

    def __call__(self, points, source, rng):
        one = super().__call__(points, source, rng)
        other = super().__call__(points, source, rng)
        share = (1 - np.sqrt(1.2)) / 2  # share^2 + (1 - share)^2 = 1.1
        return (1 - share) * one + share * other


def test_real_runs_with_other_seeds_show_nothing_and_a_noisier_estimator_shows():
    runs = [small_run(seed) for seed in range(2)]
    found = compare_rows(*runs)
    assert not found.changes, found.lines()
    assert found.tests == 3
    assert found.detectable < 0.1
    (noisier,) = small_run(2, Noisier)
    assert noisier["estimator"] == "test_compare:Noisier"  # a class of one's own is no estimator of ours by its name
    found = compare_rows(runs[0], [noisier | {"estimator": "area"}])
    assert "variance" in {change.figure for change in found.changes}, found.lines()


def rows() -> list[dict]:
    return simulated(np.random.default_rng(4))


def test_time_is_told_and_never_judged():
    slow = copy.deepcopy(rows())
    for row in slow:
        row["seconds"]["ours"] *= 100
    found = compare_rows(rows(), slow)
    assert not found.changes
    assert found.status == 0
    assert any("100.00 times the baseline's" in line for line in found.lines())
    assert "quad-random area 16 stratified took 100.00 times as long" in found.lines()


def test_rows_that_vanish_are_a_failure_and_new_ones_are_not():
    found = compare_rows(rows(), rows()[1:])
    assert found.missing == ("quad area 16 stratified",)
    assert found.status == 1
    found = compare_rows(rows()[1:], rows())
    assert found.new == ("quad area 16 stratified",)
    assert found.status == 0


@pytest.mark.parametrize(
    ("figure", "value", "worse"),
    [
        ("as_claimed", False, True),
        ("as_claimed", None, True),
        ("non_finite", 1, True),
        ("relative_error", 1e-9, True),
        ("relative_error", 1.5e-12, None),
        ("relative_error", 1e-15, False),
        ("relative_error", None, True),
        ("slope", -0.40, True),
        ("slope", -0.501, None),
        ("variance", 1e-9, True),
        ("bias_relative", -0.01, True),
    ],
)
def test_each_figure_that_moves_is_named(figure, value, worse):
    before = rows()[:1]
    before[0] |= {"relative_error": 1e-12, "slope": -0.5, "slope_standard_error": 0.01}
    after = copy.deepcopy(before)
    after[0][figure] = value
    found = compare_rows(before, after)
    assert [change.worse for change in found.changes] == ([] if worse is None else [worse])
    assert found.status == (1 if worse else 0)


def test_rows_of_one_name_are_told_apart_by_their_order():
    twice = rows()[:1] * 2
    assert compare_rows(twice, twice).rows == 2
    assert compare_rows(twice, twice[:1]).missing == ("quad area 16 stratified",)


def test_holm_is_bonferroni_first_and_looser_after():
    assert holm([0.03, 0.01, 0.04], 0.05) == [False, True, False]
    assert holm([0.02, 0.01, 0.04], 0.05) == [True, True, True]
    assert holm([], 0.05) == []


def test_the_error_of_a_mean_ignores_what_is_smooth():
    """Against the known standard error of noise on a ramp; 200 x 200 pixels give it to 1 %."""
    rng = np.random.default_rng(5)
    ramp = np.add.outer(np.linspace(0, 5, 200), np.linspace(0, 5, 200))
    noise = rng.normal(size=(200, 200))
    judged = rng.random((200, 200)) > 0.1
    assert error_of_mean(ramp + noise, judged) == pytest.approx(judged.sum() ** -0.5, rel=0.05)
    assert error_of_mean(ramp, np.eye(200) > 0) == np.inf


def test_the_command_says_it_all_and_ends_as_it_should(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    old, new, none, bad = (f"{name}.json" for name in ("old", "new", "none", "bad"))
    write_json(document(rows()), old)
    write_json(document(simulated(np.random.default_rng(6), gain=1.3)), new)
    write_json(document([]), none)
    assert run("compare", old, old)[0] == 0
    (tmp_path / "out").mkdir()
    write_json(document(rows()), "out/results.json")  # a folder that `check --out` made stands for it
    assert run("compare", old, "out")[0] == 0
    status, said, _ = run("compare", old, new)
    assert status == 1
    status, content, error = run("compare", old, new, "--json", "-")
    assert (status, error) == (1, said)
    assert json.loads(content)["status"] == 1
    (line,) = (line for line in said.splitlines() if line.startswith("quad-random"))
    told = re.search(r"variance \+([\d.]+) % \[([\d.]+), ([\d.]+)\], worse; mean square error \+", line)
    assert told
    share, low, high = map(float, told.groups())
    assert low < share < high
    assert low < 30 < high
    for content in ("", "[]", '{"schema": 1, "rows": 3}', '{"schema": 99, "rows": []}', json.dumps({"rows": []})):
        (tmp_path / "bad.json").write_text(content)
        status, said, error = run("compare", old, bad)
        assert (status, said) == (2, "")
        assert "bad.json" in error
    for arguments in ((old, none), (none, old), (old, "gone.json"), (old, new, "--alpha", "0")):
        assert run("compare", *arguments)[0] == 2


def test_rows_without_noise_of_their_own_were_not_tested():
    bare = [{"scene": "a", "estimator": "image", "as_claimed": True, "variance": 1.0, "non_finite": 0}]
    found = compare_rows(bare, bare)
    assert (found.status, found.tests) == (3, 0)
    assert "Nothing could be tested" in found.lines()[0]
    assert not any("Nothing changed" in line for line in found.lines())
    found = compare_rows([*bare, *rows()], [*bare, *rows()])
    assert found.status == 0
    assert found.lines()[:2] == [
        "Nothing changed beyond noise.",
        "1 row could not be tested: no figure with its noise.",
    ]


def test_a_bias_is_told_in_points_with_its_interval_and_the_command_again():
    before, after = rows()[:1], copy.deepcopy(rows()[:1])
    before[0]["bias_relative"], after[0]["bias_relative"] = 1e-4, 2.1e-3
    after[0]["command"] = "nusselt check quad"
    line, again, *_ = compare_rows(before, after).lines()
    told = re.search(r"bias \+0\.010 % to \+0\.210 %, by \[\+(\d\.\d+), \+(\d\.\d+)\], worse", line)
    assert told
    assert float(told[1]) < 0.2 < float(told[2])
    assert again == "  again: nusselt check quad"


def test_what_other_programs_read(tmp_path):
    names = [str(tmp_path / name) for name in ("old.json", "new.json")]
    write_json(document(rows()), names[0])
    later = [row | {"command": "nusselt check it"} for row in simulated(np.random.default_rng(6), 1.3)]
    write_json(document(later[1:]), names[1])
    files = {name: tmp_path / f"changes.{name}" for name in ("json", "junit", "summary")}
    status, *_ = run("compare", *names, *(word for name, file in files.items() for word in (f"--{name}", str(file))))
    assert status == 1
    told = json.loads(files["json"].read_text())
    assert {change["figure"] for change in told["changes"]} == {"variance", "mean square error"}
    assert told["missing"] == ["quad area 16 stratified"]
    suite = ElementTree.parse(files["junit"]).getroot()
    failed = {case.get("name") for case in suite if case.find("failure") is not None}
    assert failed == {"quad area 16 stratified", "quad-random area 16 stratified"}
    assert (suite.get("failures"), suite.get("tests")) == ("2", str(len(CLASSIC)))
    page = files["summary"].read_text()
    assert page.startswith("## ❌ 2 rows are worse")
    assert "nusselt check it" in page


def runs(gains: list[float], seed: int) -> dict[str, list[dict]]:
    rng = np.random.default_rng(seed)
    return {f"run {number}": simulated(rng, gain) for number, gain in enumerate(gains)}


def test_the_run_in_which_a_figure_changed_is_named():
    """A tenth up in the fifth of nine runs, and down again in the eighth."""
    found = history(runs([1.0] * 4 + [1.1] * 3 + [1.0] * 2, 8))
    variance = [(run, change.worse) for run, change in found.steps if change.figure == "variance"]
    assert variance == [("run 4", True), ("run 7", False)]
    assert {change.row for _, change in found.steps} == {"quad-random area 16 stratified"}
    assert found.status == 1
    (drawn,) = (line for line in found.lines() if line.endswith("stratified: variance"))
    assert max(drawn[:4]) < min(drawn[4:7]) > max(drawn[7:9])


def test_runs_in_which_nothing_changed_have_no_step():
    """200 histories of six null runs at 5 %: binomial upper bound at 1e-6."""
    alarms = sum(bool(history(runs([1.0] * 6, 100 + k), 0.05).steps) for k in range(200))
    assert alarms <= stats.binom.isf(FALSE_ALARM, 200, 0.05)
    assert alarms > 0


def test_many_files_are_a_history(tmp_path):
    names = []
    for number, (_, some) in enumerate(runs([1.0, 1.0, 1.2], 9).items()):
        names.append(str(tmp_path / f"{number}.json"))
        write_json(document(some), names[-1])
    status, said, _ = run("compare", *names, "--summary", str(tmp_path / "page.md"))
    assert status == 1
    assert said.splitlines()[0].startswith(f"{names[2]}: quad-random area 16 stratified: ")
    assert "2.json" in (tmp_path / "page.md").read_text().replace("\\", "")
    assert run("compare", names[0], names[1], names[1])[0] == 2
