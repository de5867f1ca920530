"""Mistakes made after the light was right: gain, clamps, channels, levels, dark corners, patterns."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np

from nusselt.experiments.images.transfer import RULES, Quantiser, Transfer

from .case import Case, Guess
from .curves import curves, followed
from .filters import filters
from .lamps import in_words

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def gain(case: Case) -> Iterator[Guess]:
    """Everything times a constant; every channel times its own."""
    (factor,) = case.combined(case.truth[None])
    told = f"every value times {in_words(float(factor), case)}"
    yield Guess("gain", factor * case.truth, told, 1)
    factors = case.combined(np.eye(3)[:, :, None] * case.truth)
    words = " ".join(f"{value:.4g}" for value in factors)
    yield Guess("channel-scale", factors[:, None] * case.truth, f"red, green and blue times {words}", 3)
    seen = case.probe.sight.emission
    lit = case.truth - seen
    if seen.any():
        factors = case.combined(np.eye(3)[:, :, None] * lit, seen)
        words = " ".join(f"{value:.4g}" for value in factors)
        told = f"what is lit: red, green and blue times {words}"
        yield Guess("channel-scale", seen + factors[:, None] * lit, told, 3)


def mixed(case: Case) -> Iterator[Guess]:
    """Channels in another order, or mixed: grey, more or less colour, any matrix."""
    truth = case.truth
    for order in itertools.permutations(range(3)):
        if order != (0, 1, 2):
            name = "".join("RGB"[k] for k in order)
            yield Guess("channels-swapped", truth[list(order)], f"channels in the order {name} instead of RGB")
    for channel in range(3):
        black = truth.copy()
        black[channel] = 0
        yield Guess("channel-missing", black, f"the {('red', 'green', 'blue')[channel]} channel is black")
    for told, of in (("their mean", np.ones(3) / 3), ("their luminance", LUMINANCE)):
        grey = np.repeat((of @ truth)[None], 3, axis=0)
        yield Guess("grey", grey, f"the image is grey: every channel holds {told}")
        (share,) = case.combined((truth - grey)[None], grey)
        yield Guess("saturation", grey + share * (truth - grey), f"colours are {share:.3g} times as far from {told}", 1)


def ambient(case: Case) -> Iterator[Guess]:
    """A constant added: where there is a surface, or to its albedo; everywhere."""
    points = case.probe.sight.points
    albedo = np.zeros_like(case.truth)
    albedo[:, case.probe.sight.lit] = points.diffuse
    for told, where in (
        ("on every surface: ambient light, or a black level", np.where(case.lit, 1.0, 0.0) + 0 * case.truth),
        ("times the albedo on every surface: ambient light", albedo),
        ("on every pixel: a black level", np.ones_like(case.truth)),
    ):
        if where.any():
            (value,) = case.combined(where[None], case.truth)
            yield Guess("ambient", case.truth + value * where, f"{value:+.4g} {told}", 1)
    if case.lit.any():
        parts = np.stack((case.truth, np.where(case.lit, 1.0, 0.0) + 0 * case.truth))
        factor, value = case.combined(parts)
        told = f"every value times {factor:.4g}, and {value:+.4g} on surfaces: contrast"
        yield Guess("contrast", factor * parts[0] + value * parts[1], told, 2)


def cut_off(case: Case) -> Iterator[Guess]:
    """Values above some are that."""
    truth = case.truth
    top = float(truth.max())
    if case.quantiser.top:
        top = min(top, 1.0)
    if top > 0:
        value = case.nearest(lambda c: np.minimum(truth, c), top * np.linspace(0.05, 1, 30))
        yield Guess("clamped-highlights", np.minimum(truth, value), f"values above {value:.3g} are cut off", 1)
        if not case.quantiser.top:
            yield Guess("clamped-highlights", np.minimum(truth, 1.0), "values above 1 are cut off")
            yield Guess(
                "clamped-highlights",
                np.clip(truth, 0, 1) ** (1 / 2.2),
                "values are cut off at 1, then encoded with gamma 2.2",
            )


def rounding(case: Case) -> Iterator[Guess]:
    """Levels made by another rule than they were to be; eight bits where there were to be floats."""
    if case.quantiser.top:
        for other in RULES:
            if other != case.quantiser.rule:
                told = f"levels are {RULES[other]}; not {RULES[case.quantiser.rule]}"
                yield Guess("rounding", case.truth, told, rule=other)
        return
    for rule, offset in (("round", 0.0), ("truncate", 0.5 / 255)):
        eight = Quantiser(255, Transfer("linear"), rule)  # type: ignore[arg-type]
        expected = eight.expected(np.clip(case.truth, 0, 1), case.deviation)
        level = np.where((expected == 0) | (expected == 1), expected, expected - offset)
        yield Guess("rounding", level, f"values are {RULES[eight.rule]}, and cut off at 1")
        lit = np.where(case.lit, level, case.truth)
        yield Guess("rounding", lit, f"values of surfaces are {RULES[eight.rule]}")


def corners(case: Case) -> Iterator[Guess]:
    """Darker or brighter towards the corners by powers of the cosine to the line of sight."""
    scene = case.probe.scene
    across = 2 * math.tan(math.radians(scene.camera.fov_y) / 2) / scene.height
    x, y = (case.probe.x - scene.width / 2) * across, (case.probe.y - scene.height / 2) * across
    cosine = 1 / np.sqrt(1 + x * x + y * y)
    for power in (1, 2, 3, 4, -1, -2, -3, -4):
        told = f"times the {'' if abs(power) == 1 else f'{abs(power)}th power of the '}cosine to the line of sight"
        yield Guess("camera-cosine", case.truth * cosine**power, told if power > 0 else told.replace("times", "over"))
    found = case.nearest(lambda p: case.truth * cosine**p, np.linspace(-8, 16, 25))
    told = f"darker towards the corners, as the cosine to the line of sight to the power {found:.3g}: a vignette"
    yield Guess("camera-cosine", case.truth * cosine**found, told, 1)


def patterns(case: Case) -> Iterator[Guess]:
    """Rows, columns or fields brighter and darker in turn; from one side to the other."""
    rows, columns = case.probe.rows.ravel(), case.probe.columns.ravel()
    across, down = (2 * (v + 0.5) / (v.max() + 1) - 1 for v in (columns, rows))
    signs = {
        "odd rows brighter than even ones": (-1.0) ** (rows + 1),
        "odd columns brighter than even ones": (-1.0) ** (columns + 1),
        "every second pixel brighter, as on a checkerboard": (-1.0) ** (rows + columns),
        "brighter from left to right": across,
        "brighter from top to bottom": down,
    }
    for told, sign in signs.items():
        part = case.truth * sign
        (size,) = case.combined(part[None], case.truth)
        yield Guess("pattern", case.truth + size * part, f"{told}: {size:+.2%}", 1)


PICTURES = (gain, mixed, ambient, curves, followed, cut_off, rounding, filters, corners, patterns)
