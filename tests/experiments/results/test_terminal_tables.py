"""Verdicts in terminals of any usual width: no number is cut, and one line says it all."""

from __future__ import annotations

import io
import re

import pytest
from places import ROOT
from rich.console import Console

from nusselt.experiments.cli.stability import show
from nusselt.experiments.console import console, say, say_command
from nusselt.experiments.results.columns import COLUMNS
from nusselt.experiments.results.study_tables import table
from nusselt.experiments.results.tables import closing, verdict_table
from nusselt.experiments.sensors.table import sensor_table
from nusselt.experiments.verdict.decision import AS_CLAIMED


def row(scene: str, verdict: str, bias: float) -> dict:
    return {
        "scene": scene,
        "estimator": "area",
        "samples": 25,
        "stratified": True,
        "claim": "unbiased",
        "verdict": verdict,
        "as_claimed": {"agrees": True, "differs": False, "undecided": None}[verdict],
        "bias_relative": bias,
        "bias_interval": [bias - 1e-3, bias + 1e-3],
        "minimum_detectable_bias": 1.44e-3,
        "rms_relative": 0.0473,
        "course_expected": {"mse": [2.67, 2.93], "bias": [-0.1, 0.1]},
        "course_bias": 0.01,
        "course_mse": 2.8,
        "seconds": {"ours": 51.6, "reference": 0.4},
    }


ROWS = [row("three-lights", "agrees", 1e-5), row("cornell-glossy", "differs", -0.1234), row("mine", "undecided", 2e-3)]


def told(width: int, rows=ROWS) -> list[str]:
    page = io.StringIO()
    Console(file=page, width=width).print(verdict_table(rows, 1e-3, width))
    return page.getvalue().splitlines()


@pytest.mark.parametrize("width", [80, 100, 140])
def test_names_and_numbers_are_whole(width):
    lines = told(width)
    assert max(map(len, lines)) <= width
    (line,) = (line for line in lines if "cornell-glossy" in line)
    for word in ("area 25", "differs", "-12.340", "-12.440 to -12.240", "0.144"):
        assert word in line


@pytest.mark.parametrize(("least", "shown"), [(0.5, "50.000"), (1550.14, "> 100")])
def test_no_bias_beyond_the_whole_is_said_to_be_found(least, shown):
    (line,) = (
        line
        for line in told(80, [ROWS[0] | {"minimum_detectable_bias": least}])
        if "differs" in line or "agrees" in line
    )
    assert shown in line
    assert "155014" not in line


def test_names_of_the_stability_table_are_whole_at_80_columns():
    page = io.StringIO()
    name = "triangle-beside-its-own-edge"
    figures = dict.fromkeys(("relative_error", "error_bound", "condition", "textbook_error", "mitsuba"), 1e-9)
    case = {"name": name, "dtype": "float64", "form": "mesh irradiance", "bound_held": True, "value": 1.0, **figures}
    show([case], Console(file=page, width=80))
    assert name in page.getvalue()


@pytest.mark.parametrize(("rows", "has"), [(ROWS, True), (ROWS[2:], False)], ids=["the course's", "one's own"])
def test_scores_of_the_course_are_of_its_scenes(rows, has):
    assert any("2.67 to 2.93" in line for line in told(140, rows)) is has


def test_every_figure_of_the_table_is_in_the_glossary():
    words = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
    terms = re.findall(r"\*\*([^*]+)\*\*", words)
    assert len(terms) == len(set(terms))
    for name in [column.name.removeprefix("its ") for column in COLUMNS if column.number] + list(AS_CLAIMED):
        assert any(term.lower().startswith(name.lower()) for term in terms), name
    assert "docs/glossary.md" in (ROOT / "README.md").read_text(encoding="utf-8")


def test_one_line_closes():
    assert closing(ROWS[:1]) == "1 of 1 agrees"
    one_of_each = "1 of 3 agrees; cornell-glossy area 25 stratified differs; mine area 25 stratified is undecided"
    assert closing(ROWS) == one_of_each
    assert closing(ROWS[1:2] * 2 + ROWS[:1] * 2) == (
        "2 of 4 agree; cornell-glossy area 25 stratified, cornell-glossy area 25 stratified differ"
    )


@pytest.mark.parametrize(("said", "width"), [("80", 80), ("", 140), ("wide", 140)])
def test_where_there_is_no_terminal_columns_are_as_said(monkeypatch, said, width):
    monkeypatch.setenv("COLUMNS", said)
    assert console().width == width


NOTE = "What is the same in every row, and long, is said but once."
MEASURED = [
    {"experiment": "made-up", "scene": scene, "rule": "area", "note": NOTE, "cause": cause}
    | {f"figure_number_{k}": 1.23456 * k + number for k in range(9)}
    for number, (scene, cause) in enumerate(
        [("quad", ""), ("cornell-boxes", "a sentence that would take most of a table"), ("glossy", "x" * 50)]
    )
]


