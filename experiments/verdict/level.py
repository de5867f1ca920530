"""The declared false-alarm rate, divided among the rules, and the rules run at it."""

from __future__ import annotations

from dataclasses import dataclass

from .evidence import Evidence
from .rule import Finding, Rule
from .rules import RULES


@dataclass(frozen=True)
class Level:
    """The declared false-alarm rate, split by Bonferroni: intervals exist before any p-value does.

    Parameters
    ----------
    alpha : float
        Of the whole report: the chance that any correct row is called ``differs``.
    rows : int
        Rows in the report.
    """

    alpha: float = 1e-3
    rows: int = 1

    def of(self, rule: Rule) -> float:
        """What one rule may spend on one row."""
        return self.alpha / self.rows * (rule.share or 0.0) / sum(other.share or 0.0 for other in RULES)

    def at_look(self, number: int) -> Level:
        """The share of look 1, 2, ... at a growing number of samples: alpha/(k (k+1)), alpha in all."""
        return Level(self.alpha / (number * (number + 1)), self.rows)


def findings(evidence: Evidence, level: Level) -> dict[str, Finding]:
    """What every rule says of every row, by the rule's name."""
    return {rule.name: rule(evidence, level.of(rule)) for rule in RULES}
