"""What is asked of a scene's sensors."""

from __future__ import annotations

import math
from dataclasses import dataclass

from nusselt.experiments.check.question import MOST_SEED, number_within, whole_within
from nusselt.renderer.estimators import Estimator


@dataclass(frozen=True)
class SensorQuestion:
    """What is asked of a scene's sensors.

    Parameters
    ----------
    estimator : str or class, optional
        Ours; the exact one unless said.
    samples, stratified
        As in `nusselt.experiments.check.question.Question`.
    margin : float
        Relative difference from Mitsuba that does not matter.
    alpha : float
        Chance that any right sensor of the scene is called different.
    seed : int
    timeout : float
        Seconds for each side.
    mitsuba : bool
        Whether Mitsuba is asked.

    Raises
    ------
    InputError
    """

    estimator: str | type[Estimator] | None = "exact"
    samples: int | None = None
    stratified: bool | None = None
    margin: float = 1e-3
    alpha: float = 1e-3
    seed: int = 0
    timeout: float = 600.0
    mitsuba: bool = True

    def __post_init__(self) -> None:
        number_within("margin", self.margin, 0, 1)
        number_within("alpha", self.alpha, 0, 1)
        number_within("timeout", self.timeout, 0, math.inf)
        whole_within("seed", self.seed, 0, MOST_SEED)
