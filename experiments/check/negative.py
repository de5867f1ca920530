"""Pixels below zero: right on average, and not to be shown without a word."""

from __future__ import annotations

from nusselt.renderer.estimators import Claim, Estimator
from nusselt.renderer.image import Image
from nusselt.renderer.words import count

ROUNDING = 1e-9
"""Of the brightest pixel: what exact estimators differ from zero by."""

WHY: dict[Claim, str] = {
    "unbiased": "unbiased noise of {name}; more --samples, and they near zero",
    "consistent": "the error of {name} at its number of samples; more --samples, and they near zero",
}


def negative_note(image: Image, estimator: Estimator, claim: Claim) -> str:
    """How many pixels have negative radiance in some channel, and why; nothing if it is none beyond rounding.

    Estimators that take what is hidden from a closed form give less than nothing where their samples find more hidden
    than there is.
    """
    lowest = image.mean.min(axis=0)
    below = int((lowest < -ROUNDING * image.mean.max()).sum())
    if not below:
        return ""
    why = WHY.get(claim, "an error, for {name} claims to have no noise here").format(name=estimator.name)
    return f"{count(below, 'pixel', 'is')} negative, down to {lowest.min():.1e}: {why}"
