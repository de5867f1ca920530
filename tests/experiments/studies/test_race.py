"""A whole race on a small scene: both sides measured against one truth."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest
from click.testing import CliRunner

from nusselt.experiments.cli.main import main
from nusselt.experiments.results.document import document, machine, write_json
from nusselt.experiments.studies.race.measure import Measured, Plan
from nusselt.experiments.studies.race.page import main as page
from nusselt.experiments.studies.race.rows import finalists, raw, row
from nusselt.experiments.studies.race.scenes import race_scene
from nusselt.experiments.studies.race.study import figure, run
from nusselt.mitsuba_bridge import race as race_module
from nusselt.mitsuba_bridge.llvm import backend
from nusselt.mitsuba_bridge.process import ReferenceUnavailable
from nusselt.mitsuba_bridge.race import DEFAULT, WAYS, Lap, Way, run_race
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Analytic
from nusselt.renderer.pixels import render_area

pytestmark = [
    pytest.mark.skipif(backend().variant == "scalar_rgb", reason="Mitsuba's LLVM variant does not run here"),
    pytest.mark.mitsuba,
]

FEW = (Way("multijitter", 0), DEFAULT)
LADDER = (Way("multijitter", 0), Way("ldsampler", 0), Way("orthogonal", 0))


def test_mitsuba_is_run_in_every_way_and_its_default_is_among_them():
    assert len(set(WAYS)) == 8
    assert DEFAULT in WAYS


@pytest.fixture(scope="module")
def raced():
    return run(["quad"], plan=Plan(rounds=1, sizes=(4, 16), truth=1e-4, longest=2.0, ways=FEW), side=24, count=1)


def test_rows_say_who_took_how_long(raced):
    rows, _ = raced
    assert [(row["pixel_rule"], row["target"]) for row in rows] == [
        (rule, target) for rule in ("area", "centre") for target in (1e-2, 1e-3, 1e-4)
    ]
    for line in rows:
        assert line["as_claimed"] is True
        assert line["ours"]["seconds"] > 0
        assert line["ratio"] > 0
        assert line["ratio_interval"] is None  # one camera, one round: nothing to spread
    assert rows[2]["lower_bound_only"]  # 16 samples are far from 1e-4, and a decade is all that is extrapolated


def test_several_cameras_have_an_interval(raced):
    _, measured = raced
    once = measured["quad/area"][0]
    slow = dataclasses.replace(
        once, ours=[[dataclasses.replace(lap, seconds=2 * lap.seconds) for lap in laps] for laps in once.ours]
    )
    found, alone = (row("quad", "area", 1e-2, "analytic", views) for views in ([once, slow], [once]))
    assert found["ratio_interval"] == [alone["ratio"] / 2, alone["ratio"]]


def test_every_way_of_mitsuba_comes_nearer_with_samples(raced):
    _, measured = raced
    for found in measured.values():
        laps = found[0].mitsuba[0].laps
        ways = {lap.way for lap in laps}
        assert ways == set(FEW)
        for way in ways:
            errors = [lap.error for lap in laps if lap.way == way]
            assert len(errors) == 2
            assert errors[1] < 0.8 * errors[0] < 1
    assert (
        figure("quad", [raw(one) for one in measured["quad/area"]]).axes[0].get_title().count("general renderer") == 1
    )


def test_the_foremost_ways_and_the_default_go_on(raced):
    _, measured = raced
    assert set(finalists(measured["quad/area"][0])) == set(FEW)  # of two ways neither is left behind
    slow = Way("independent", 0)
    (race,) = measured["quad/area"][0].mitsuba
    laps = [
        Lap(way, lap.samples, lap.seconds * (1 + k), lap.error) for lap in race.laps for k, way in enumerate(LADDER)
    ]
    laps += [Lap(slow, lap.samples, 100 * lap.seconds, lap.error) for lap in race.laps]
    known = Measured(mitsuba=[dataclasses.replace(race, laps=tuple(laps))])
    assert set(finalists(known)) == {*LADDER, DEFAULT}


def test_a_wrong_truth_is_not_reached():
    """The planted defect: 5 % too bright, and no number of samples comes nearer than that."""
    scene = race_scene("quad", 24).with_(spp=16)
    image = render_area(scene, Analytic(), tolerance=1e-3).image
    judged = (image.emitter == 0) & (image.background < 1)
    way = (Way("multijitter", 0),)
    right = run_race(scene, image.mean, judged, sizes=(256,), seed=1, ways=way)
    wrong = run_race(scene, 1.05 * image.mean, judged, sizes=(256,), seed=1, ways=way)
    assert right.laps[0].error < 1e-2
    assert np.isclose(wrong.laps[0].error, 0.05 / 1.05, rtol=0.1)


def test_many_samples_are_the_mean_of_parts_and_none_are_drawn_beyond_what_is_enough(monkeypatch):
    scene = race_scene("quad", 24).with_(spp=16)
    image = render_area(scene, Analytic(), tolerance=1e-3).image
    judged = (image.emitter == 0) & (image.background < 1)
    rest = {"sizes": (16, 64, 256), "seed": 1, "ways": (Way("independent", 0),)}
    whole = run_race(scene, image.mean, judged, **rest).laps
    monkeypatch.setattr(race_module, "AT_ONCE", 16 * scene.width * scene.height)
    parts = run_race(scene, image.mean, judged, **rest).laps
    assert parts[0].error == whole[0].error
    # Sixteen images of 16 samples: independent ones would have an error of a quarter, seeds in common that of one.
    assert np.isclose(parts[2].error, whole[2].error, rtol=0.15)
    assert parts[2].error < 0.4 * parts[0].error
    few = run_race(scene, image.mean, judged, **rest, enough=1.001 * whole[1].error).laps
    assert [lap.samples for lap in few] == [16, 64]


def test_ratios_are_a_table_that_says_the_machine(raced, tmp_path):
    rows, _ = raced
    told = [row | {"experiment": "error-against-time"} for row in rows]
    told[0] |= {"ratio": 13.7, "ratio_interval": [11.2, 14.4], "lower_bound_only": True}
    write_json(document(told), str(tmp_path / "results.json"))
    first, _, *lines = page([str(tmp_path / "results.json")]).splitlines()
    assert f"{machine()['processor']}, {machine()['cores']} cores" in first
    assert re.search(r"Mitsuba \d\.\d+\.\d+, 20\d\d-\d\d-\d\d:$", first)
    assert lines[0] == "| scene | pixels | to 0.01 | to 0.001 | to 0.0001 |"
    assert lines[2].startswith(f"| `{told[0]['scene']}` | {told[0]['pixel_rule']} | ≥ 14 [11, 14] | ")
    write_json(document([row | {"experiment": "other"} for row in rows]), str(tmp_path / "results.json"))
    with pytest.raises(InputError, match="rows of error-against-time"):
        page([str(tmp_path / "results.json")])


@pytest.mark.parametrize("words", [("convergence", "--long"), ("error-against-time", "--long", "--quick")])
def test_long_is_refused_where_it_means_nothing(words):
    result = CliRunner().invoke(main, ["run", *words])
    assert result.exit_code == 2
    assert "long" in result.stderr


def test_a_race_needs_the_fast_variant():
    slow = dataclasses.replace(backend(), variant="scalar_rgb")
    with pytest.raises(ReferenceUnavailable, match="LLVM"):
        run_race(None, np.zeros(0), None, sizes=(4,), seed=0, running=slow)
