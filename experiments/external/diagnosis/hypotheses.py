"""All hypotheses, each listed once; of two that explain as much, the one with fewer fitted parameters comes first."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from . import levels, light, places
from .case import Case, Guess

Hypothesis = Callable[[Case], Iterator[Guess]]

HYPOTHESES: dict[str, Hypothesis] = {
    "rounding": levels.rounding,
    "channels-swapped": levels.channels_swapped,
    "mirrored": places.mirrored,
    "half-pixel": places.half_pixel,
    "forgotten-light": light.forgotten_light,
    "two-sided-light": light.two_sided_light,
    "light-flipped": light.light_flipped,
    "missing-cosine": light.missing_cosine,
    "missing-light-cosine": light.missing_light_cosine,
    "wrong-falloff": light.wrong_falloff,
    "missing-pi": light.missing_pi,
    "missing-lobe": light.missing_lobe,
    "unclamped-phong": light.unclamped_phong,
    "phong-normalisation": light.phong_normalisation,
    "no-shadows": light.no_shadows,
    "light-self-shadow": light.light_self_shadow,
    "short-shadow-rays": light.short_shadow_rays,
    "clamped-highlights": levels.clamped_highlights,
    "fov": places.fov,
    "gain": levels.gain,
    "gamma": levels.gamma,
    "light-scale": levels.light_scale,
    "ambient": levels.ambient,
    "aspect": places.aspect,
}
