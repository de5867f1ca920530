"""The declared false-alarm rate, divided among the rules, and the rules run at it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from scipy import special

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

    def at_time(self, time: float) -> Level:
        """The level of a look at ``time`` times the samples of the first look, alpha in all at any number of looks.

        The boundary of Robbins's normal mixture (1970; Howard et al. 2021): a sum of variance t stays within
        sqrt((t + r) ln((t + r) / (r alpha^2))) for ever with probability 1 - alpha. Its r makes the first look cheap.
        """
        alpha = self.alpha / self.rows / len(RULES)  # about what a rule has: r hardly matters
        r = 1 / (2 * math.log(1 / alpha) + math.log(1 + 2 * math.log(1 / alpha)))

        def boundary(alpha: float) -> float:
            return math.sqrt((1 + r / time) * (math.log((time + r) / r) - 2 * math.log(alpha)))

        spent = 2 * float(special.ndtr(-boundary(alpha))) / alpha
        return Level(self.alpha * min(spent, 1.0), self.rows)


def findings(evidence: Evidence, level: Level) -> dict[str, Finding]:
    """What every rule says of every row, by the rule's name."""
    return {rule.name: rule(evidence, level.of(rule)) for rule in RULES}
