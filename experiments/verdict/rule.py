"""What a rule of the verdict is, and what it finds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

from nusselt.renderer.vectors import Bools, Floats

from .evidence import Evidence


@dataclass(frozen=True)
class Finding:
    """What one rule says of b rows.

    Parameters
    ----------
    fails : (b,) bool
        The row differs.
    say : callable
        The sentence for row k; empty where there is nothing to say.
    objects : (b,) bool, optional
        The row cannot be decided.
    more : (b,) float64, optional
        How many times the samples would answer the objection; inf where no number would.
    figures : dict
        What is printed of it, by the name of the verdict's field: arrays (b, ...), NaN where there is none, or dicts
        of such; None for none at all.
    """

    fails: Bools
    say: Callable[[int], str]
    objects: Bools | None = None
    more: Floats | None = None
    figures: dict[str, Any] = field(default_factory=dict)


class Rule(Protocol):
    """A frozen dataclass with one call.

    Attributes
    ----------
    name : str
    share : float or None
        Its share of the family-wise false-alarm rate, in parts of the sum over all rules; None where it judges what
        has no noise, or never fails.
    """

    @property
    def name(self) -> str: ...

    @property
    def share(self) -> float | None: ...

    def __call__(self, evidence: Evidence, level: float) -> Finding:
        """Judge every row at this false-alarm rate, the rule's own share on one row."""
        ...
