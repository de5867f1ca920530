"""All hypotheses, each listed once, the cheap ones first."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from .camera import camera
from .case import Case, Guess
from .filters import drawn
from .indirect import indirect
from .lamps import LAMPS, POINTS
from .objects import missing, one_thing
from .pictures import PICTURES
from .shadows import SHADOWS, ends, lost_samples
from .transport import rules, samples_cut_off

Hypothesis = Callable[[Case], Iterator[Guess]]

STAGES: tuple[tuple[Hypothesis, ...], ...] = (
    (lost_samples, *PICTURES, *LAMPS, one_thing, rules, samples_cut_off),
    (camera, missing),
    (drawn, indirect),
    (*POINTS, *SHADOWS),
    (ends,),
)
"""Later ones are tried where the earlier ones leave something."""
OF_AREAS: tuple[tuple[Hypothesis, ...], ...] = ((*PICTURES, *LAMPS, one_thing, rules), (drawn, indirect))
"""Where pixels are areas: those that need not know what else than its centre a pixel shows, but at edges."""
