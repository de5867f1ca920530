"""Error against time: turns, what is kept, bounds said as bounds. No time is asserted."""

import io
import sys
from dataclasses import dataclass, replace

import numpy as np
import pytest
from builders import floor, lamp, scene
from rich.console import Console

from nusselt.experiments.check.estimators import noise_free
from nusselt.experiments.external.program import ProgramFailed
from nusselt.experiments.peers.cross import CrossQuestion, cross_check
from nusselt.experiments.peers.documents import text
from nusselt.experiments.peers.entrant import Entrant
from nusselt.experiments.peers.page import cross_html
from nusselt.experiments.peers.renderer import PeerRenderer
from nusselt.experiments.peers.renderers import peer_of
from nusselt.experiments.peers.tables import times_table
from nusselt.experiments.peers.times.measure import LONGEST, Times, measure
from nusselt.experiments.peers.times.rows import reached, stops_at, time_rows
from nusselt.experiments.peers.times.sides import Lap, PeerSide, Truth, _own
from nusselt.experiments.results.document import document
from nusselt.experiments.results.store import Store
from nusselt.renderer.image import render

SMALL = scene(floor(), lights=(lamp(),)).with_(width=12, height=9)
SCRIPT = """
import json, sys
import numpy as np
with np.load(sys.argv[-3]) as scene:
    w, h = scene["size"]
said = json.loads(sys.argv[-1])
image = np.full((h, w, 3), 1 + 1 / said["samples"])
np.savez(sys.argv[-2], image=image, version=f"{said['threads']} thread", spent=[1.0, said["samples"], 3.0])
"""
"""A peer whose error and seconds are known."""


@dataclass(frozen=True)
class Known:
    """A side that says what it is told, and who it was asked."""

    name: str
    asked: list
    cost: float = 1e-3
    error: float = 0.0
    sizes: tuple = (4, 16, 64)
    fails: bool = False
    rule = "centre"

    @property
    def peer(self):
        return replace(peer_of("povray"), name=self.name)

    def lap(self, size, round, seed):
        if self.fails:
            raise ProgramFailed("it broke")
        self.asked.append((self.name, size, round))
        return Lap(size, round, max(1 / size, self.error), self.cost * size, 0.0, 0.0)


@pytest.fixture(scope="module")
def stand_ins():
    """A cross-check of the exact image itself."""
    image = render(SMALL, noise_free(SMALL)).mean
    return cross_check(SMALL, [Entrant("povray", "centre", image[None], 0 * image)], CrossQuestion())


def laps(*pairs):
    """Of one round: (seconds, error)."""
    return [Lap(4.0 ** (k + 1), 0, error, seconds, seconds, 0.0) for k, (seconds, error) in enumerate(pairs)]


def test_sides_take_turns_and_what_is_kept_is_not_done_again(tmp_path):
    asked, store = [], Store(tmp_path)
    sides = [
        Known("a", asked),
        Known("b", asked),
        Known("dear", asked, cost=LONGEST / 32),
        Known("c", asked, fails=True),
    ]
    told = []
    found = measure(SMALL, sides, 2, 0, store, lambda done, total: told.append((done, total)))
    assert told[-1] == (24, 24)
    assert [name for name, size, number in asked if (size, number) == (16, 0)] == ["b", "dear", "a"]
    assert {size for name, size, _ in asked if name == "dear"} == {4, 16}  # the next would take too long
    assert found.failed == {("c", "centre"): "it broke"}
    before = len(asked)
    again = measure(SMALL, sides[:3], 3, 0, store, lambda done, total: None)
    assert len(asked) - before == 3 + 3 + 2  # of the third round alone
    assert [len(laps) for laps in again.laps.values()] == [9, 9, 6]


def test_a_time_is_measured_or_a_bound_and_said_to_be_one():
    falling = laps((1.0, 1e-1), (10.0, 1e-2), (100.0, 1e-3))
    assert reached(10**-1.5, falling) == ("measured", pytest.approx(10**0.5))
    assert reached(1e-4, falling) == ("more than", 100.0)
    assert reached(0.5, falling) == ("at most", 1.0)
    assert reached(1e-4, laps((2.0, 0.0))) == ("measured", 2.0)


