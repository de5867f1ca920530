"""Is there anything to judge? A black image beside a black reference shows nothing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.experiments.verdict.evidence import Evidence
from nusselt.experiments.verdict.rule import Finding


@dataclass(frozen=True)
class Light:
    """Objects where no pixel is shaded, or all that is shaded is black on both sides."""

    name: str = "light"
    share: float | None = None

    def __call__(self, evidence: Evidence, level: float) -> Finding:
        black = (evidence.reference_mean == 0) & ~evidence.ours.mean.any(axis=(1, 2))
        nothing = np.full(black.shape, evidence.place.size == 0)
        told = evidence.dark or "no light reaches what the camera sees"

        def say(k: int) -> str:
            if nothing[k]:
                return "nothing to judge: no pixel shows a surface that is no light"
            return f"nothing to judge: {told}" if black[k] else ""

        return Finding(evidence.nowhere, say, black | nothing)
