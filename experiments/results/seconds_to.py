"""From laps (seconds, error) to the seconds that an error takes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

DECADE = 10.0
"""How far below the smallest error measured a time may be extrapolated."""
STEEPEST, FLATTEST = -1.5, -0.4
"""Slopes of error against time that are believed; Monte Carlo has -1/2, the best strata less than -1."""


@dataclass(frozen=True)
class OurLap:
    """One image of ours.

    Parameters
    ----------
    estimator : str
    tolerance : float
        Asked; 0 where none can be.
    seconds, error : float
        Wall time, and relative RMS error against the truth.
    """

    estimator: str
    tolerance: float
    seconds: float
    error: float


@dataclass(frozen=True)
class Time:
    """Seconds to an error.

    Parameters
    ----------
    seconds : float
    extrapolated : bool
        Whether the error is smaller than any measured.
    bound : bool
        Whether it is more than a decade smaller: then the time is at least this.
    """

    seconds: float
    extrapolated: bool = False
    bound: bool = False


def seconds_to(target: float, laps: Sequence[tuple[float, float]]) -> Time | None:
    """Time of one configuration, from its laps (seconds, error), more and more samples; None without any.

    Between laps log-log interpolation; beyond them the slope of the last three, at most a decade.
    """
    if not laps:
        return None
    enough = [seconds for seconds, error in laps if error <= target]
    worse = [(seconds, error) for seconds, error in laps if error > target]
    if enough:
        after = min(enough)
        before = [lap for lap in worse if lap[0] < after]
        if not before:
            return Time(after)
        (s0, e0), e1 = min(before, key=lambda lap: lap[1]), max(e for s, e in laps if s == after)
        share = math.log(e0 / target) / math.log(e0 / max(e1, 1e-300))
        return Time(s0 * (after / s0) ** share)
    seconds, error = (np.log([lap[k] for lap in laps[-3:]]) for k in (0, 1))
    slope = float(np.polyfit(seconds, error, 1)[0]) if len(laps) > 1 and np.ptp(seconds) > 0 else -0.5
    slope = min(max(slope, STEEPEST), FLATTEST)
    s0, e0 = min(laps, key=lambda lap: lap[1])
    reached = max(target, e0 / DECADE)
    return Time(s0 * (reached / e0) ** (1 / slope), True, reached > target)


def fastest(target: float, laps: dict[str, list[tuple[float, float]]]) -> tuple[str, Time] | None:
    """The configuration that takes the shortest time, and that time."""
    times = [(name, seconds_to(target, sorted(found))) for name, found in laps.items()]
    known = [(name, time) for name, time in times if time is not None]
    return min(known, key=lambda entry: entry[1].seconds) if known else None


def fastest_of_ours(target: float, laps: Sequence[OurLap]) -> OurLap | None:
    """The shortest lap whose measured error is small enough; nothing is interpolated or extrapolated."""
    return min((lap for lap in laps if lap.error <= target), key=lambda lap: lap.seconds, default=None)
