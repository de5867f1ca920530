"""`nusselt sensors`: right readings agree with Mitsuba and what is expected; wrong ones are told, by number."""

from __future__ import annotations

import json

import numpy as np
import pytest
from builders import box, floor, lamp, scene
from click.testing import CliRunner
from scipy import stats

from nusselt.experiments.cli.main import main
from nusselt.experiments.sensors.judge import against_expected, against_mitsuba
from nusselt.experiments.sensors.question import SensorQuestion
from nusselt.experiments.sensors.rows import read
from nusselt.mitsuba_bridge.sensors import SensorReference, sensors_by_mitsuba
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Exact
from nusselt.renderer.image import read_sensors
from nusselt.renderer.lights import DiskLight, PointLight, SunLight
from nusselt.renderer.sensor import Sensor

UP = (0.0, 1.0, 0.0)
LEVEL = 1e-6
SENSORS = tuple(Sensor((x, 0.0, z), UP) for x in (-0.2, 0.5, 0.9, 1.6) for z in (0.0, 0.7))
LIGHTS = (
    lamp(),
    PointLight((1.0, 3.0, 2.0), (4.0, 2.0, 1.0)),
    SunLight((0.3, 1.0, 0.1), (1.0, 1.0, 1.0), 4.0),
    DiskLight((-1.5, 2.5, 0.0), (0.4, -1.0, 0.0), 0.3, (9.0, 9.0, 3.0)),
)


@pytest.mark.mitsuba
def test_mitsuba_agrees_on_every_kind_of_light_behind_a_block():
    """Each channel of each sensor, half and fully shadowed ones among them, at 1e-6 in all."""
    made = scene(floor(), box((-0.3, 0.8, -0.3), (0.3, 1.0, 0.3)), lights=LIGHTS, sensors=SENSORS)
    reference = sensors_by_mitsuba(made, seed=3, samples=1024)
    ours = read_sensors(made, Exact(samples=4096), seed=1, passes=8)
    found = against_mitsuba(ours, 8, 4096, reference, 0.0, LEVEL)
    assert (np.abs(found.value) <= found.half).all()
    assert found.half.max() < 0.2
    darker = against_mitsuba(ours, 8, 4096, _times(reference, 1.5), 0.0, LEVEL)
    assert (np.abs(darker.value) > darker.half).any()


def reference_of(mean, error, **more) -> SensorReference:
    told = {"unoccluded": mean, "grain": 0 * error, "passes": 32, "samples": 32, "version": "", "variant": ""}
    return SensorReference(mean, error, **told, limits=(), too_close=np.zeros(error.shape[1], dtype=bool), **more)


def _times(reference: SensorReference, factor: float) -> SensorReference:
    return SensorReference(**{**vars(reference), "mean": factor * reference.mean})


def test_the_false_alarm_rate_is_the_one_declared_and_a_bias_is_found():
    """Of readings with noise on both sides, 2,000 simulated scenes of eight sensors each, at 0.05."""
    rng, exact = np.random.default_rng(4), read_sensors(scene(floor(), lights=(lamp(),), sensors=SENSORS), Exact())
    alarms = {1.0: 0, 1.01: 0}
    for _ in range(2000):
        for factor in alarms:
            passes = exact.mean * (factor + 0.01 * rng.standard_normal((16, *exact.mean.shape)))
            ours = type(exact)(**{**vars(exact), "mean": passes.mean(axis=0), "variance": passes.var(axis=0, ddof=1)})
            theirs = exact.mean[:, 0] * (1 + 0.01 * rng.standard_normal((32, 3, len(SENSORS))))
            error = theirs.std(axis=0, ddof=1) / np.sqrt(32)
            reference = reference_of(theirs.mean(axis=0), error)
            found = against_mitsuba(ours, 16, 1, reference, 0.0, 0.05)
            alarms[factor] += any(found.said("it", k)[0] == "differs" for k in range(len(SENSORS)))
    assert stats.binomtest(alarms[1.0], 2000, 0.05, alternative="greater").pvalue > LEVEL
    assert alarms[1.01] > 1500


