"""The cross-check on planted mistakes: images of the independent renderer stand in for peers."""

import io
import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from builders import GREY, floor, lamp, scene
from rich.console import Console

from nusselt.experiments.independent.mistakes import MISTAKES
from nusselt.experiments.independent.render import Options, render
from nusselt.experiments.independent.steps import RIGHT
from nusselt.experiments.peers.arbiter import arbiter_of
from nusselt.experiments.peers.cross import CrossQuestion, cross_check
from nusselt.experiments.peers.entrant import Entrant
from nusselt.experiments.peers.environment import Environments
from nusselt.experiments.peers.renderers import PEERS
from nusselt.experiments.peers.tables import matrix_table, peers_table, without
from nusselt.experiments.results.rows import percent
from nusselt.experiments.scenes import shapes
from nusselt.renderer.scene_text import parse_scene, write_scene

TEXT = """size 32 24
camera 0 .5 6  0 1.5 0  0 1 0  44
diffuse .5 .4 .3
vertex -4 0 4
vertex 4 0 4
vertex 4 0 -4
vertex -4 0 -4
vertex -4 5 -4
vertex 4 5 -4
tri 0 1 2
tri 0 2 3
tri 3 2 5
tri 3 5 4
quadLight -.5 2.2 -.8  0 0 1  1 0 0  5 5 4
"""
"""A floor, and a wall that a light with a shining back would light above itself."""
TWO_SIDED = next(mistake.steps for mistake in MISTAKES if mistake.name == "light from its back")


def middles(batch, samples, strata):
    """One point in the middle of each cell of a light: no noise, and an error of the method, as some peers have."""
    side = math.isqrt(samples)
    return tuple((grid.ravel() + 0.5) / side for grid in np.mgrid[0:side, 0:side])


