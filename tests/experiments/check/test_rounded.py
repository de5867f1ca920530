"""A reference kept in few bytes: how far it is moved, that this is counted as noise, and that verdicts stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import floor, lamp, scene

from nusselt.experiments.check.references import read_reference, write_reference
from nusselt.experiments.check.rounded import OCTAVE, PARTS, as_kept
from nusselt.experiments.verdict.judge import judge
from nusselt.experiments.verdict.level import Level
from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render

ROOM = scene(floor(), lights=(lamp(),), size=(48, 36), light_samples=9)
COUNTED = 1 + 1 / (12 * PARTS**2)
"""The variance a pixel has with its rounding, of that it has."""


@pytest.fixture(scope="module")
def fresh() -> Reference:
    """640 x 480 pixels of smooth shading with 5 % noise, as 32 passes tell it; a dark frame has none."""
    rng, shape = np.random.default_rng(1), (480, 640)
    truth = np.add.outer(np.linspace(0.2, 1, 480), np.linspace(0.1, 2, 640)) * np.array([1, 0.7, 0.4])[:, None, None]
    noise = rng.normal(size=shape) * np.array([1, 0.7, 0.4])[:, None, None]
    error = 0.05 * truth * np.sqrt(rng.chisquare(31, size=shape) / 31)
    background = np.zeros(shape)
    background[:, :40] = 1
    seen = background == 0
    mean = np.where(seen, truth + 0.05 * truth * noise, 0.0)
    passes = 1 + 1e-3 * rng.normal(size=32)
    plane = np.zeros(shape)
    sides = {
        "mean": mean,
        "standard_error": np.where(seen, error, 0),
        "pixel_standard_error": error.mean(axis=0) * seen,
    }
    told = {"renderer": "mitsuba", "version": "3", "variant": "v", "llvm": None, "notes": (), "seconds": {}}
    return Reference(
        **sides, emitter=plane, background=background, holes=plane, pass_means=passes, samples=8, passes=32, **told
    )


def test_a_reference_of_640_by_480_is_below_a_megabyte(fresh, tmp_path):
    made = scene(floor(), lights=(lamp(),), size=(640, 480))
    write_reference(tmp_path / "a.npz", made, fresh, 1e-4)
    assert (tmp_path / "a.npz").stat().st_size < 1 << 20
    read, kept = read_reference(tmp_path / "a.npz", made)[0], as_kept(fresh)
    for name in ("mean", "standard_error", "pixel_standard_error", "pass_means", "background"):
        np.testing.assert_array_equal(getattr(read, name), getattr(kept, name))


def test_rounding_is_a_share_of_the_noise_and_counted_in_it(fresh):
    kept, noisy = as_kept(fresh), fresh.standard_error > 0
    ratio = kept.standard_error[noisy] / fresh.standard_error[noisy]
    moved = np.abs(kept.mean - fresh.mean)[noisy] / fresh.standard_error[noisy]
    octave = 2 ** (0.5 / OCTAVE)
    assert moved.max() <= 0.5 / PARTS * octave * 1.001
    assert ratio.max() <= octave * COUNTED**0.5
    assert ratio.min() >= COUNTED**0.5 / octave * 0.999
    assert (moved**2).mean() == pytest.approx(COUNTED - 1, rel=0.02)
    assert (ratio**2).mean() == pytest.approx(COUNTED, abs=5e-4)
    assert kept.pooled_error > fresh.pooled_error
    np.testing.assert_array_equal(kept.mean[~noisy], fresh.mean[~noisy])
    assert not kept.standard_error[~noisy].any()


def test_what_has_no_noise_or_next_to_none_keeps_seven_digits(fresh):
    small = replace(fresh, standard_error=fresh.mean * 1e-12, pixel_standard_error=fresh.mean.mean(axis=0) * 1e-12)
    none = replace(fresh, standard_error=0 * fresh.mean, pixel_standard_error=0 * fresh.mean[0], pass_means=np.ones(1))
    for exact in (small, none):
        kept = as_kept(exact)
        np.testing.assert_allclose(kept.mean, exact.mean, rtol=2**-24)
    assert not kept.standard_error.any()


def test_verdicts_are_those_of_the_fresh_reference():
    """The interval of the bias moves by less than 2 % of its width; a right image, one that is off, one in between."""
    theirs = Reference.of_image(render(ROOM, Area(samples=16), seed=1, passes=32), "mitsuba", 16)
    kept = as_kept(theirs)
    ours = render(ROOM, Area(samples=16), seed=2, passes=32)
    words = []
    for gain in (1.0, 1.01, 1.03):
        brighter = replace(ours, mean=gain * ours.mean, first=gain * ours.first, pass_means=gain * ours.pass_means)
        fresh_one, kept_one = (judge(brighter, side, passes=32, margin=0.01, level=Level()) for side in (theirs, kept))
        words.append(fresh_one.word)
        assert kept_one.word == fresh_one.word
        before, after = (np.array(one.bias_interval) for one in (fresh_one, kept_one))
        assert np.abs(after - before).max() < 0.02 * np.ptp(before)
    assert words[0] == "agrees"
    assert words[-1] == "differs"
