"""The rules of the verdict, each listed once: `judge` and the calibration run this tuple.

To add one: a file here with a frozen dataclass as in `..rule`, and its place in the tuple. `Level` gives it its
share, its sentence reaches the verdict's reason, and the calibration measures it. Only a figure that is to be
printed by itself asks for a field of `judge.Verdict` too.

Failures are said in this order; of several objections the last, so that what no number of samples answers stands last.
"""

from __future__ import annotations

from nusselt.experiments.verdict.rule import Rule

from .channels import Channels
from .contrasts import Contrasts
from .independence import Independence
from .light import Light
from .mean import Mean
from .noise_free import NoiseFree
from .normality import Normality
from .pass_spread import PassSpread
from .pixels import Pixels
from .residual import Residual
from .tiles import Tiles
from .variance_ratio import VarianceRatio

MEAN = Mean()
"""The one that decides what the others let pass."""

RULES: tuple[Rule, ...] = (
    *(MEAN, Tiles(), Pixels(), Contrasts(), Residual(), VarianceRatio(), PassSpread(), Independence(), Channels()),
    *(Normality(), NoiseFree(), Light()),
)