def test_what_is_expected_is_judged_by_how_well_it_is_known():
    bare = scene(floor(), lights=(lamp(),))
    value = float(read_sensors(bare.with_(sensors=SENSORS[:1]), Exact()).mean[0, 0, 0])
    words = []
    for factor, percent in ((1.0, 0.0), (1.01, 2.0), (1.01, 0.5)):
        sensor = Sensor(SENSORS[0].position, UP, (factor * value,) * 3, percent)
        made = bare.with_(sensors=(sensor,))
        words.append(against_expected(read_sensors(made, Exact()), 1, made.sensors, 1e-3).said("it", 0)[0])
    assert words == ["agrees", "agrees", "differs"]
    noisy = read(made, SensorQuestion("area", samples=4, mitsuba=False, margin=0.5), command="")
    assert noisy[0]["verdict"] == "undecided"
    assert noisy[0]["as_claimed"] is None


TEXT = """quadLight 0 0 0  0 4 0  4 0 0  0.31830988618379067 0.31830988618379067 0.31830988618379067
sensor 2 0 .75  0 1 0
expect .35901 .35901 .35901 .01
sensor 2 0 1.25  0 1 0
"""


@pytest.mark.mitsuba
def test_the_command_tells_and_keeps_what_it_finds(tmp_path):
    (tmp_path / "floor.test").write_text(TEXT)
    told = tmp_path / "found.json"
    result = CliRunner().invoke(main, ["sensors", str(tmp_path / "floor.test"), "--json", str(told)])
    assert result.exit_code == 0, result.output
    assert "2 sensors: 2 agree\n" in result.output
    rows = json.loads(told.read_text())["rows"]
    assert [row["sensor"] for row in rows] == [1, 2]
    assert rows[0]["reading"][0] == pytest.approx(0.359005048, rel=1e-8)
    assert rows[0]["expected_interval"] == pytest.approx([-1.379e-5] * 2, rel=1e-3)
    (tmp_path / "floor.test").write_text(TEXT.replace(".35901 .35901", ".36901 .35901"))
    result = CliRunner().invoke(main, ["sensors", str(tmp_path / "floor.test"), "--no-mitsuba"])
    assert result.exit_code == 1
    assert "sensor 1 differs: off expected" in result.output


@pytest.mark.parametrize(
    ("words", "said"),
    [(["quad"], "sensor"), (["floor.test", "--margin", "-1"], "--margin"), (["floor.test", "--alpha", "0"], "--alpha")],
)
def test_bad_questions_are_one_line(words, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "floor.test").write_text(TEXT)
    result = CliRunner().invoke(main, ["sensors", *words])
    assert result.exit_code == 2
    assert said in result.output
    assert result.output.strip().count("\n") == 0


@pytest.mark.mitsuba
def test_where_mitsubas_rays_start_beyond_a_surface_is_no_difference_of_ours(tmp_path):
    """A ten-thousandth under a lamp, and in full shadow, where the reading is compared with the unblocked one."""
    (tmp_path / "close.test").write_text(
        "quadLight -.5 1 -.5  0 0 1  1 0 0  2 2 2\nvertex -3 .5 -3\nvertex 3 .5 -3\nvertex 3 .5 3\nvertex -3 .5 3\n"
        "tri 0 1 2\ntri 0 2 3\nsensor 0 .999999 0  0 1 0\nsensor 0 0 0  0 1 0\nexpect 0 0 0 0\n"
    )
    result = CliRunner().invoke(main, ["sensors", str(tmp_path / "close.test"), "--json", str(tmp_path / "found.json")])
    assert result.exit_code == 3, result.output
    rows = json.loads((tmp_path / "found.json").read_text())["rows"]
    assert [row["verdict"] for row in rows] == ["undecided", "agrees"]
    assert "closer than Mitsuba's shadow rays start" in rows[0]["reason"]


def test_each_channel_is_expected_as_well_as_it_is_known():
    made = scene(floor(), lights=(PointLight((0.0, 1.0, 0.0), (100.0, 100.0, 2.0)),))
    words = []
    for expected in ((100.5, 100.5, 2.01), (100.0, 100.0, 1.0)):
        sensors = (Sensor((0.0, 0.0, 0.0), UP, expected, 1.0),)
        words.append(
            against_expected(read_sensors(made.with_(sensors=sensors), Exact()), 1, sensors, 1e-3).said("", 0)[0]
        )
    assert words == ["agrees", "differs"]


def test_a_sensor_at_a_point_light_is_refused():
    made = scene(floor(), lights=(PointLight((0.0, 1.0, 0.0), (1.0, 1.0, 1.0)),))
    with pytest.raises(InputError, match="sensor 1"):
        read(made.with_(sensors=(Sensor((0.0, 1.0, 0.0), UP),)), SensorQuestion(mitsuba=False), command="")
