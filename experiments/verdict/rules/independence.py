"""Is the noise of one pixel that of another? Pixels that share samples, filters, tiles of numbers used again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.experiments.verdict.alike import Alike
from nusselt.experiments.verdict.evidence import Evidence
from nusselt.experiments.verdict.rule import Finding


@dataclass(frozen=True)
class Independence:
    """Fails where pixels that are claimed to be independent have noise in common; else says so.

    It looks at one pass less the mean of all, in which what is wrong with the limit cancels: one image tells nothing.
    """

    name: str = "independence"
    share: float = 1.0

    def __call__(self, evidence: Evidence, level: float) -> Finding:
        found = [Alike.of(field, level) for field in evidence.noise] if evidence.noise is not None else []
        if evidence.shares_points or not found:
            return Finding(evidence.nowhere, lambda k: "", figures={"noise_alike": None})
        alike = np.array([one.correlation for one in found])
        return Finding(
            (alike > 0) & evidence.claims_variance,
            lambda k: found[k].said,
            figures={"noise_alike": np.where(alike > 0, alike, np.nan)},
        )
