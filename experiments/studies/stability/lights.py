"""Rows of stiff lights: every kind's irradiance without blockers and its bound, against values known to 25 digits."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np

from nusselt.experiments.runs.experiment import Outcome
from nusselt.experiments.studies.stability.closed_forms import held, relative_error
from nusselt.renderer.lights import LIGHTS, Light, MeshLight
from nusselt.renderer.lobes import Lambert
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.surfaces import Mesh
from nusselt.renderer.vectors import column

OWN = Path(__file__).with_name("oracles-lights.json")
"""Made by `tests/support/make_light_oracles.py`."""
WHITE = (1.0, 1.0, 1.0)
ROUNDINGS = 4 * 2.0**-53
"""Of the factors by which a radiance is made an irradiance, and of its own last bits."""


@dataclass(frozen=True)
class LightCase:
    """A light of radiance or intensity 1, a point whose normal is (0, 0, 1), and the irradiance there."""

    name: str
    light: Light
    x: tuple[float, float, float]
    oracle: Decimal


def read_lights(path: Path = OWN) -> list[LightCase]:
    """The cases of a file."""
    entries = json.loads(path.read_text(encoding="utf-8"))
    return [LightCase(e["name"], _light(e["light"], e["args"]), tuple(e["x"]), Decimal(e["oracle"])) for e in entries]


def _light(name: str, args: list[Any]) -> Light:
    kind: Any = next(kind for kind in LIGHTS if kind.kind == name)
    if kind is MeshLight:
        corners, faces = (np.array(values).T for values in args)
        return MeshLight(Mesh(corners, faces), WHITE)
    made: Light = kind(*(tuple(a) if isinstance(a, list) else a for a in args), WHITE)
    return made


def light_rows(cases: Sequence[LightCase]) -> Outcome:
    """One row a case, in the columns of the stiff cases."""
    rows = []
    for case in cases:
        radiance, bounds = case.light.unshadowed(_white(case), False)
        value, bound = math.pi * float(radiance[0, 0]), float(bounds[0]) + ROUNDINGS
        rows.append(
            {
                "name": case.name,
                "kind": "E",
                "dtype": "float64",
                "form": case.light.kind,
                "value": value,
                "error_bound": bound,
                "oracle": str(case.oracle),
                "relative_error": relative_error(value, case.oracle),
                "bound_held": held(value, bound, case.oracle),
                "condition": None,
                "textbook_error": None,
                "mitsuba": None,
            }
        )
    return Outcome(rows)


def _white(case: LightCase) -> ShadingPoints:
    up, flags = column((0.0, 0.0, 1.0)), (np.full(1, -1), np.zeros(1, dtype=bool))
    return ShadingPoints(column(case.x), up, up, up, (Lambert,), {"diffuse": np.ones((3, 1))}, *flags)
