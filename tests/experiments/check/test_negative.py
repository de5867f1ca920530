"""An image with pixels below zero says so, and why."""

from __future__ import annotations

import numpy as np
import pytest
from builders import box, floor, lamp, scene
from click.testing import CliRunner

from nusselt.experiments.check.negative import negative_note
from nusselt.experiments.cli.main import main
from nusselt.renderer.estimators import Area, CommonPointsFixed, ControlVariate, Exact
from nusselt.renderer.image import render
from nusselt.renderer.lights import SunLight
from nusselt.renderer.prepared import prepare

SHADED = """size 64 48
camera 0 3 6 0 0 0 0 1 0 40
diffuse 0.5 0.5 0.5
vertex -2 0 2
vertex 2 0 2
vertex 2 0 -2
vertex -2 0 -2
tri 0 1 2
tri 0 2 3
sphere 0 0.8 0 0.5
"""


def note_of(made, estimator):
    image = render(made, estimator, seed=1)
    return negative_note(image, estimator, estimator.claim(prepare(made).needs)), image


def blocked(light):
    return scene(floor(), box((-0.5, 0.4, -0.5), (0.5, 0.6, 0.5)), lights=(light,), size=(24, 18))


@pytest.mark.parametrize("light", [lamp(), SunLight((1, 3, 1), (1, 1, 1), 20.0)])
def test_pixels_below_zero_are_counted_and_explained(light):
    note, image = note_of(blocked(light), ControlVariate(samples=1))
    count = int((image.mean.min(axis=0) < -1e-9 * image.mean.max()).sum())
    assert count > 3
    assert note.startswith(f"{count} pixels are negative, down to {image.mean.min():.1e}: unbiased noise of control-")
    assert "more --samples" in note
    fixed, _ = note_of(blocked(light), CommonPointsFixed(samples=1))
    assert "the error of common-points-fixed" in fixed


def test_images_without_them_say_nothing():
    for estimator in (Area(samples=4), Exact()):
        note, image = note_of(blocked(lamp()), estimator)
        assert image.mean.max() > 0
        assert note == ""
    dark, image = note_of(blocked(lamp(radiance=(0, 0, 0))), Exact())
    assert not image.mean.any()
    assert dark == ""


def test_where_none_can_be_it_is_called_an_error():
    _, image = note_of(blocked(lamp()), Exact())
    image.mean[1, 3, 4] = -0.5 * np.abs(image.mean).max()
    assert negative_note(image, Exact(), "exact").startswith("1 pixel is negative, down to -")
    assert "an error" in negative_note(image, Exact(), "exact")


def test_the_command_prints_it(tmp_path):
    path = tmp_path / "shaded.test"
    path.write_text(SHADED + "sun 1 3 1 1 1 1 20\n")
    asked = ["render", str(path), "-o", str(tmp_path / "image.npy"), "--estimator", "control-variate", "--samples", "1"]
    result = CliRunner().invoke(main, asked)
    assert result.exit_code == 0
    assert "pixels are negative" in result.stderr
    quiet = [*asked[:4], "--estimator", "area", "--samples", "4"]
    assert "negative" not in CliRunner().invoke(main, quiet).stderr


SKY = """size 24 18
camera 0 3 6 0 0 0 0 1 0 40
integrator direct
vertex -2 0 2
vertex 2 0 2
vertex 2 0 -2
vertex -2 0 -2
diffuse .5 .5 .5
tri 0 1 2
tri 0 2 3
sphere 0 1 0 .3
"""
QUAD, SUN = "quadLight -.5 2 -.5 0 0 1 1 0 0 5 5 5\n", "sun 0 1 0 1 1 1 5\n"


@pytest.mark.parametrize(("lights", "bounded", "noisy"), [(QUAD, True, False), (SUN, False, True), ("", False, False)])
def test_what_is_said_of_bounds_is_said_of_values_that_have_one(lights, bounded, noisy, tmp_path):
    """A sun behind a sphere is sampled: no value has a bound then, and none is called within nothing."""
    import nusselt

    (tmp_path / "a.test").write_text(SKY + lights)
    (told,) = nusselt.render(tmp_path / "a.test", estimator="exact").told
    assert ("is within" in told, "partly sampled" in told) == (bounded, noisy)
    assert "0.0e+00" not in told
