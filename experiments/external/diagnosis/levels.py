"""Mistakes made after the light was right: gain, curves, clamps, channels, levels."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from nusselt.experiments.images.transfer import RULES, Transfer

from .case import Case, Guess
from .rules import RIGHT

PLAIN_FACTORS = {
    "half": 0.5,
    "double": 2.0,
    "a quarter": 0.25,
    "four times": 4.0,
    "pi times": math.pi,
    "1/pi of": 1 / math.pi,
    "2 pi times": 2 * math.pi,
    "a third of": 1 / 3,
    "three times": 3.0,
}
"""Factors with a usual cause: area, pi, channels."""


def factor(value: float) -> str:
    """A factor in words where it is a plain one."""
    for words, plain in PLAIN_FACTORS.items():
        if abs(value / plain - 1) < 0.01:
            return f"{value:.4g} ({words} what is right: a light's area or units, or pi)"
    return f"{value:.4g}"


def gain(case: Case) -> Iterator[Guess]:
    """Everything times a constant."""
    truth = case.probe.truth
    found = case.fit(lambda g: g * truth, np.geomspace(0.05, 20, 33))
    yield Guess(found * truth, f"every value times {factor(found)}", 1)


def light_scale(case: Case) -> Iterator[Guess]:
    """What is lit times a constant; lights seen directly are right."""
    seen = case.probe.sight.emission
    lit = case.probe.truth - seen
    found = case.fit(lambda g: seen + g * lit, np.geomspace(0.05, 20, 33))
    yield Guess(seen + found * lit, f"what is lit times {factor(found)}, lights seen directly right", 1)


def ambient(case: Case) -> Iterator[Guess]:
    """A constant added where there is a surface."""
    probe = case.probe
    surface = np.zeros(probe.x.size)
    surface[probe.sight.lit] = 1.0
    found = case.fit(lambda c: probe.truth + c * surface, np.linspace(-0.5, 0.5, 41))
    yield Guess(probe.truth + found * surface, f"{found:+.4g} on every surface: ambient light, or a black level", 1)


def gamma(case: Case) -> Iterator[Guess]:
    """A transfer curve too many, or too few."""
    truth = np.clip(case.probe.truth, 0, 1)
    yield Guess(
        Transfer("srgb").encode(truth), "encoded as sRGB where the curve was to be " + case.quantiser.transfer.name
    )
    yield Guess(Transfer("srgb").decode(truth), "decoded from sRGB once too often")
    found = case.fit(lambda g: truth ** (1 / g), np.geomspace(0.3, 3.3, 25))
    yield Guess(truth ** (1 / found), f"encoded with gamma {found:.3g}: v^(1/{found:.3g})", 1)


def channels_swapped(case: Case) -> Iterator[Guess]:
    """Red, green and blue in another order."""
    for order in itertools.permutations(range(3)):
        if order != (0, 1, 2):
            name = "".join("RGB"[k] for k in order)
            yield Guess(case.probe.truth[list(order)], f"channels in the order {name} instead of RGB")


def clamped_highlights(case: Case) -> Iterator[Guess]:
    """Values cut off: of the image, of each sample, of the lobe."""
    probe, truth = case.probe, case.probe.truth
    top = float(truth.max())
    if case.quantiser.top:
        top = min(top, 1.0)
    if top > 0:
        grid = top * np.linspace(0.05, 1, 30)
        found = case.fit(lambda c: np.minimum(truth, c), grid)
        yield Guess(np.minimum(truth, found), f"values above {found:.3g} are cut off", 1)
    for cap in (1.0, 2.0, 5.0):
        yield Guess(probe.radiance(replace(RIGHT, cap=cap)), f"samples above {cap:g} are cut off")
    if probe.sight.points.is_glossy:
        yield Guess(probe.radiance(replace(RIGHT, lobe="capped")), "the Phong lobe is cut off at 1 per steradian")


def rounding(case: Case) -> Iterator[Guess]:
    """Levels made by another rule than they were to be."""
    if case.quantiser.top:
        for other in RULES:
            if other != case.quantiser.rule:
                told = f"levels are {RULES[other]}; not {RULES[case.quantiser.rule]}"
                yield Guess(case.probe.truth, told, rule=other)