def test_a_renderer_that_gets_no_better_is_seen_to_stop():
    noise = [(4.0**k, 2.0**-k) for k in range(5)]
    assert stops_at(laps(*noise)) is None
    assert stops_at(laps(*((seconds, float(np.hypot(error, 0.2))) for seconds, error in noise))) == pytest.approx(
        0.2, rel=0.1
    )


def test_ratios_are_to_mitsuba_of_the_same_round_and_bounds_have_none():
    asked = []
    sides = {(name, "centre"): Known(name, asked) for name in ("mitsuba", "slow", "stuck")}
    known = [
        Lap(lap.size, number, lap.error, lap.processor, 0.0, 0.0)
        for number in (0, 1)
        for lap in laps((1.0, 0.1), (10.0, 1e-3))
    ]
    slow = [replace(lap, processor=lap.processor * (2 + lap.round)) for lap in known]
    stuck = [replace(lap, error=0.1) for lap in known]
    found = Times(dict(zip(sides, (known, slow, stuck), strict=True)), sides)
    rows = {row["renderer"]: row for row in time_rows("s", found)}
    first = {name: row["reached"][0] for name, row in rows.items()}
    assert first["slow"]["over_mitsuba"] == pytest.approx(2.5)
    assert first["slow"]["over_mitsuba_range"] == pytest.approx([2.0, 3.0])
    assert (first["stuck"]["known"], first["stuck"]["over_mitsuba"]) == ("more than", None)
    page = text(document(list(rows.values()))["rows"])
    assert "| stuck | centres | 0 | > 10 |" in page
    assert "(2.5 [2, 3])" in page


def test_the_page_has_the_table_and_the_figure(stand_ins):
    times = Times({("povray", "centre"): laps((1.0, 0.1), (10.0, 1e-3))}, {("povray", "centre"): Known("povray", [])})
    page = cross_html([replace(stand_ins, times=times)], document([], alpha=1e-3), "nusselt cross")
    assert "Error against processor seconds" in page
    assert "<td>&gt; 10</td>" in page
    told = io.StringIO()
    Console(file=told, width=80).print(times_table("s", times, 80))
    assert "> 10" in told.getvalue()
    assert max(map(len, told.getvalue().splitlines())) <= 80


def test_a_peer_is_given_one_thread_and_tells_what_it_spent(tmp_path):
    script = tmp_path / "peer.py"
    script.write_text(SCRIPT)
    judged = np.ones((9, 12), dtype=bool)
    truth = Truth(np.ones((3, 9, 12)), judged)
    with PeerRenderer(peer_of("radiance"), [sys.executable, str(script)], SMALL, threads=1) as renderer:
        lap = PeerSide(renderer, truth).lap(16, 0, 1)
        assert renderer.version == "1 thread"
    assert (lap.processor, lap.wall, lap.start) == (16.0, 1.0, 3.0)
    assert lap.error == pytest.approx(1 / 16)
    script.write_text(SCRIPT.replace(', spent=[1.0, said["samples"], 3.0]', ""))
    with (
        PeerRenderer(peer_of("radiance"), [sys.executable, str(script)], SMALL, threads=1) as renderer,
        pytest.raises(ProgramFailed, match="does not say"),
    ):
        PeerSide(renderer, truth).lap(16, 0, 1)


def test_ours_is_measured_as_it_is_asked_for():
    """Pixels' centres are the exact image; their areas are as near to it as their tolerance."""
    exact = noise_free(SMALL)
    fine, _ = _own(SMALL, "area", exact, 1e-3)
    coarse, spent = _own(SMALL, "area", exact, 5e-2)
    assert 0 < Truth(fine, np.ones((9, 12), dtype=bool)).error(coarse) < 5e-2
    assert min(spent) > 0
    assert np.array_equal(_own(SMALL, "centre", exact, 0.0)[0], render(SMALL, exact).mean)
