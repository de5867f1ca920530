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


@pytest.mark.parametrize(("each", "parts", "told"), [(4, 31, "about 2 min"), (0.4, 31, "about 12 s"), (600, 25, "4 h")])
def test_a_large_job_is_announced_once(each, parts, told):
    (line,) = lines(each, parts)
    assert told in line
    assert "--cache" in line


def test_a_small_job_and_other_stages_are_not():
    assert lines(0.9 * LONG / 31, 32) == []
    assert lines(60, 32, "figures") == []
