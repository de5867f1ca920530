"""The museum's bugs: each shows in its images at the size they are judged at."""

import sys
import types

import numpy as np
import pytest

from nusselt.experiments.defects.museum import MUSEUM
from nusselt.experiments.independent.steps import RIGHT
from nusselt.experiments.studies.museum import SAMPLES, cells, show, summary
from nusselt.experiments.studies.planted_images import images_of

WIDTH = 48


@pytest.mark.parametrize("exhibit", MUSEUM, ids=lambda exhibit: exhibit.mistake.name)
def test_every_bug_shows_at_the_size_of_its_row(exhibit):
    with np.errstate(all="ignore"):
        wrong, right = (
            images_of(exhibit.mistake, steps, WIDTH, (1,), SAMPLES) for steps in (exhibit.mistake.steps, RIGHT)
        )
    assert not np.array_equal(wrong, right)


@pytest.mark.parametrize("name", ["light turned over", "no number in the light's plane"])
def test_a_black_image_and_values_that_are_no_numbers_differ(name):
    number = next(k for k, exhibit in enumerate(MUSEUM) if exhibit.mistake.name == name)
    (row,) = show(number, WIDTH, 7).rows
    assert row["verdict"] == "differs", row["reason"]
    assert row["as_claimed"]


@pytest.mark.parametrize("there", [True, False])
def test_flip_is_a_gate_where_its_package_is_there(there, monkeypatch):
    seen = types.SimpleNamespace(evaluate=lambda a, b, *kind, **how: (None, float(np.abs(a - b).mean()), {}))
    monkeypatch.setitem(sys.modules, "flip_evaluator", seen if there else None)
    number = next(k for k, exhibit in enumerate(MUSEUM) if exhibit.mistake.name == "light turned over")
    (row,) = show(number, 24, 7).rows
    assert row["perceived"] is (True if there else None)
    assert row["gates_of_right"]["perceived"] is (False if there else None)
    assert ("not there" in cells(row)) != there
    assert f"FLIP {int(there)}" in summary([row])