@cache
def stand_in(side, steps=RIGHT):
    """An image (3, h, w) of the independent renderer, of side x side points, and its step from half as many a side."""
    fine, coarse = (
        render(TEXT, 32, Options(samples=n * n), replace(steps, places=middles)).transpose(2, 0, 1)
        for n in (side, side // 2)
    )
    return fine, fine - coarse


def entrant(name, side=24, steps=RIGHT, change=lambda image: image):
    image, step = stand_in(side, steps)
    return Entrant(name, "centre", change(image)[None], change(step))


def cross(*wrong):
    """Four stand-ins for peers, some of them wrong."""
    sides = {"alpha": 20, "beta": 24, "gamma": 28, "delta": 32}
    changed = {one.name: one for one in wrong}
    found = [changed.get(name) or entrant(name, side) for name, side in sides.items()]
    return cross_check(parse_scene(TEXT), found, CrossQuestion())


@cache
def lights():
    """Where the light itself is seen, (h, w)."""
    return (stand_in(16)[0] == np.array([5.0, 5.0, 4.0])[:, None, None]).all(axis=0)


def dimmed(image):
    """By a twentieth of a per cent, but for the light itself."""
    return image * np.where(lights(), 1.0, 0.9995)


def shifted(image):
    return np.roll(image, 1, axis=2)


def test_right_ones_agree():
    found = cross()
    assert set(found.findings.words.values()) == {"agrees"}
    assert [set(cluster.names) for cluster in found.findings.clusters] == [{"alpha", "beta", "gamma", "delta"}]
    assert {pair.word for pair in found.pairs.values()} == {"agrees"}


@pytest.mark.parametrize(
    "how", [{"change": shifted}, {"change": dimmed}, {"steps": TWO_SIDED}], ids=["shifted", "dimmed", "two-sided"]
)
def test_the_odd_one_out_is_named(how):
    found = cross(entrant("gamma", **how))
    assert found.findings.words == {"alpha": "agrees", "beta": "agrees", "gamma": "differs", "delta": "agrees"}
    (sentence,) = [said for said in found.findings.said if "odd one out" in said]
    assert sentence.startswith("gamma is the odd one out")
    assert all(name in sentence for name in ("alpha", "beta", "delta"))


def test_a_shared_mistake_is_named_as_such():
    """Two that agree with each other are not thereby right."""
    found = cross(entrant("beta", change=dimmed), entrant("gamma", 28, change=dimmed))
    assert found.pairs["beta", "gamma"].word == "agrees"
    assert [(set(cluster.names), cluster.right) for cluster in found.findings.clusters] == [
        ({"alpha", "delta"}, True),
        ({"beta", "gamma"}, False),
    ]
    assert any("share a mistake" in said and "support the exact image" in said for said in found.findings.said)


def test_all_against_the_exact_image():
    """Then it may be ours that is wrong, and that is said."""
    found = cross(*(entrant(name, change=dimmed) for name in ("alpha", "beta", "gamma", "delta")))
    assert [cluster.right for cluster in found.findings.clusters] == [False]
    assert any("or ours" in said for said in found.findings.said)


def test_lights_that_are_not_seen_are_found():
    """The mean over surfaces says nothing of them."""
    found = cross(entrant("delta", change=lambda image: image * ~lights()))
    assert found.findings.words["delta"] == "differs"
    assert "lights are seen" in found.exact["delta"].reason


def test_noise_is_no_mistake():
    """A noisy renderer is neither right nor wrong, and what it would have shown is said."""
    noise = np.random.default_rng(5).normal(size=(4, 1, 24, 32)) * np.where(lights(), 0.0, 0.3)
    found = cross(Entrant("delta", "centre", stand_in(16)[0] * (1 + noise)))
    assert found.findings.words["delta"] == "undecided"
    assert any(said.startswith("delta: nothing speaks against it") for said in found.findings.said)


def test_a_method_without_noise_is_held_to_its_own_step():
    """An error that its step shows is taken out, as 1/n^2; one that it does not show differs."""
    image = stand_in(16)[0]
    error = 0.01 * np.where(lights(), 0.0, image)
    for share, word in ((-3.0, "agrees"), (0.0, "differs")):
        found = cross(Entrant("alpha", "centre", (image + error)[None], share * error))
        assert found.findings.words["alpha"] == word


def test_a_light_that_is_cut_along_its_own_rows_is_allowed_a_row_of_points():
    """45 % of it are seen, of 8 rows and of 4 half: nothing in the step, and the image 11 % off. A third is more."""
    sheet = shapes.plate((-1.0, 1.0), (-1.0, 0.08), 2.49, GREY)
    cut = scene(floor(), sheet, lights=(lamp(2.5, 0.8),), size=(16, 12), two_sided=True)
    fine, coarse = (
        render(write_scene(cut), 16, Options(samples=n * n), replace(RIGHT, places=middles)).transpose(2, 0, 1)
        for n in (8, 4)
    )
    right, bright = (Entrant(name, "centre", k * fine[None], fine - coarse, 64) for name, k in (("a", 1), ("b", 1.3)))
    found = cross_check(cut, [right, bright], CrossQuestion())
    assert found.exact["a"].bias > 0.05
    assert found.findings.words == {"a": "agrees", "b": "differs"}


def test_pixels_of_two_lights_are_not_held_against_a_renderer_of_areas():
    """What share of a pixel each of two lights has is noise where pixels are areas."""
    lamps = ("quadLight -1.5 1 -1  0 1.5 0  1.57 0 0  5 5 4", "quadLight .07 1 -1  0 1.5 0  1.5 0 0  0 0 9")
    two = "\n".join((TEXT.partition("quadLight")[0], *lamps))
    found = arbiter_of(parse_scene(two), ["area"], 1e-3)
    shown = found.truths["area"].reference.mean[:, found.emitter]
    assert shown.shape[1] > 0
    assert {tuple(colour) for colour in shown.T} <= {(5.0, 5.0, 4.0), (0.0, 0.0, 9.0)}


@pytest.mark.parametrize("width", [80, 100, 140])
def test_tables_have_every_number_whole_at_any_width(width, tmp_path):
    found = cross(entrant("gamma", change=shifted))
    page = io.StringIO()
    told = Console(file=page, width=width)
    many = replace(found, entrants=found.entrants * 2)  # the names of as many renderers as there are
    told.print(matrix_table(many, width))
    told.print(peers_table(PEERS, Environments(tmp_path), width))
    lines = page.getvalue().splitlines()
    assert max(map(len, lines)) <= width
    for name, one in found.exact.items():
        assert any(name in line and f"{percent(one.bias, 4, True, '')} ± " in line for line in lines)
        for other in found.exact:
            if (name, other) in found.pairs:
                bias = percent(found.pairs[name, other].bias, 4, True, "")
                assert any(name in line and bias in line for line in lines)
    for peer in PEERS:
        for cell in (peer.title, peer.rule, str(peer.megabytes)):
            assert any(peer.name in line and cell in line for line in lines)


def test_who_is_not_there_is_said_once():
    one = replace(cross(), missing={"povray": "not installed"})
    other = replace(one, missing={"povray": "not installed", "cycles": "no sky"}, scene=one.scene.with_(name="other"))
    assert without([one, other]) == ["without povray: not installed", "other: without cycles: no sky"]
