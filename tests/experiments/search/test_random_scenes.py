"""Random scenes: exact shadows against twins and referees; and twins, referees and shrinker against planted faults."""

from __future__ import annotations

import dataclasses
import warnings
from functools import cache

import numpy as np
import pytest
from builders import GREY, box, floor, lamp, quad, scene
from places import TEST_SCENES

from nusselt.experiments.runs.experiment import Settings
from nusselt.experiments.search.batches import batch, one_scene, search_jobs, twins_of
from nusselt.experiments.search.compare import compare
from nusselt.experiments.search.examine import EXACT, examine, stream
from nusselt.experiments.search.generator import KINDS, random_scene
from nusselt.experiments.search.judge import seen, values
from nusselt.experiments.search.motions import Motion, carried
from nusselt.experiments.search.referees import REFEREES, ask
from nusselt.experiments.search.shrink import shrunk, told
from nusselt.experiments.search.tables import search_files, search_page, search_table
from nusselt.experiments.search.twins import TWINS, Copy
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Exact
from nusselt.renderer.estimators.analytic import without_shadows
from nusselt.renderer.lights import PointLight, QuadLight
from nusselt.renderer.scene import Camera
from nusselt.renderer.scene_text import parse_scene, read_scene
from nusselt.renderer.surfaces import Ellipsoid, Material

NUMBERS = range(1, 6)
SEED = 2

SHINY = Material((0.4, 0.3, 0.2), (0.3, 0.3, 0.3), 20.0)
BLOCK = box((-0.5, 0.0, -0.5), (0.5, 1.0, 0.5))
BALL = Ellipsoid.sphere((1.0, 0.5, 0.5), 0.5, SHINY)
PLAIN = scene(floor(), BLOCK, lights=(lamp(),), ellipsoids=(BALL,), size=(10, 10))
TWO = PLAIN.with_(lights=(lamp(), QuadLight((1.5, 1, -1), (0.1, 0.9, 0.2), (0.2, 0.1, 1.1), (3, 2, 1))))


@pytest.mark.parametrize("kind", KINDS)
def test_random_scenes_agree_with_their_twins_and_with_both_referees(kind):
    """Twins: what is allowed follows from bounds. Referees: at most 36 means a scene at 1e-12 each, 1e-9 in all."""
    found = {n: examine(random_scene(kind, n, SEED).scene, n, twins_of(SEED, n)) for n in NUMBERS}
    assert {n: result.faults for n, result in found.items() if result.faults} == {}
    assert sum(check.points for result in found.values() for check in result.checks.values()) > 2000


# The twins.


@dataclasses.dataclass(frozen=True)
class Planted:
    """An estimator with a fault; none with ``way`` "free", which leaves the shadows out, and "right"."""

    way: str
    shortcuts: bool = True

    def with_bounds(self, points, source, rng):
        if self.way == "free":
            return without_shadows(points, source), np.full(points.count, 1e-9), {}
        out, bound, routes = Exact(shortcuts=self.shortcuts).with_bounds(points, source, rng)
        light = source.light
        if self.way == "one side is black":
            out[:, points.position.sum(axis=0) < 0.3] = 0.0
        elif self.way == "forgets the second light" and source.index == 1:
            out[:] = 0.0
        elif self.way.startswith("a millionth"):
            turned = light.ab[0] == 0
            large, slow = np.abs(points.position).max() > 2.5, not self.shortcuts
            out *= 1 - 1e-6 * {"corner": turned, "size": large, "shortcuts": slow}[self.way.split()[-1]]
        elif self.way == "three quarters":
            out *= 0.75
        elif self.way == "no ball":
            out[:] = without_shadows(points, source) if source.blockers.geometry.ellipsoids else out
        elif self.way == "not a number":
            out[0, :1] = np.nan
        elif self.way == "negative":
            out[0, :1] = -1e-3
        elif self.way == "warns":
            warnings.warn("odd", RuntimeWarning, stacklevel=1)
        elif self.way == "raises":
            raise IndexError("index 0 is out of bounds")
        return out, bound, routes


def twins(*names):
    return [twin for twin in TWINS if twin.name in names]


