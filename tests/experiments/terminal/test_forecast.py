"""Long work is announced from its measured rate, once, with what would take less; short work is not."""

from __future__ import annotations

import pytest

from nusselt.experiments.terminal.progress import LONG, Forecast


def lines(seconds_each: float, parts: int, stage: str = "reference") -> list[str]:
    """All that is said while a job of so many equal parts runs, by a clock of its own."""
    now = [100.0]
    forecast, said = Forecast(lambda: now[0]), []
    for done in range(parts + 1):
        said.append(forecast(stage, done, parts))
        now[0] += seconds_each
    return [line for line in said if line]


@pytest.mark.parametrize(("each", "parts", "told"), [(4, 31, "about 116 s"), (0.4, 31, "about 12 s"), (600, 25, "4 h")])
def test_a_large_job_is_announced_once(each, parts, told):
    (line,) = lines(each, parts)
    assert told in line
    assert "--cache" in line


def test_start_up_is_not_taken_for_the_rate():
    """Four images each of 1, 4 and 16 parts, two seconds of start-up and a second a part: 92 s in all, 82 left."""
    now, said, done = [0.0], [], 0
    forecast = Forecast(lambda: now[0])
    for parts in [1] * 4 + [4] * 4 + [16] * 4:
        said.append(forecast("renderer", done, 84))
        done, now[0] = done + parts, now[0] + 2 + parts
    (line,) = filter(None, said)
    assert "about 114 s more" in line  # at the rate of an image of 4 parts; by the first image 240 s


def test_a_small_job_and_other_stages_are_not():
    assert lines(0.9 * LONG / 31, 32) == []
    assert lines(60, 32, "figures") == []
