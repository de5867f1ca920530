"""What images by area leave out changes nothing that was asked: squares without doubt, colours known beforehand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import floor, lamp, scene

from nusselt.experiments.scenes.cameras import views
from nusselt.experiments.studies.race.measure import racer
from nusselt.experiments.studies.race.scenes import race_scene
from nusselt.renderer.lights import PointLight, SpotLight, SunLight
from nusselt.renderer.pixels import render_area
from nusselt.renderer.pixels.doubt import doubtful
from nusselt.renderer.pixels.doubt_squares import doubtful_places
from nusselt.renderer.pixels.shade import Palette, palette_of, regions_of
from nusselt.renderer.pixels.shadow_fits import Places, _unsure
from nusselt.renderer.pixels.whole_pixels import shown_by
from nusselt.renderer.surfaces import Material
from nusselt.renderer.vectors import distinct


@pytest.mark.parametrize("lights", ["its own", "hard", "with a rim"])
@pytest.mark.parametrize("view", [0, 1, 2, 3])
@pytest.mark.parametrize("name", ["cornell-boxes", "cornell", "bumpy-ball"])
def test_squares_without_doubt_hold_no_place_in_doubt(name, view, lights):
    shown = views(race_scene(name, 64))[view]
    if lights == "hard":
        shown = shown.with_(lights=(PointLight((0.1, 1.9, 0.3), (1, 1, 1)), SunLight((0.2, 1, 0.1), (1, 1, 1), 0.5)))
    elif lights == "with a rim":
        shown = shown.with_(lights=(*shown.lights, SpotLight((0.3, 1.9, 0.2), (0, -1, 0.1), 40.0, 30.0, (5, 5, 5))))
    _, needs, regions = regions_of(shown, shown.digest())
    seen = shown_by(regions, 1e-2)
    pieces = seen.pieces.take(np.flatnonzero(seen.pieces.region >= 0))
    alone, own = doubtful_places(regions, needs.sources, seen.region, pieces)
    pixel = np.flatnonzero(seen.region >= 0)
    row, column = np.divmod(pixel, shown.width)
    every = doubtful(regions, needs.sources, column + 0.5, row + 0.5, seen.region.ravel()[pixel])
    assert not (every & ~alone.ravel()[pixel]).any()
    parts = doubtful(regions, needs.sources, pieces.x, pieces.y, pieces.region)
    assert not (parts & ~own).any()
    assert every.any() or parts.any()


@pytest.mark.parametrize("name", ["cornell-boxes", "quad"])
def test_colours_known_beforehand_are_those_of_three_channels(name, monkeypatch):
    shown = views(race_scene(name, 64))[1]
    one = render_area(shown, racer(shown), tolerance=1e-4)
    monkeypatch.setattr("nusselt.renderer.pixels.shade._tint", lambda *given: None)
    three = render_area(shown, racer(shown), tolerance=1e-4)
    seen = three.image.mean
    assert np.sqrt(((one.image.mean - seen) ** 2).sum() / (seen**2).sum()) < 1e-4
    np.testing.assert_array_equal(one.image.emitter, three.image.emitter)


def palette(*lights, material):
    made = scene(floor(material=material), lights=lights)
    _, needs, regions = regions_of(made, made.digest())
    return palette_of(made, regions, needs)


def test_lights_of_two_colours_and_other_lobes_have_no_colour_known_beforehand():
    grey, red = lamp(radiance=(2.0, 2.0, 2.0)), lamp(radiance=(2.0, 1.0, 1.0))
    plain, shiny = Material((0.3, 0.5, 0.1)), Material((0.3, 0.5, 0.1), (0.2, 0.2, 0.2), 5.0)
    known: Palette = palette(red, red, material=plain)
    radiance = np.array([[0.6], [0.5], [0.1]])
    np.testing.assert_allclose(known.radiance(known.told(radiance), np.array([0])), radiance, rtol=1e-12)
    assert palette(grey, red, material=plain).tint is None
    assert palette(grey, material=shiny).tint is None


def test_places_around_which_nothing_was_measured_are_not_believed():
    n = 12
    nothing, zeros = np.zeros(0, dtype=np.int64), np.zeros(n, dtype=np.int64)
    places = Places.of(np.arange(n), np.arange(n), np.ones(n), zeros, zeros, np.ones((1, n)), np.zeros(n))
    places = replace(places, known=np.arange(n) < 3)
    going, spent = _unsure(places, zeros, np.arange(n), nothing, np.zeros(0), 1.0)
    np.testing.assert_array_equal(going, np.arange(3, n))
    assert spent == 0.0


@pytest.mark.parametrize("values", [[], [3], [3, 3, 1], [[1, 2], [2, 0]]])
def test_whole_numbers_are_told_apart_as_numpy_does(values):
    given = np.array(values, dtype=np.int64)
    np.testing.assert_array_equal(distinct(given), np.unique(given))