@pytest.mark.parametrize("twin", TWINS, ids=lambda twin: twin.name)
def test_a_twin_changes_no_light_where_nothing_is_in_the_way(twin):
    """Of the closed form, which has its own tests: most points are compared, and none differs."""
    for n, kind in enumerate(("boxes", "balls", "soup")):
        made = random_scene(kind, 2, 0).scene.with_(width=10, height=10) if n else TWO
        one = seen(made)
        mine = values(one, one.points, Planted("free"))
        copy = twin.make(made, stream(n, twin.name))
        compared = None if copy is None else compare(one, mine, copy, Planted("free"))
        if compared is None:
            assert "order" in twin.name or not copy.exact
            continue
        assert compared.index.size > 0.8 * one.points.count
        assert compared.wrong.size == 0


@cache
def right_faults(name, two):
    """What a twin finds wrong with the right estimator."""
    made = TWO if two else PLAIN
    return [f for seed in range(3) for f in examine(made, seed, twins(name), (), Planted("right")).faults]


@pytest.mark.parametrize(
    ("way", "name"),
    [
        ("one side is black", "turned"),
        ("one side is black", "mirrored"),
        ("one side is black", "axes renamed"),
        ("one side is black", "moved by whole numbers"),
        ("forgets the second light", "lights in two"),
        ("forgets the second light", "lights in four"),
        ("forgets the second light", "lights in another order"),
        ("a millionth by the corner", "lights from another corner"),
        ("a millionth by the corner", "turned"),
        ("a millionth by the size", "scaled"),
        ("a millionth by the size", "size times a power of two"),
        ("a millionth without shortcuts", "no shortcuts"),
    ],
)
def test_a_planted_fault_is_found_by_the_twin_it_breaks(way, name):
    made = TWO if "order" in name else PLAIN
    asked = (examine(made, seed, twins(name), (), Planted(way)).faults for seed in range(6))
    faults = next(filter(None, asked), [])  # of the first seed that finds any
    assert {f.check for f in faults} == {name}
    assert right_faults(name, made is TWO) == []


@pytest.mark.parametrize("way", ["not a number", "negative", "warns", "raises"])
def test_what_no_image_may_be_is_found_without_a_twin(way):
    assert {f.check for f in examine(PLAIN, 0, (), (), Planted(way)).faults} == {"itself"}


def test_a_scene_with_a_light_without_extent_is_judged_beyond_its_edges():
    made = PLAIN.with_(lights=(PointLight((0.3, 2.5, 0.4), (5, 5, 5)),))
    assert examine(made, 0).faults == []
    assert examine(made, 0, (), ("area",), Planted("three quarters")).faults


def test_points_lie_on_their_surfaces_in_a_twin_whose_camera_was_rounded():
    """Each scene is brought near its camera: a move that rounds the camera alone put all points behind the floor."""
    made = read_scene(TEST_SCENES / "standing_triangle_far_away.test")
    one = seen(made)
    motion = Motion.step((-6407.0, 13264.0, 15840.0))
    for estimator, wrong in ((EXACT, 0), (Planted("three quarters"), one.points.count)):
        compared = compare(one, values(one, one.points, EXACT), Copy(carried(made, motion), motion), estimator)
        assert compared.index.size == one.points.count
        assert compared.wrong.size == wrong


# The referees.


def points_of(made, count=12):
    one = seen(made)
    return one, one.points.take(np.random.default_rng(1).permutation(one.points.count)[:count])


