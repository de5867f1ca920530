"""From an interval and what failed to one of three words, its reason, and what would decide."""

from __future__ import annotations

import math
from typing import Literal

Word = Literal["agrees", "differs", "undecided"]


def decide(
    interval: tuple[float, float], margin: float, failures: list[str], objection: str = "", unseen: str = ""
) -> tuple[Word, str, float | None]:
    """The word, its reason, and for `undecided` how many times the samples would decide (None: none would).

    Parameters
    ----------
    interval : (low, high)
        Of the relative bias.
    margin : float
    failures : list of str
        What differs beside the bias.
    objection : str
        Why the interval may not hold; more samples may answer it.
    unseen : str
        Why the pixels judged may not stand for the image; no samples answer that.
    """
    low, high = interval
    where = f"the bias lies in [{low:+.3%}, {high:+.3%}]"
    if low > margin or high < -margin:
        failures = [f"{where}, outside the margin of {margin:.3%}", *failures]
    if failures:
        return "differs", "; ".join(failures), None
    if unseen:
        return "undecided", unseen, None
    if objection:
        return "undecided", objection, 2.0
    if -margin <= low and high <= margin:
        return "agrees", f"{where}, inside the margin of {margin:.3%}", None
    more = _more(interval, margin)
    if more is None:
        return "undecided", f"{where}: it sits on the margin; declare another margin", None
    return "undecided", f"{where}: about {more:.0f} times the samples would decide", more


def _more(interval: tuple[float, float], margin: float) -> float | None:
    """How many times the samples would decide, if the bias is what it seems."""
    centre, half = (interval[0] + interval[1]) / 2, (interval[1] - interval[0]) / 2
    room = abs(margin - abs(centre))
    factor = 1.3 * (half / room) ** 2 if room > 0 else math.inf
    return float(max(2, math.ceil(factor))) if factor <= 1e4 else None
