"""Public tables: ours round to every printed digit where those are right; a wrong scene, or estimator, is told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nusselt.experiments.studies.public_tables import factors, study
from nusselt.experiments.studies.public_tables.study import compare, every_table
from nusselt.mitsuba_bridge.process import ReferenceUnavailable
from nusselt.renderer.estimators import Exact
from nusselt.renderer.image import read_sensors

TABLES = every_table()


@pytest.mark.parametrize("name", [name for name, table in TABLES.items() if table.is_right])
def test_the_exact_value_rounds_to_every_digit(name):
    table = TABLES[name]
    found = table.sums(read_sensors(table.whole, Exact()).mean.mean(axis=0)[0])
    for value, entry in zip(found, table.entries, strict=True):
        assert abs(value - entry.printed) <= entry.half_unit, entry.name


def test_where_a_table_is_wrong_that_is_stated():
    table = TABLES["5.3 area light"]
    found = table.sums(read_sensors(table.whole, Exact()).mean.mean(axis=0)[0])
    off = found / np.array([entry.printed for entry in table.entries]) - 1
    assert np.abs(off).max() == pytest.approx(0.00255, abs=1e-5)
    assert sum(abs(off) > 5e-4) == 8


def test_catalogue_formulas_against_their_limits():
    assert factors.parallel_rectangles(1e4, 1e4) == pytest.approx(1.0, abs=2e-4)
    assert factors.coaxial_disks(1e-4, 0.5) == pytest.approx(0.25 / 1.25, rel=1e-7)
    assert factors.corner_parallel(1e8, 1e8) == pytest.approx(0.25, rel=1e-7)
    assert factors.corner_upright(1e8, 1e8) == pytest.approx(0.25, rel=1e-7)


def _rows(monkeypatch, table):
    def unavailable(*_, **__):
        raise ReferenceUnavailable("not asked")

    monkeypatch.setattr(study, "sensors_by_mitsuba", unavailable)
    monkeypatch.setattr(study, "every_table", lambda: {table.name: table})
    return compare(table.name, 8, 16, 5).rows


def test_a_table_is_as_claimed_and_not_when_its_light_is_brighter(monkeypatch):
    table = TABLES["5.6 lit floor"]
    assert all(row["as_claimed"] for row in _rows(monkeypatch, table))
    light = table.scene.lights[0]
    brighter = replace(
        table, scene=table.scene.with_(lights=(light.with_colour(tuple(1.001 * c for c in light.colour)),))
    )
    assert not any(row["as_claimed"] for row in _rows(monkeypatch, brighter))
