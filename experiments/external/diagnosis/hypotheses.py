"""All hypotheses, each listed once, the cheap ones first."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from .camera import camera
from .case import Case, Guess
from .lamps import LAMPS, each_light, grey_lights, light_scale
from .objects import OBJECTS, missing
from .pictures import PICTURES
from .shadows import SHADOWS, ends, lost_samples
from .transport import rules, samples_cut_off

Hypothesis = Callable[[Case], Iterator[Guess]]

STAGES: tuple[tuple[Hypothesis, ...], ...] = (
    (lost_samples, *PICTURES, light_scale, each_light, grey_lights, *OBJECTS, rules, samples_cut_off),
    (camera, missing),
    (*(lamp for lamp in LAMPS if lamp not in (light_scale, each_light, grey_lights)), *SHADOWS),
    (ends,),
)
"""Later ones are tried where the earlier ones leave something."""
