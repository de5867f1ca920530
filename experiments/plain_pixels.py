"""What must hold without any noise: emitters, background, finite values, the same kind of pixel on both sides."""

from __future__ import annotations

import numpy as np

from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.image import Image
from nusselt.renderer.vectors import Floats

from .inference import Bools

ROUNDING = 2e-6
"""Relative rounding of Mitsuba's float32 radiance, as measured on noise-free pixels (5e-7 to 2e-6)."""
UNJUDGED = 1e-3
"""Share of the shaded pixels that may lie within rounding of an edge."""


def pixel_counts(ours: Image) -> dict[str, int]:
    """Pixels by what our camera sees there."""
    return {
        "shaded": int(ours.shaded.sum()),
        "emitter": int((ours.emitter > 0).sum()),
        "background": int((ours.background == 1).sum()),
        "unjudged": int(ours.unjudged.sum()),
    }


def shaded_on_both(ours: Image, reference: Reference) -> Bools:
    return ours.shaded & (reference.emitter == 0) & (reference.background == 0)


def exact_failures(ours: Image, reference: Reference, finite: Bools) -> list[str]:
    """What must hold without any noise: finite values, the same kinds of pixel, the same plain pixels."""
    failures = []
    if not finite.all():
        failures.append(f"{int((~finite).sum())} pixels are not finite")
    # Where a pixel's box is part emitter or part background the shares are random, and are not compared.
    whole = ~ours.unjudged
    for share in (ours.emitter, ours.background, reference.emitter, reference.background):
        whole = whole & ((share == 0) | (share == 1))
    other = whole & ((ours.emitter != reference.emitter) | (ours.background != reference.background))
    if other.any():
        failures.append(f"{int(other.sum())} pixels show an emitter or the background on one side only")
    plain = whole & finite & ~other & ((ours.emitter == 1) | (ours.background == 1))
    off = (np.abs(ours.mean - reference.mean) > ROUNDING * np.abs(reference.mean)).any(axis=0)
    if (plain & off).any():
        failures.append(f"{int((plain & off).sum())} emitter or background pixels differ beyond rounding")
    return failures


def too_many_unjudged(ours: Image) -> str:
    """Why the pixels judged may not stand for the image; empty if they do.

    No defect: an image of few pixels whose centres happen to lie on edges has such a share too.
    """
    unjudged, shaded = int((ours.unjudged & ours.shaded).sum()), int(ours.shaded.sum())
    if unjudged <= UNJUDGED * max(shaded, 1):
        return ""
    return f"{unjudged} of {shaded} shaded pixels lie within rounding of an edge: more pixels would decide"


def _without_noise(mean: Floats, noise: Floats, judged: Bools) -> Bools:
    """Pixels where a side has none. Where its other pixels have, a black one may only have missed what is rare."""
    still = judged & (noise == 0)
    return still & mean.any(axis=0) if noise[judged].any() else still


def still_failures(ours: Image, reference: Reference, judged: Bools, allowed: float, scale: float) -> list[str]:
    """Shaded pixels without noise on either side, off by more than is allowed.

    Parameters
    ----------
    allowed : float
        Relative to the reference there, or to its mean ``scale`` where that is larger.
    """
    still = _without_noise(ours.mean, ours.pixel_variance, judged)
    still &= _without_noise(reference.mean, reference.pixel_standard_error, judged)
    limit = allowed * np.maximum(np.abs(reference.mean), scale)
    off = still & (np.abs(ours.mean - reference.mean) > limit).any(axis=0)
    if not off.any():
        return []
    return [f"{int(off.sum())} of {int(still.sum())} pixels without noise are off by more than {allowed:.2%}"]
