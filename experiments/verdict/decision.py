"""From what the rules find to one of three words, its reason, and what would decide."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Literal

from .rule import Finding

Word = Literal["agrees", "differs", "undecided"]
AS_CLAIMED: dict[str, bool | None] = {"agrees": True, "differs": False, "undecided": None}
"""Of what claims to be right: whether a word fits."""


def decide(findings: Iterable[Finding], k: int = 0) -> tuple[Word, str, float | None]:
    """The word for row k, its reason, and for `undecided` how many times the samples would decide (None: none would).

    What differs is said whatever speaks against the rest; of several objections the last is said.
    """
    findings = list(findings)
    failures = [finding.say(k) for finding in findings if finding.fails[k]]
    if failures:
        return "differs", "; ".join(failures), None
    for finding in reversed(findings):
        if finding.objects is not None and finding.objects[k]:
            more = math.inf if finding.more is None else float(finding.more[k])
            return "undecided", finding.say(k), more if math.isfinite(more) else None
    return "agrees", "; ".join(filter(None, (finding.say(k) for finding in findings))), None
