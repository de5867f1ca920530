"""From laps to times: interpolated between laps, extrapolated by a decade at most."""

from __future__ import annotations

import pytest

from nusselt.experiments.results.seconds_to import OurLap, fastest, fastest_of_ours, seconds_to
from nusselt.mitsuba_bridge.race import Way, ladder

LAPS = [(1.0, 1e-1), (10.0, 1e-2), (100.0, 1e-3)]


def test_between_laps_time_is_interpolated():
    time = seconds_to(10**-1.5, LAPS)
    assert time is not None
    assert time.seconds == pytest.approx(10**0.5)
    assert (time.extrapolated, time.bound) == (False, False)
    assert seconds_to(0.5, LAPS).seconds == 1.0  # nothing faster was measured


def test_beyond_them_by_a_decade_and_no_more():
    one = seconds_to(1e-4, LAPS)
    assert (one.extrapolated, one.bound) == (True, False)
    assert one.seconds == pytest.approx(1000.0)
    two = seconds_to(1e-6, LAPS)
    assert (two.extrapolated, two.bound) == (True, True)
    assert two.seconds == pytest.approx(1000.0)


def test_slopes_beyond_belief_are_not_extrapolated():
    steep = seconds_to(1e-4, [(1.0, 1e-1), (1.1, 1e-2), (1.2, 1e-3)])
    assert steep.seconds == pytest.approx(1.2 * 10 ** (1 / 1.5))
    flat = seconds_to(1e-4, [(1.0, 1.1e-3), (100.0, 1e-3)])
    assert flat.seconds == pytest.approx(100 * 10 ** (1 / 0.4))


def test_the_fastest_way_wins_and_missing_laps_are_missing():
    name, time = fastest(1e-2, {"slow": LAPS, "fast": [(s / 5, e) for s, e in LAPS], "none": []})
    assert (name, time.seconds) == ("fast", pytest.approx(2.0))
    assert fastest(1e-2, {"none": []}) is None
    laps = [OurLap("exact", 0.0, *lap) for lap in ((0.1, 2e-3), (0.3, 5e-4), (0.2, 9e-4))]
    assert fastest_of_ours(1e-3, laps) is laps[2]
    assert fastest_of_ours(1e-5, laps) is None


def test_orthogonal_arrays_take_squares_of_primes():
    assert ladder(Way("orthogonal", 0), (4, 16, 64, 256, 1024)) == [4, 25, 49, 289, 961]
    assert ladder(Way("multijitter", 0), (4, 16)) == [4, 16]
