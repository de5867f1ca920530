"""Readings against what somebody expects of them: each channel a test of its own."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.expected_pixel import ExpectedPixel
from nusselt.renderer.image import Image
from nusselt.renderer.vectors import Floats

from .decision import Word
from .intervals import Bias
from .judge import Verdict
from .level import Level

OWN_ROUNDING = 1e-9
"""Relative error that a noise-free reading of ours may have and still be what is expected."""
SHARE = 1 / 25
"""Of the false-alarm rate of a row that expects pixels; the rules have the rest."""
Said: TypeAlias = tuple[Word, str]


@dataclass(frozen=True)
class Difference:
    """Of readings (3, n), relative, each within a half width at its false-alarm rate; ``allowed`` is no difference."""

    value: Floats
    half: Floats
    allowed: Floats

    def ends(self, k: int) -> list[float]:
        """The interval of the reading's channel that is furthest off."""
        worst = int((np.abs(self.value[:, k]) + self.half[:, k]).argmax())
        value, half = float(self.value[worst, k]), float(self.half[worst, k])
        return [value - half, value + half]

    def said(self, of: str, k: int) -> Said:
        """The verdict on a reading, and a sentence.

        It differs if any channel is beyond what is allowed whatever the noise, and agrees if all are within it.
        """
        value, half, allowed = np.abs(self.value[:, k]), self.half[:, k], self.allowed[:, k]
        word: Word = "differs" if (value - half > allowed).any() else "agrees"
        word = word if word == "differs" or (value + half <= allowed).all() else "undecided"
        where = {"agrees": "inside", "differs": "outside", "undecided": "too wide for"}[word]
        low, high = self.ends(k)
        return word, f"off {of} by [{low:+.3%}, {high:+.3%}], {where} {allowed[0]:.3%}"


def unit_of(readings: Floats, unoccluded: Floats | None = None) -> Floats:
    """What differences are relative to, (3, n): each channel to itself, or to what it would be if nothing blocked."""
    unit = np.abs(readings)
    for other in ([] if unoccluded is None else [unoccluded]) + [np.broadcast_to(unit.mean(axis=0), unit.shape)]:
        unit = np.where(unit > 0, unit, other)
    return np.where(unit > 0, unit, unit.mean() or 1.0)


def from_expected(
    mean: Floats, variance: Floats, passes: int, expected: Floats, percent: Floats, level: float
) -> Difference:
    """Readings (3, n), and the variance of each pass, against expected ones (3, n), known to some percent (n,)."""
    bias = Bias(mean - expected, np.sqrt(variance / passes), np.full(mean.shape, max(passes - 1.0, 1.0)))
    unit = unit_of(expected)
    allowed = percent / 100 + OWN_ROUNDING
    return Difference(
        bias.value / unit, bias.half_width(level / mean.size) / unit, np.broadcast_to(allowed, unit.shape)
    )


def rest(level: Level, pixels: tuple[ExpectedPixel, ...]) -> Level:
    """What is left of a level for the rules, where pixels are expected."""
    return replace(level, alpha=level.alpha * (1 - SHARE)) if pixels else level


def with_pixels(verdict: Verdict, ours: Image, passes: int, pixels: tuple[ExpectedPixel, ...], level: Level) -> Verdict:
    """A verdict that holds for the expected pixels too: what differs there differs, what is open there is open.

    Parameters
    ----------
    level : Level
        The whole one: the verdict was made at its `rest`.
    """
    if not pixels:
        return verdict
    x, y = [pixel.x for pixel in pixels], [pixel.y for pixel in pixels]
    height, width = ours.mean.shape[1:]
    if max(x) >= width or max(y) >= height:
        raise InputError("expectPixel", f"{max(x)}, {max(y)}", f"pixels of {width} x {height}, from 0")
    expected = np.array([pixel.radiance for pixel in pixels]).T
    percent = np.array([pixel.percent for pixel in pixels])
    found = from_expected(
        ours.mean[:, y, x], ours.variance[:, y, x], passes, expected, percent, SHARE * level.alpha / level.rows
    )
    said = [found.said("what is expected", k) for k in range(len(pixels))]
    told = [(word, f"pixel {p.x}, {p.y} is {reason}") for (word, reason), p in zip(said, pixels, strict=True)]
    for word in ("differs", "undecided"):
        reasons = [reason for other, reason in told if other == word]
        if reasons and verdict.word != "differs":
            return replace(verdict, word=word, reason="; ".join(reasons), more=None)
        if reasons and word == "differs":
            return replace(verdict, reason="; ".join((verdict.reason, *reasons)))
    return verdict
