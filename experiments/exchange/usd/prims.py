"""A prim's attributes, at one time; what they must be."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.validation import Vec3
from nusselt.renderer.vectors import Floats

from .library import Usd, UsdGeom, UsdShade


@dataclass
class Notes:
    """What is to be said of a file, each sentence once, with the first prim that it is about."""

    lines: dict[str, str] = field(default_factory=dict)

    def say(self, prim: Prim, sentence: str) -> None:
        self.lines.setdefault(sentence, f"{prim.place}: {sentence}")


@dataclass(frozen=True)
class Prim:
    """A prim of a stage, and the file it is in."""

    usd: Any
    file: str

    @property
    def place(self) -> str:
        return f"{self.file}:{self.usd.GetPath()}"

    @property
    def kind(self) -> str:
        return str(self.usd.GetTypeName())

    def refused(self, value: object, accepted: str) -> InputError:
        """The error that refuses it."""
        return InputError(self.kind or "prim", value, accepted, self.place)

    def get(self, name: str, default: Any = None) -> Any:
        """An attribute at the earliest time that it has, or its default; constants that are connected to it count."""
        attribute = self._source(name)
        if not attribute:
            return default
        value = attribute.Get(Usd.TimeCode.EarliestTime())
        return default if value is None else value

    def _numbers(self, name: str, default: Any, count: int) -> Floats:
        value = self.get(name, default)
        try:
            numbers = np.array(value, dtype=np.float64)
        except (TypeError, ValueError):
            numbers = np.array(math.nan)
        if numbers.size != count or not np.isfinite(numbers).all():
            raise self.refused(f"{name} {value}", "a finite number" if count == 1 else f"{count} finite numbers")
        return numbers.ravel()

    def number(self, name: str, default: float) -> float:
        return float(self._numbers(name, default, 1)[0])

    def colour(self, name: str, default: Vec3) -> Vec3:
        r, g, b = self._numbers(name, default, 3).tolist()
        return r, g, b

    def _source(self, name: str) -> Any:
        """What gives an attribute its value: another's, where it is connected to one, directly or by others."""
        attribute = self.usd.GetAttribute(name)
        if not attribute or not attribute.HasAuthoredConnections() or not UsdShade.Input.IsInput(attribute):
            return attribute
        sources = UsdShade.Input(attribute).GetValueProducingAttributes()
        return sources[0] if sources else attribute

    def connected(self, name: str) -> bool:
        """Whether a shader's output gives an attribute its value, which is then no constant."""
        source = self._source(name)
        return bool(source and UsdShade.Output.IsOutput(source))

    def authored(self, name: str) -> bool:
        attribute = self.usd.GetAttribute(name)
        return bool(attribute and attribute.HasAuthoredValue())

    def matrix(self) -> Floats:
        """To the world (4, 4), for columns; USD's are for rows."""
        xform = UsdGeom.Xformable(self.usd).ComputeLocalToWorldTransform(Usd.TimeCode.EarliestTime())
        found = np.array(xform, dtype=np.float64).T
        if not np.isfinite(found).all() or (found[3] != (0, 0, 0, 1)).any():
            raise self.refused("a transform that is not affine", "an affine transform")
        if np.linalg.matrix_rank(found[:3, :3]) < 3:
            raise self.refused("a transform that flattens", "one that does not")
        return found
