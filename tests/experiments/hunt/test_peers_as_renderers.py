"""Peers by name as renderers of hunts, relations and reductions: stand-ins, right and wrong, with noise and without."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders import GREY, floor, lamp, scene
from click.testing import CliRunner

import nusselt.experiments.hunt.hunt as hunt_file
from nusselt.experiments.cli.main import main
from nusselt.experiments.external.program import ProgramFailed
from nusselt.experiments.hunt.hunt import Hunt, Question
from nusselt.experiments.hunt.scenes import drawn, held
from nusselt.experiments.metamorphic.ask import Asking, ask
from nusselt.experiments.metamorphic.by_method import beside_exact
from nusselt.experiments.metamorphic.peer_source import PeerSource, peer_source
from nusselt.experiments.metamorphic.relation import Shot
from nusselt.experiments.metamorphic.sources import renderer_source
from nusselt.experiments.peers.environment import Environments
from nusselt.experiments.peers.renderers import peer_of
from nusselt.experiments.peers.workshop import Workshop
from nusselt.experiments.reduce.failure import BESIDE, CRASHES, manner_of
from nusselt.experiments.scenes import shapes
from nusselt.experiments.verdict.level import Level
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Exact
from nusselt.renderer.image import render
from nusselt.renderer.lights import PointLight
from nusselt.renderer.scene_text import write_scene
from nusselt.renderer.surfaces import Ellipsoid, Material

STUB = str(Path(__file__).parents[2] / "support" / "stub_peer.py")
BALL = (Ellipsoid.sphere((0.3, 0.6, 0.2), 0.6, GREY),)
SCENE = scene(
    floor(), ellipsoids=BALL, lights=(lamp(2.5),), size=(16, 12), light_samples=64, stratify=True, two_sided=True
)
ASKING = Asking(margin=0.01, alpha=1e-6, runs=3)


BOTH = SCENE.with_(lights=(*SCENE.lights, lamp(3.0, radiance=(1.0, 2.0, 3.0))))
MADE = tuple(
    one.with_(name=name, width=16, height=16)
    for name, one in {"a ball": SCENE, "none": SCENE.with_(ellipsoids=()), "two lights": BOTH}.items()
)


class Stubs(Environments):
    """Where every peer is a stub."""

    def __init__(self, points="random", fault="right"):
        super().__init__(Path())
        object.__setattr__(self, "words", [sys.executable, STUB, points, fault])

    def launch(self, peer):
        return self.words


def stub(name="embree", *how):
    return peer_source(peer_of(name), Stubs(*how))


NOISY, STILL = ("embree", "random"), ("radiance", "middles")


@pytest.mark.parametrize(("name", "points"), [NOISY, STILL], ids=["noise", "midpoints"])
def test_a_hunt_finds_what_is_wrong_of_a_peer_and_nothing_wrong_with_a_right_one(tmp_path, monkeypatch, name, points):
    monkeypatch.setattr(hunt_file, "drawn", lambda *asked: iter(MADE))
    for fault in ("right", "dim"):
        source = stub(name, points, fault)
        question = Question(ASKING, 3, 16, source.samples, source.cannot, two_sided=True)
        hunt = Hunt(question, source, tmp_path / fault)
        hunt.run(math.inf, lambda *args: None, lambda line: None)
        assert len(hunt.scenes) == 3
        if fault == "right":
            assert not hunt.causes.known
    (cause,) = hunt.causes.known
    assert cause.failing.manner == BESIDE
    assert "sphere" in cause.needs
    assert len(cause.scene.ellipsoids) == 1
    again = Hunt(question, source, tmp_path / "dim")  # of surfaces with two sides, as they were
    assert again.causes.known[0].scene.two_sided


def test_a_method_without_noise_is_allowed_what_it_says_and_no_more():
    """Relations and reductions too: half a light is more."""
    right, dim = stub(*STILL), stub(*STILL, "dim")
    step = right.step(Shot(SCENE))
    assert np.abs(step).max() > 0
    near = np.abs(right.image(Shot(SCENE), 0) - render(SCENE, Exact()).mean).mean()
    assert near < np.abs(step).mean()
    rows = ask([SCENE], right, ASKING)
    assert not [row["reason"] for row in rows if row.get("verdict") == "differs"]
    assert manner_of(SCENE, right, ASKING)[0] is None
    failure, _ = manner_of(SCENE, dim, ASKING)
    assert failure.manner == BESIDE


def test_a_light_that_is_cut_along_its_own_rows_is_allowed_a_row():
    """45 % of it are seen, of 8 rows and of 4 it is half: the step says nothing, and the image is 11 % off."""
    sheet = shapes.plate((-1.0, 1.0), (-1.0, 0.1 * 0.8), 2.49, GREY)
    cut = scene(floor(), sheet, lights=(lamp(2.5, 0.8),), size=(16, 12), light_samples=64, two_sided=True, name="cut")
    source = stub(*STILL)
    image, exact = source.image(Shot(cut), 0), render(cut, Exact()).mean
    assert image.mean() / exact.mean() > 1.05
    assert np.abs(source.step(Shot(cut))).mean() < 0.01 * exact.mean()
    assert manner_of(cut, source, ASKING)[0] is None
    judged = beside_exact(cut, 1.3 * image, source.step(Shot(cut)), Level(1e-6), 0.01)
    assert judged.word == "differs"


def test_what_a_peer_cannot_show_is_said_and_not_compared():
    """Scenes that are drawn for it are none of those."""
    for name in ("embree", "radiance"):
        source = stub(name)
        found = list(zip(range(12), drawn(3, (8, 8), 4, source.cannot, (), two_sided=True), strict=False))
        assert not [source.refusal(one) for _, one in found if source.refusal(one)]
        assert not {name for _, one in found for name in held(one)} & set(source.cannot)
    radiance, cycles = stub("radiance"), stub("cycles")
    shiny = SCENE.with_(meshes=(floor(material=Material((0.3, 0.3, 0.3), (0.3, 0.3, 0.3), 5.0)),))
    assert "Ward" in radiance.refusal(shiny)
    assert "quadLight" in radiance.refusal(SCENE.with_(lights=(PointLight((0.0, 3.0, 0.0), (1.0, 1.0, 1.0)),)))
    assert "--pixel-rule area" in cycles.refusal(SCENE)
    below = replace(SCENE.camera, position=(0.0, -3.0, 6.0))
    assert "--two-sided" in radiance.refusal(SCENE.with_(camera=below, two_sided=False))
    with pytest.raises(InputError, match="Ward"):
        ask([shiny], radiance, ASKING)
    reasons = {row["method"]: row["reason"] for row in ask([SCENE], radiance, ASKING) if "verdict" not in row}
    assert "no seed" in reasons["other seeds"]
    assert "a sphere, which every peer has" in reasons["white ball lit all around"]


def test_a_peer_that_is_not_there_is_a_clear_message(tmp_path, monkeypatch):
    monkeypatch.setenv("NUSSELT_PEERS", str(tmp_path))
    file = tmp_path / "mine.test"
    file.write_text(write_scene(SCENE), encoding="utf-8")
    for words in (
        ["hunt", "--renderer", "embree", "--out", str(tmp_path / "out")],
        ["metamorphic", str(file), "--renderer", "embree"],
        ["reduce", str(file), "--renderer", "embree", "-o", str(tmp_path / "small.test")],
    ):
        done = CliRunner().invoke(main, words)
        assert done.exit_code == 2, done.output
        assert "nusselt peers install embree" in done.output
    with pytest.raises(InputError, match="peers install radiance"):
        renderer_source("radiance", ".exr", 600.0, False, False)


def test_the_command_hunts_by_a_peers_name_and_says_what_is_left_out(tmp_path, monkeypatch):
    monkeypatch.setattr(Environments, "launch", lambda self, peer: [sys.executable, STUB, "middles", "dim"])
    monkeypatch.setattr(hunt_file, "drawn", lambda *asked: iter(MADE))
    words = ["hunt", "--renderer", "radiance", "--scenes", "4", "--width", "12", "--out", str(tmp_path)]
    done = CliRunner().invoke(main, [*words, "--samples", "64"])
    assert done.exit_code == 1, done.output
    assert "without point, directional, thin light, vast light, ellipsoid, glossy" in done.output
    assert "nusselt cross cause-1.test --peers radiance --two-sided" in (tmp_path / "cause-1.test").read_text()


def test_a_peer_works_job_after_job_and_begins_anew_when_it_has_ended():
    source = stub("embree", "random", "ends")
    plain = SCENE.with_(ellipsoids=())
    first = source.image(Shot(plain), 1)
    process = source._workshop._process
    np.testing.assert_array_equal(source.image(Shot(plain), 1), first)
    assert source._workshop._process is process
    with pytest.raises(ProgramFailed, match=r"Embree as caster: the renderer ended with status 1: no more balls"):
        source.image(Shot(SCENE), 1)
    np.testing.assert_array_equal(source.image(Shot(plain), 1), first)
    assert source._workshop._process is not process
    assert manner_of(SCENE, source, ASKING)[0].manner == CRASHES
    source._workshop.close()
    assert process.poll() is not None


def test_a_peer_that_hangs_cannot_start_or_fails_is_told_in_a_sentence(tmp_path):
    for text, said in {
        "import time; time.sleep(60)": "took more than 0.5 s",
        "input(); print('nusselt-peer: failed: ValueError: no'); input()": "ValueError: no",
        "print('first'); print('last words')": "ended with status 0: last words",
    }.items():
        script = tmp_path / "adapter.py"
        script.write_text(text)
        shop = Workshop([sys.executable, "-u", str(script)])
        with pytest.raises(ProgramFailed, match=said):
            shop.do(["a", "b", "{}"], 0.5 if "sleep" in text else 60)
        shop.close()
    with pytest.raises(InputError, match="can be started"):
        Workshop([str(tmp_path / "nothing")]).do([], 1)


def test_a_peer_is_named_as_it_is_kept():
    assert repr(stub()) == repr(stub("embree", "random", "dim"))
    assert isinstance(stub(), PeerSource)
