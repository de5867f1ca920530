"""The independent renderer: that it is independent, and right; and that every mistake changes its image."""

from __future__ import annotations

import ast
import sys
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from builders import GREY, floor, lamp, scene

from nusselt.experiments.independent.mistakes import MISTAKES
from nusselt.experiments.independent.plain_scenes import PLAIN
from nusselt.experiments.independent.render import WAYS, Options, render
from nusselt.experiments.independent.steps import Steps
from nusselt.experiments.independent.world import read_world
from nusselt.experiments.scenes.catalogue import CLASSIC
from nusselt.experiments.studies.brought_images import scene_named, text_of
from nusselt.renderer.estimators import Exact
from nusselt.renderer.image import render as ours
from nusselt.renderer.scene_text import write_scene
from nusselt.renderer.surfaces import Ellipsoid

FOLDER = Path(__file__).resolve().parents[3] / "experiments" / "independent"
WIDTH = 24
TURNS = 16
BALL = Ellipsoid.sphere((0.3, 0.6, 0.2), 0.6, GREY)
SURE = 6.5
"""Standard errors, with 15 degrees of freedom: exceeded with a probability of 1e-5; of a normal mean 1e-10."""


def outside(text: str) -> set[str]:
    """Modules that a source text imports beyond its own folder, NumPy and Python's own."""
    names = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            names.add(str(node.module))
    own = "nusselt.experiments.independent"
    allowed = {"numpy", *sys.stdlib_module_names}
    return {n for n in names if n.split(".")[0] not in allowed and n != own and not n.startswith(own + ".")}


def test_it_shares_no_code_with_the_project():
    files = sorted(FOLDER.rglob("*.py"))
    assert len(files) > 10
    for path in files:
        text = path.read_text(encoding="utf-8")
        assert outside(text) == set(), path
        up = len(path.relative_to(FOLDER).parents)
        levels = [node.level for node in ast.walk(ast.parse(text)) if isinstance(node, ast.ImportFrom)]
        assert max(levels, default=0) <= up, path
    assert outside("from nusselt.renderer import image\nimport scipy.stats") == {"nusselt.renderer", "scipy.stats"}


def errors(name: str, options: Options, steps: Steps | None = None) -> tuple[float, float]:
    """The mean's error over the shaded pixels in standard errors, and the largest elsewhere."""
    exact = ours(scene_named(name, WIDTH), Exact())
    chosen = {} if steps is None else {"steps": steps}
    images = [
        render(text_of(name), WIDTH, Options(options.samples, options.strata, False, options.way, seed), **chosen)
        for seed in range(TURNS)
    ]
    step = np.array(images).transpose(0, 3, 1, 2) - exact.mean
    means = step.mean(axis=1)[:, exact.shaded].mean(axis=1)
    plain = np.abs(step[0][:, ~exact.shaded]).max() if (~exact.shaded).any() else 0.0
    error = max(means.std(ddof=1) / TURNS**0.5, 1e-12)
    return float(means.mean() / error), float(plain)


@pytest.mark.parametrize("name", ["three-lights", "egg", "shiny floor", "point and lamp"])
def test_its_images_are_the_exact_ones_on_average(name):
    for way in WAYS:
        z, plain = errors(name, Options(4, way == "area", way=way))
        assert abs(z) < SURE, way
        assert plain < 1e-12


def test_a_planted_mistake_is_not_exact():
    (wrong,) = [one for one in MISTAKES if one.name == "gain 0.98"]
    assert abs(errors("ball", Options(16))[0]) < SURE
    assert abs(errors("ball", Options(16), wrong.steps)[0]) > SURE


def test_what_has_no_noise_is_ours_to_rounding():
    for name in ("point", "direction"):
        exact = ours(scene_named(name, WIDTH), Exact()).mean.transpose(1, 2, 0)
        np.testing.assert_allclose(render(text_of(name), WIDTH, Options(1)), exact, rtol=1e-10, atol=1e-13)


def test_every_scene_is_read_alike():
    for name in (*CLASSIC, *PLAIN):
        world, scene = read_world(text_of(name)).sized(WIDTH), scene_named(name, WIDTH)
        assert (world.width, world.height, len(world.lights)) == (scene.width, scene.height, len(scene.lights))


def test_seeds_and_jitter_do_what_they_say():
    first, again, other = (render(text_of("ball"), WIDTH, Options(4, seed=seed)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()
    jittered = np.mean(
        [render(text_of("box"), WIDTH, Options(64, jittered=True, seed=seed)) for seed in (1, 2)], axis=0
    )
    centres = render(text_of("box"), WIDTH, Options(64))
    assert np.abs(jittered - centres).max() > 0.05  # an edge crosses some pixel


def test_mistakes_have_names_scenes_and_steps_of_their_own():
    assert len(MISTAKES) >= 120
    assert len({mistake.name for mistake in MISTAKES}) == len(MISTAKES)
    steps = {field.name for field in fields(Steps)}
    for mistake in MISTAKES:
        assert mistake.hook in steps
        assert mistake.says
        assert mistake.scene in (*CLASSIC, *PLAIN)


@pytest.mark.parametrize(("meshes", "balls"), [((floor(),), ()), ((), (BALL,))], ids=["no ball", "no triangle"])
def test_every_mistake_can_be_made_in_scenes_without_what_it_is_about(meshes, balls):
    """Relations take things out; images may be smaller than a tile."""
    text = write_scene(scene(*meshes, ellipsoids=balls, lights=(lamp(),), size=(9, 7)))
    for mistake in MISTAKES:
        with np.errstate(all="ignore"):  # mistakes divide by what they like
            assert render(text, 9, Options(4, mistake.strata, seed=3), mistake.steps).shape == (7, 9, 3)


@pytest.mark.slow
def test_mistakes_change_their_images():
    """Every fourth; the study `planted-images` measures them all."""
    right = {}
    for mistake in MISTAKES[::4]:
        key, options = (mistake.scene, mistake.strata), Options(16, mistake.strata, seed=3)
        if key not in right:
            right[key] = render(text_of(mistake.scene), 96, options)
        wrong = render(text_of(mistake.scene), 96, options, mistake.steps)
        assert wrong.shape == right[key].shape
        assert not np.allclose(wrong, right[key], rtol=1e-6), mistake.name
