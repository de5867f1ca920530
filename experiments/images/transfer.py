"""From levels to radiance and back: the transfer curve, and what whole levels do to a noisy value.

A level is a bin of radiances. Its value is the mean of its bin, which is right on average where the noise fills
bins, and where it does not the mean of all that a pixel's noise can fall into is summed bin by bin:
E[q(X)] = q_0 + sum_k (q_k - q_(k-1)) P(X >= t_k), X normal, t_k the bins' edges in radiance. So truncation's offset
of half a level, rounding, noise-free pixels and the ends of the range are one formula, without a half level of slack.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import special

from nusselt.renderer.errors import InputError
from nusselt.renderer.vectors import Floats

from .formats import Raw

Rule = Literal["truncate", "round", "floor256"]
RULES: dict[Rule, str] = {
    "truncate": "truncated, int(255 x)",
    "round": "rounded to the nearest level",
    "floor256": "in equal bins, int(256 x)",
}
"""How levels are made of encoded values x in [0, 1], in words (of eight bits; of sixteen alike)."""
NEAR = 6
"""Bins summed on either side. A noise of more than half of that is blind to bins: exp(-2 pi^2 9) = 1e-77."""
REACH = 4.0
"""Standard deviations from the top of the range within which a pixel counts as saturated."""


@dataclass(frozen=True)
class Transfer:
    """A curve from radiance in [0, 1] to [0, 1].

    Parameters
    ----------
    name : str
        ``linear``, ``srgb`` (IEC 61966-2-1) or ``gamma:G``, whose curve is v^(1/G).
    """

    name: str = "linear"

    def __post_init__(self) -> None:
        if self.name not in ("linear", "srgb"):
            kind, _, number = self.name.partition(":")
            try:
                value = float(number)
            except ValueError:
                value = 0.0
            if kind != "gamma" or not 0.1 <= value <= 10:
                raise InputError("transfer", self.name, "linear, srgb or gamma:G with G from 0.1 to 10")

    @property
    def _exponent(self) -> float:
        return float(self.name.partition(":")[2])

    def decode(self, v: Floats) -> Floats:
        """Radiance of encoded values."""
        if self.name == "linear":
            return v
        if self.name == "srgb":
            return np.where(v <= 0.04045, v / 12.92, ((np.maximum(v, 0.04045) + 0.055) / 1.055) ** 2.4)
        return np.maximum(v, 0) ** self._exponent

    def encode(self, x: Floats) -> Floats:
        """Encoded values of radiance, which is clamped to [0, 1]."""
        x = np.clip(x, 0, 1)
        if self.name == "linear":
            return x
        if self.name == "srgb":
            return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 0.0031308) ** (1 / 2.4) - 0.055)
        return np.asarray(x ** (1 / self._exponent))


@dataclass(frozen=True)
class Quantiser:
    """Whole levels 0 to ``top`` behind a transfer curve; ``top`` 0 is radiance as it is.

    Parameters
    ----------
    top : int
        255, 65535 or 0.
    transfer : Transfer
    rule : {"truncate", "round", "floor256"}
    """

    top: int
    transfer: Transfer
    rule: Rule

    @cached_property
    def edges(self) -> Floats:
        """Radiance (top,) from which each level k = 1 ... top is given."""
        k = np.arange(1, self.top + 1)
        from_ = {"truncate": k / self.top, "round": (k - 0.5) / self.top, "floor256": k / (self.top + 1)}
        return self.transfer.decode(from_[self.rule])

    @cached_property
    def values(self) -> Floats:
        """Radiance (top + 1,) each level stands for: the mean of its bin; the highest stands for 1."""
        edges = np.concatenate(([0.0], self.edges))
        return np.append((edges[1:] + edges[:-1]) / 2, 1.0)

    def decode(self, raw: Raw) -> Floats:
        """Radiance (3, h, w) of what a file holds."""
        if not self.top:
            return np.asarray(raw.values, dtype=np.float64)
        return self.values[raw.values]

    def expected(self, mean: Floats, deviation: Floats) -> Floats:
        """E of the decoded value of a normal X with this mean and standard deviation, elementwise."""
        if not self.top:
            return mean
        edges, values = self.edges, self.values
        level = np.searchsorted(edges, mean, side="right")  # of the mean itself
        width = np.diff(values)[np.minimum(level, self.top - 1)]
        out = np.where(deviation > NEAR / 2 * width, np.clip(mean, 0, 1), values[level])
        some = np.nonzero((deviation > 0) & (deviation <= NEAR / 2 * width))
        out[some] = self._summed(mean[some], deviation[some], level[some])
        return np.asarray(out)

    def _summed(self, mean: Floats, deviation: Floats, level: NDArray[np.intp]) -> Floats:
        edges, values = self.edges, self.values
        steps = np.diff(values)
        low = np.maximum(level - NEAR, 0)
        total = values[low]
        for k in range(2 * NEAR):
            bin_ = np.minimum(low + k, self.top - 1)
            passed = special.ndtr((mean - edges[bin_]) / deviation)
            total = total + np.where(low + k < self.top, steps[bin_] * passed, 0.0)
        return np.asarray(total)

    def saturated(self, mean: Floats, deviation: Floats) -> NDArray[np.bool_]:
        """Where a level can be cut off at the top, elementwise bool; radiance is never cut off at 0."""
        if not self.top:
            return np.zeros(mean.shape, dtype=bool)
        return np.asarray(mean + REACH * deviation >= self.edges[-1])

    def spread(self, mean: Floats) -> Floats:
        """Variance that whole levels add where noise fills them: width^2 / 12."""
        if not self.top:
            return np.zeros_like(mean)
        steps = np.diff(self.values)
        return np.asarray(steps[np.clip(np.searchsorted(self.edges, mean), 0, self.top - 1)] ** 2 / 12)
