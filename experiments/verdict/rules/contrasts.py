"""Is it right beyond the mean? What cancels in it: chequers, odd rows or columns, gradients across the image."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nusselt.experiments.verdict.evidence import ROUNDING, Evidence
from nusselt.experiments.verdict.intervals import average, weighted_bias
from nusselt.experiments.verdict.rule import Finding
from nusselt.renderer.vectors import Floats

from .mean import POWER

PATTERNS: dict[str, Callable[[Floats, Floats, int, int], Floats]] = {
    "chequered": lambda row, column, height, width: 1 - 2 * ((row + column) % 2),
    "odd and even rows": lambda row, column, height, width: 1 - 2 * (row % 2),
    "odd and even columns": lambda row, column, height, width: 1 - 2 * (column % 2),
    "from top to bottom": lambda row, column, height, width: 2 * row / max(height - 1, 1) - 1,
    "from left to right": lambda row, column, height, width: 2 * column / max(width - 1, 1) - 1,
}
"""Weights, at most 1 in size, of the pixel in a row and column."""


@dataclass(frozen=True)
class Contrasts:
    """Fails where the difference times a pattern has a mean beyond the margin, and beyond the reference's own.

    Where pixels share their light points a contrast's noise is not known: then nothing fails.
    """

    name: str = "contrasts"
    share: float = 1.0

    def __call__(self, evidence: Evidence, level: float) -> Finding:
        if evidence.shares_points or not evidence.place.size:
            return Finding(evidence.nowhere, lambda k: "", figures={"finds_contrast": None})
        height, width = evidence.shape
        row, column = np.divmod(evidence.place, width)
        found, finds = {}, []
        for name, pattern in PATTERNS.items():
            weights = pattern(row, column, height, width)
            bias = weighted_bias(evidence.ours, evidence.reference, weights)
            reach = bias.half_width(level / len(PATTERNS)) / evidence.scale
            offset = evidence.offset * weights
            own = np.abs(average(offset)) + 2 * np.sqrt(average(offset**2) / max(weights.size, 1))
            allowed = evidence.margin + ROUNDING + own / evidence.scale
            size = bias.value / evidence.scale
            found[name] = (np.abs(size) - reach > allowed, size)
            finds.append(allowed + reach + bias.reserve(POWER) / evidence.scale)

        def say(k: int) -> str:
            off = ((name, size[k]) for name, (fails, size) in found.items() if fails[k])
            return "; ".join(f"the difference is {name}: {size:+.2%}" for name, size in off)

        fails = np.any([failing for failing, _ in found.values()], axis=0)
        return Finding(fails, say, figures={"finds_contrast": np.max(finds, axis=0)})
