"""Two images alone: the figures are the field's, sizes must be equal, and the page shows both and their difference."""

from __future__ import annotations

import os
import sys
import types

import numpy as np
import pytest
from browser import chromium, complaints, missing
from click.testing import CliRunner

from nusselt.experiments.cli.main import main
from nusselt.experiments.images.distance import Pair, flip, relative_mse, similarity, z_scores
from nusselt.experiments.images.read import size_of
from nusselt.experiments.images.write import write_image

SIZE = (24, 32)
RASTER = (np.add.outer(np.linspace(0.1, 1, SIZE[0]), np.linspace(0, 1, SIZE[1]))[..., None] * [1, 0.7, 0.4]).transpose(
    2, 0, 1
)


def noisy(seed: int, gain: float = 1.0) -> np.ndarray:
    """Two seeds of one image (2, 3, h, w)."""
    return gain * RASTER + np.random.default_rng(seed).normal(size=(2, *RASTER.shape)) * 0.05


def diff(*words: object):
    return CliRunner().invoke(main, ["diff", *map(str, words)])


@pytest.fixture
def files(tmp_path):
    """Two seeds of A, which is 5 % brighter, and of B."""
    for name, gain, seed in (("a", 1.05, 1), ("b", 1.0, 2)):
        for number, image in enumerate(noisy(seed, gain), 1):
            write_image(tmp_path / f"{name}{number}.exr", image)
    return tmp_path


def test_the_figures_are_what_their_formulas_say():
    pair = Pair(RASTER[None] * 1.1, RASTER[None])
    assert relative_mse(pair) == pytest.approx(float(np.mean((0.1 * RASTER) ** 2 / (RASTER**2 + 0.01))))
    assert pair.signed.mean() == pytest.approx(0.1)
    assert similarity(Pair(RASTER[None], RASTER[None])) == 1
    assert similarity(Pair(RASTER[None, :, :6], RASTER[None, :, :6])) is None
    assert z_scores(pair) is None


def test_z_is_noise_where_only_noise_differs_and_finds_five_percent():
    same, brighter = z_scores(Pair(noisy(1), noisy(2))), z_scores(Pair(noisy(1, 1.05), noisy(2)))
    assert abs(same[1]) < 5  # false alarm: 6e-7
    assert 0.7 < same[0].std() < 1.5
    assert brighter[1] > 15


def test_what_is_not_finite_is_counted_and_in_no_figure(files):
    broken = RASTER.copy()
    broken[0, 3, 4] = np.nan
    write_image(files / "c.exr", broken)
    write_image(files / "d.exr", RASTER)
    done = diff(files / "c.exr", files / "d.exr", "-o", files / "x.html")
    assert done.exit_code == 0
    assert "Not finite 1 pixel" in done.output
    assert "Relative MSE 0," in done.output


@pytest.mark.parametrize("suffix", [".exr", ".png", ".npy"])
def test_images_of_unequal_size_are_refused_in_one_line(suffix, tmp_path):
    write_image(tmp_path / f"a{suffix}", RASTER)
    write_image(tmp_path / f"b{suffix}", RASTER[:, :20])
    assert size_of(str(tmp_path / f"a{suffix}")) == SIZE[::-1]
    done = diff(tmp_path / f"a{suffix}", tmp_path / f"b{suffix}", "-o", tmp_path / "x.html")
    assert done.exit_code == 2
    assert done.output.count("\n") == 1
    assert "32 x 20 pixels: expected 32 x 24" in done.output
    assert not (tmp_path / "x.html").exists()


def evaluate(reference, test, kind, inputsRGB, applyMagma, parameters=None):
    """FLIP's package as far as exposures go: of a dark median it finds 2^24. It is to be asked about light alone."""
    given = parameters or {}
    assert given or reference.any()
    stop = given.get("stopExposure", 24.0 if np.median(reference) == 0 else 2.0)
    told = {"startExposure": 1.0, "stopExposure": stop, "numExposures": 2}
    return None, min(1.0, float(np.abs(reference - test).mean()) * 2**stop), told


@pytest.mark.parametrize("real", [False, True])
def test_flip_of_dark_images_sees_no_more_than_people(real, monkeypatch):
    if real:
        pytest.importorskip("flip_evaluator")
    else:
        monkeypatch.setitem(sys.modules, "flip_evaluator", types.SimpleNamespace(evaluate=evaluate))
    dark = np.where(np.arange(32) < 8, RASTER, 0.0)
    faint = np.where(np.arange(32) < 8, RASTER, 1e-7)
    value, kind = flip(Pair(faint[None], dark[None]))
    assert value < 1e-3
    assert "what shows light" in kind
    assert flip(Pair(RASTER[None] + 1e-7, RASTER[None]))[1] == "HDR-FLIP"
    assert flip(Pair(np.where(np.arange(32) < 1, np.nan, dark)[None], dark[None]))[0] == 0


def test_flip_is_asked_about_light_alone(monkeypatch):
    monkeypatch.setitem(sys.modules, "flip_evaluator", types.SimpleNamespace(evaluate=evaluate))
    black = np.zeros_like(RASTER)
    assert flip(Pair(black[None], black[None]))[0] == 0
    assert 0 < flip(Pair(RASTER[None], black[None]))[0] <= 1


@pytest.mark.parametrize("there", [True, False])
def test_flip_is_measured_where_its_package_is_there_and_said_where_not(there, files, monkeypatch):
    module = types.SimpleNamespace(evaluate=lambda reference, test, *kind, **how: (None, float(test.mean()), {}))
    monkeypatch.setitem(sys.modules, "flip_evaluator", module if there else None)
    done = diff(files / "a1.exr", files / "b1.exr", "-o", files / "x.html")
    assert ("FLIP not measured" in done.output) != there
    assert ("nusselt[flip]" in (files / "x.html").read_text()) != there


@pytest.mark.browser
@pytest.mark.skipif(
    missing() is not None and not os.environ.get("NUSSELT_NEEDS_BROWSER"), reason=f"no browser: {missing()}"
)
def test_the_page_flips_tells_the_difference_and_keeps_both_sides_together(files, tmp_path):
    from selenium.webdriver.support.ui import WebDriverWait

    a, b = files / "a1.exr", files / "b1.exr"
    assert diff(a, b, "--seeds", files / "a2.exr", files / "b2.exr", "-o", files / "x.html").exit_code == 0
    with chromium(tmp_path / "p") as browser:
        browser.get((files / "x.html").as_uri())
        left, right = browser.find_elements("css selector", ".viewer")
        WebDriverWait(browser, 10).until(
            lambda _: right.get_attribute("data-ready") == left.get_attribute("data-ready")
        )
        canvas = left.find_element("css selector", "canvas")
        canvas.send_keys("\ue014e")
        words = left.find_element("css selector", ".value").text
        assert "% of the mean" in words
        assert "standard errors" in words
        assert right.find_element("css selector", ".exposure output").text == "+0.50"
        canvas.send_keys("f")
        assert left.find_element("css selector", "input[value=reference]").is_selected()
        canvas.send_keys("d")
        assert "% of B’s mean" in left.find_element("css selector", ".legend:not([hidden])").text
        canvas.send_keys("z")
        assert "standard errors" in left.find_element("css selector", ".legend:not([hidden])").text
        assert complaints(browser) == []