@pytest.mark.parametrize("width", [80, 100, 140])
def test_rows_of_experiments_keep_their_numbers_and_say_sentences_once(width):
    page = io.StringIO()
    Console(file=page, width=width).print(table(MEASURED, "made-up: rows", width))
    said = page.getvalue()
    assert max(map(len, said.splitlines())) <= width
    for row in MEASURED:
        assert all(f" {row[f'figure_number_{k}']:.4g} " in said for k in range(9))
    assert said.count("in every row: rule area") == said.count("said but once") == 1
    for number, cause in enumerate((MEASURED[1]["cause"], MEASURED[2]["cause"]), start=1):
        assert said.count(f"({number}) {cause}") == 1
    # Where columns need a second table, it says again what its rows are about.
    assert said.count("cornell-boxes") == (1 if width == 140 else 2)


def test_columns_are_repeated_until_rows_are_told_apart():
    rows = [
        {"scene": scene, "target": k} | {f"figure{n}": 0.1 * k + n for n in range(9)} for scene in "xy" for k in (1, 2)
    ]
    page = io.StringIO()
    Console(file=page, width=60).print(table(rows, "made-up: rows", 60))
    heads = [line.split() for line in page.getvalue().splitlines() if "scene" in line]
    assert len(heads) > 1
    assert all(head[:2] == ["scene", "target"] for head in heads)


def test_columns_that_tell_rows_apart_are_repeated_wherever_they_stand():
    rows = [
        {"what": what, "order": 2.0 if what == "a" else None, "height": height}
        | {f"figure{n}": n + height for n in range(9)}
        for what in "ab"
        for height in (1, 2)
    ]
    page = io.StringIO()
    Console(file=page, width=60).print(table(rows, "made-up: rows", 60))
    heads = [line.split() for line in page.getvalue().splitlines() if "what" in line]
    assert len(heads) > 1
    assert all(head[:2] == ["what", "height"] for head in heads)


def test_of_many_rows_the_ones_not_as_claimed_are_shown_by_their_names_and_the_rest_counted():
    rows = [{"name": f"case {n}, in more than forty characters of words", "error": 0.5 * n} for n in range(300)]
    for row in rows:
        row["as_claimed"] = row["error"] != 100
    page = io.StringIO()
    Console(file=page, width=80).print(table(rows, "made-up: rows", 80))
    said = page.getvalue()
    assert said.index("case 200,") < said.index("case 0,")
    assert "100 of 300 rows" in said
    assert "(1)" not in said
    assert len(said.splitlines()) < 320


@pytest.mark.parametrize("width", [80, 100, 140])
def test_sentences_end_between_words_on_a_terminal_and_are_one_line_elsewhere(width):
    words = [f"word{n:03}" for n in range(60)] + [":star:", "[bold]"]
    for terminal in (True, False):
        page = io.StringIO()
        told = Console(file=page, width=width, force_terminal=terminal, emoji=False, highlight=False)
        say(told, " ".join(words))
        lines = page.getvalue().splitlines()
        assert " ".join(lines).split() == words
        assert len(lines) == 1 or max(map(len, lines)) <= width
        assert (len(lines) > 1) is terminal


def test_a_command_is_one_line_on_any_terminal():
    page = io.StringIO()
    say_command(Console(file=page, width=40, force_terminal=True), f"again: {'nusselt ' * 20}")
    assert page.getvalue().count("\n") == 1


@pytest.mark.parametrize("width", [80, 100, 140])
def test_readings_of_sensors_are_whole(width):
    rows = [
        {
            **{"scene": "sens", "sensor": k, "estimator": "area", "samples": 25, "stratified": True},
            **{"position": [1.2346, -1.0, 0.5 * k], "normal": [0.0, 1.0, 0.1 * k]},
            **{"reading": [2.29453 + k] * 3, "reading_standard_error": [0.003] * 3},
            **{"reference_reading": [2.30012 + k] * 3, "reference_standard_error": [1e-5] * 3},
            **{"difference_interval": [-0.37439 - k, -0.37182 - k], "expected_reading": [6.0 + k] * 3},
            **{"expected_interval": [-0.37438 - k, -0.37181 - k], "verdict": "undecided", "as_claimed": None},
        }
        for k in (1, 2)
    ]
    page = io.StringIO()
    Console(file=page, width=width).print(sensor_table(rows, width))
    said = page.getvalue()
    assert max(map(len, said.splitlines())) <= width
    for whole in ("-137.439 to -137.182", "-137.438 to -137.181", "3.29453 ± 0.003", "3.30012 ± 1e-05", "undecided"):
        assert whole in said
    assert said.count("area 25 stratified") == 1


def test_what_a_verdict_does_not_say_is_said_beside_it():
    consistent = row("quad", "differs", 0.02) | {"claim": "consistent", "as_claimed": True}
    assert closing([consistent, ROWS[0]]) == "1 of 2 agrees; quad area 25 stratified differs as claimed"
    assert any("differs as claimed" in line for line in told(140, [consistent]))
    assert not any("claimed" in line for line in told(140))


def test_of_many_rows_that_differ_six_are_named():
    many = [row(f"scene{n}", "differs", 0.02) for n in range(20)]
    assert closing(many).endswith("scene5 area 25 stratified and 14 more differ")
