"""All relations, each listed once."""

from __future__ import annotations

from nusselt.experiments.metamorphic.relation import Relation

from .chance import CHANCE
from .colours import COLOURS
from .lamps import LAMPS
from .places import PLACES
from .things import THINGS

RELATIONS: tuple[Relation, ...] = (*PLACES, *THINGS, *LAMPS, *COLOURS, *CHANCE)
