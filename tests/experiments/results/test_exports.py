"""Results for other programs: every row is there, hostile names are text, no rows are a failure."""

from __future__ import annotations

import csv
import io
import json
import re
from xml.etree import ElementTree

import pytest
from builders import floor, lamp, scene
from places import ROOT
from report_folder import HOSTILE, row, timed
from test_cli import SMALL, run

import nusselt
from nusselt.experiments.results.document import document
from nusselt.experiments.results.exports import csv_table, junit, markdown
from nusselt.experiments.results.exports.markdown import LIMIT
from nusselt.experiments.results.notebook import results_html

ROWS = [row("right"), row("wrong", "differs", False), row("unknown", "undecided", None), *map(row, HOSTILE)]


def test_the_summary_leads_with_the_verdict_and_what_failed():
    text = markdown(document([*ROWS, *timed("right", "ours", "area", 0.1)], alpha=1e-3))
    assert text.startswith("## ❌ 1 of 8 rows is not as claimed, 1 undecided\n")
    table = [line for line in text.splitlines() if line.startswith("| ") and "---" not in line]
    assert "wrong" in table[1]
    assert "unknown" in table[2]
    assert len(table) == 1 + 8 + 4
    assert "` nusselt check 'wrong' `" in text


def test_hostile_names_are_text_in_markdown():
    text = markdown(document(ROWS, alpha=1e-3))
    assert "<script" not in text
    assert "<img" not in text
    bars = {len(re.findall(r"(?<!\\)\|", line)) for line in text.splitlines() if line.startswith("| ")}
    assert bars == {10}


def test_a_million_rows_are_cut_below_the_limit_and_counted():
    text = markdown(document([row(f"scene {k}", "differs", False) for k in range(5000)]))
    assert LIMIT // 2 < len(text.encode()) < LIMIT
    left = int(re.search(r"(\d+) further lines are in results.json", text).group(1))
    assert 0 < left < 11000


def test_junit_fails_what_is_not_as_claimed_and_skips_what_is_undecided():
    suite = ElementTree.fromstring(junit(document(ROWS)))
    assert (suite.get("tests"), suite.get("failures"), suite.get("skipped")) == ("8", "1", "1")
    cases = {case.get("name"): case for case in suite}
    assert cases["wrong area 16 stratified"].find("failure").get("message") == "because wrong is so"
    assert cases["unknown area 16 stratified"].find("skipped") is not None
    assert len(cases) == 8
    assert len(cases["right area 16 stratified"]) == 0


@pytest.mark.parametrize("rows", [[], timed("a", "ours", "area", 1.0)])
def test_nothing_judged_is_a_failure(rows):
    suite = ElementTree.fromstring(junit(document(rows)))
    assert suite.get("failures") == "1"
    assert suite.find("testcase/failure") is not None
    assert markdown(document(rows)).startswith("## ❌ Nothing was measured")


def test_csv_holds_every_figure_of_every_row():
    (first, *rest) = csv.DictReader(io.StringIO(csv_table(document(ROWS))))
    assert len(rest) == 7
    assert first["scene"] == "right"
    assert float(first["bias_interval.0"]) == ROWS[0]["bias_interval"][0]
    assert first["reference.version"] == "3.9.1"
    assert first["left_out.0.what"] == "sphere intersections"
    assert rest[1]["as_claimed"] == ""


def test_csv_has_no_formulas():
    cells = [cell for line in csv.reader(io.StringIO(csv_table(document([row("=1+1"), row("@x")])))) for cell in line]
    assert "'=1+1" in cells
    assert not any(cell.startswith(("=", "@")) for cell in cells)


def test_csv_of_nothing_is_a_header_alone():
    assert csv_table(document([])).strip() == ""


def test_check_writes_them_all(tmp_path):
    (tmp_path / "a.test").write_text(SMALL)
    files = {name: tmp_path / f"x.{name}" for name in ("summary", "junit", "csv")}
    options = [word for name, path in files.items() for word in (f"--{name}", path)]
    status, said, _ = run("check", tmp_path / "a.test", "--margin", 0.01, "--json", "-", *options)
    assert status == 0
    assert files["summary"].read_text().startswith("## ✅ The one row agrees with Mitsuba")
    assert ElementTree.fromstring(files["junit"].read_text()).get("failures") == "0"
    assert len(files["csv"].read_text().splitlines()) == 2
    assert "--csv" not in json.loads(said)["rows"][0]["command"]


def test_the_library_does_what_the_commands_do_and_shows_itself(tmp_path):
    made = scene(floor(), lights=(lamp(),), size=(24, 18), name="<b>floor</b>")
    results = nusselt.check(made, samples=4, margin=0.01, seed=5)
    assert (results.verdict, results.agrees) == ("agrees", True)
    assert results.row["command"] == "nusselt.check(<scene <b>floor</b>>, samples=4, margin=0.01, seed=5)"
    html = results._repr_html_()
    assert "agrees" in html
    assert "<b>floor" not in html
    assert html.count("data:image/png") == 3
    results.write(tmp_path / "out", csv=tmp_path / "x.csv")
    assert nusselt.write_report(tmp_path / "out", tmp_path / "page.html") == 1
    assert 'class="viewer"' in (tmp_path / "page.html").read_text(encoding="utf-8")
    same = nusselt.compare(tmp_path / "out" / "results.json", tmp_path / "out" / "results.json")
    assert same.status == 0
    assert "Nothing changed" in same._repr_html_()


def test_hostile_names_are_text_in_a_notebook():
    assert "<script" not in results_html(document(ROWS))
    assert "<img" not in results_html(document(ROWS))


def test_the_ready_workflow_asks_for_commands_and_options_that_exist():

    from nusselt.experiments.cli.main import main

    text = (ROOT / ".github" / "workflows" / "nusselt.yml").read_text(encoding="utf-8")
    asked = re.findall(r"bin/nusselt (\w+)((?: [^\n]+|\n {10}--[^\n]+)*)", text)
    assert [name for name, _ in asked] == ["check", "run", "report", "compare", "report"]
    for name, words in asked:
        known = {option for parameter in main.get_command(None, name).params for option in parameter.opts}
        assert set(re.findall(r"--?[a-z]+(?= |$)", words)) <= known
