"""The interface of `results.json`: documented whole, checked on writing and on reading."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from report_folder import row
from test_cli import run

from nusselt.experiments.results.document import document, read_json, write_json
from nusselt.experiments.results.schema import HEAD, JUDGED, READABLE, ROW, SCHEMA, names
from nusselt.experiments.runs.experiment import Outcome
from nusselt.experiments.verdict.judge import Verdict
from nusselt.renderer.errors import InputError

WRONG = (
    ("tile_p", "x", "lists of numbers, all of one length"),
    ("tiles", [[1.0], [1.0, 2.0]], "lists of numbers, all of one length"),
    ("bias_interval", [0], "two numbers, the lower first"),
    ("bias_interval", [1, 0], "two numbers, the lower first"),
    ("pixels", 7, "an object"),
    ("reference", "mitsuba", "an object"),
    ("left_out", {"what": "x"}, "a list of objects"),
    ("warnings", ["a", 3], "a list of texts"),
    ("as_claimed", 1, "true or false"),
    ("samples", True, "a whole number, 0 or more"),
    ("samples", -1, "a whole number, 0 or more"),
    ("verdict", "perhaps", "one of agrees, differs, undecided"),
    ("seconds", "soon", "a finite number, or a list of numbers, or an object"),
)


@pytest.mark.parametrize(("name", "value", "accepted"), WRONG)
def test_a_wrong_entry_is_one_error_that_names_everything(name, value, accepted, tmp_path):
    path = tmp_path / "results.json"
    found = document([row("right"), row("wrong") | {name: value}])
    with pytest.raises(InputError) as written:
        write_json(found, str(path))
    assert not path.exists()
    path.write_text(json.dumps(found))
    status, said, error = run("report", tmp_path, "-o", tmp_path / "page.html")
    assert (status, said) == (2, "")
    for told in (str(written.value), " ".join(error.split())):
        assert f"row 2: {name} = " in told
        assert accepted in told
    assert str(path) in str(written.value)
    with pytest.raises(InputError, match=f"row 1: {name} = "):
        Outcome([{name: value}])


def test_parts_of_objects_are_looked_at_too():
    with pytest.raises(InputError, match=r"row 1: reference\.samples = many: expected a whole number"):
        Outcome([{"reference": {"samples": "many"}}])
    with pytest.raises(InputError, match=r"row 1: left_out\.why = 3: expected a text"):
        Outcome([{"left_out": [{"what": "a", "why": "b"}, {"why": 3}]}])


def test_anything_may_be_missing_null_of_another_name_or_of_numpy():
    Outcome([{}, dict.fromkeys(names(ROW)), {"anything": {"else": [1]}}])
    Outcome([{"samples": np.int64(4), "bias_interval": np.array([0.0, np.nan]), "as_claimed": np.bool_(True)}])


@pytest.mark.parametrize("schema", [*READABLE, 99, None])
def test_files_of_before_are_read_and_those_to_come_are_not(schema, tmp_path):
    path = tmp_path / "results.json"
    path.write_text(json.dumps({"schema": schema, "rows": [row("a")]}))
    if schema in READABLE:
        assert read_json(path)["rows"] == [row("a")]
        return
    with pytest.raises(InputError, match=r"schema = .*: expected a results\.json of schema 1 or 2"):
        read_json(path)


def test_every_entry_is_told_once_and_the_judge_has_those_it_says():
    assert SCHEMA in READABLE
    for entries in (HEAD, ROW):
        assert len(set(names(entries))) == len(entries)
        assert all(entry.meaning for entry in entries)
    assert set(names(JUDGED)) <= {field.name for field in dataclasses.fields(Verdict)}
    assert not set(row("a")) - set(names(ROW))