@pytest.mark.parametrize("name", REFEREES)
@pytest.mark.parametrize("exponent", [None, 0.0, 20.0])
def test_a_referee_gives_the_closed_form(name, exponent):
    """Of the whole light, and of the half that a plate before it leaves; 1e-12 each, 48 means."""
    material = GREY if exponent is None else Material((0.2, 0.2, 0.2), (0.5, 0.5, 0.5), exponent)
    wide = lamp(half=1.0)
    cover = quad((0, 1.99, 1), (1, 1.99, 1), (1, 1.99, -1), (0, 1.99, -1))
    half = QuadLight(wide.corner, wide.ab, tuple(np.array(wide.ac) / 2), wide.radiance)
    low = Camera((0.25, 1.25, 6.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 40.0)
    for blockers, light in (((), wide), ((cover,), half)):
        made = scene(floor(half=1.5, material=material), *blockers, lights=(wide,), camera=low)
        one, points = points_of(made)
        told = ask(name, made, one.geometry, points, 1 << 15, np.random.default_rng(2))
        other = scene(floor(half=1.5, material=material), lights=(light,), camera=low)
        right = values(seen(other), points, Planted("free")).radiance
        slack = (
            0.03 * values(one, points, Planted("free")).radiance * bool(blockers)
        )  # light past the plate, 0.01 thick
        assert (np.abs(told.mean - right) <= told.width + slack).all()
        assert (told.width < 0.3 * values(one, points, Planted("free")).radiance.max()).all()


@pytest.mark.parametrize(("name", "half"), [("area", 1.0), ("direction", 4.0)])
def test_a_referee_finds_a_quarter_of_the_light_missing(name, half):
    made = PLAIN.with_(lights=(lamp(half=half),))
    assert {f.check for f in examine(made, 1, (), (name,), Planted("three quarters"), 40).faults} == {name}
    assert examine(made, 1, (), (name,), EXACT, 40).faults == []


def test_a_ball_hides_the_outside_from_its_inside():
    ball = Ellipsoid.sphere((0.0, 0.0, 0.0), 1.0, GREY)
    made = scene(
        ellipsoids=(ball,), lights=(lamp(),), camera=Camera((0, 0, 0.5), (0, 0, 0), (0, 1, 0), 60), two_sided=True
    )
    one, points = points_of(made)
    for name in REFEREES:
        assert (ask(name, made, one.geometry, points, 4096, np.random.default_rng(0)).mean == 0).all()


# The generator, the shrinker, the rows.


def test_scenes_are_the_same_for_the_same_seed_and_others_for_another():
    digests = [random_scene(kind, n, 0).scene.digest() for kind in KINDS for n in range(3)]
    assert digests == [random_scene(kind, n, 0).scene.digest() for kind in KINDS for n in range(3)]
    assert len(set(digests)) == len(digests)
    assert random_scene("boxes", 0, 1).scene != random_scene("boxes", 0, 0).scene


def test_a_failing_scene_is_shrunk_to_what_fails():
    """Shadows vanish where there is a ball: a ball, a light and what is shadowed stay."""
    crowd = TWO.with_(
        meshes=(*TWO.meshes, box((-2, 0, -2), (-1, 1, -1)), quad((1, 0, 1), (2, 0, 1), (2, 1, 0), (1, 1, 0)))
    )
    wrong = Planted("no ball")
    fault = max(examine(crowd, 0, (), ("area",), wrong, 60).faults, key=lambda f: f.difference)
    small, left = shrunk(crowd, fault, 0, wrong, seconds=20.0)
    assert len(small.ellipsoids) == len(small.lights) == 1
    assert len(small.meshes) <= 2
    assert small.width * small.height <= 64
    assert left.check == "area"
    assert left.ratio > 1
    text = told(small, [left], "again")
    assert "area" in text.splitlines()[0]
    assert examine(parse_scene(text), 0, (), ("area",), wrong, 60).faults


def test_a_batch_is_a_row_that_tables_page_and_files_can_tell():
    row = batch("boxes", 1, 2, 0).rows[0] | {"command": "", "seed": 0}
    assert row["scenes"] == 2
    assert row["compared_points"] > 1000
    assert row["as_claimed"] == (row["failures"] == [])
    bad = one_scene(PLAIN, "file", 0, 0).rows[0]
    bad |= {"failures": [vars(examine(PLAIN, 0, (), (), Planted("raises")).faults[0]) | {"scene": "x", "number": 1}]}
    bad |= {"small": [{"name": "x.test", "text": "# x"}]}
    assert search_files([row, bad])["x.test"] == "# x"
    assert "IndexError" in search_page([row, bad])
    assert search_table([row, bad], 80).renderables


def test_scenes_are_asked_for_by_number_by_name_or_by_file():
    jobs = search_jobs(Settings(scenes=("200",)))
    assert sum(job.arguments["count"] for job in jobs) >= 200
    assert search_jobs(Settings(scenes=("balls-7",)))[0].arguments["scene"] == random_scene("balls", 7, 0).scene
    assert len(search_jobs(Settings(scenes=("cornell",)))) == 1
    for wrong in ("0", "no-such-scene"):
        with pytest.raises(InputError):
            search_jobs(Settings(scenes=(wrong,)))
