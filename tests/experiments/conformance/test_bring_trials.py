"""The trials of an estimator: each kind of wrong one fails the trial that is for it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

from nusselt.experiments.conformance import trials
from nusselt.renderer.estimators import Area


@dataclass(frozen=True, kw_only=True)
class Dim(Area):
    name: ClassVar[str] = "dim"

    def __call__(self, points, source, rng):
        return 0.97 * super().__call__(points, source, rng)


@dataclass(frozen=True, kw_only=True)
class NoShadows(Area):
    name: ClassVar[str] = "no-shadows"

    def __call__(self, points, source, rng):
        from dataclasses import replace

        from nusselt.renderer.visibility.segments import Blockers

        nothing = Blockers.nothing(source.blockers.geometry)
        return super().__call__(points, replace(source, blockers=nothing), rng)


@dataclass(frozen=True, kw_only=True)
class OwnRandomness(Area):
    name: ClassVar[str] = "own-randomness"

    def __call__(self, points, source, rng):
        return super().__call__(points, source, np.random.default_rng())


@dataclass(frozen=True, kw_only=True)
class FewSamples(Area):
    name: ClassVar[str] = "few-samples"

    def _block(self, points, source, rng, samples):
        return Area(samples=1)._block(points, source, rng, 1)


@dataclass(frozen=True, kw_only=True)
class OnePattern(Area):
    name: ClassVar[str] = "one-pattern"

    def _block(self, points, source, rng, samples):
        scale = 1 + 0.2 * rng.standard_normal()
        return scale * super()._block(points, source, rng, samples)


@dataclass(frozen=True, kw_only=True)
class OneStream(Area):
    """Passes that share what they draw with the next."""

    name: ClassVar[str] = "one-stream"
    shares_points: ClassVar[bool] = True
    last: ClassVar[float] = 0.0

    def __call__(self, points, source, rng):
        type(self).last = 0.9 * self.last + rng.standard_normal()
        return (1 + 0.1 * self.last) * super().__call__(points, source, rng)


@pytest.mark.parametrize(
    ("kind", "trial"),
    [
        (OwnRandomness, trials.protocol),
        (Dim, trials.oracles),
        (NoShadows, trials.planted_scenes),
        (FewSamples, trials.convergence),
        (OnePattern, trials.independence),
        (OneStream, trials.independence),
    ],
)
def test_each_wrong_one_fails(kind, trial):
    outcome = trials.run_trial(trial, kind)
    assert not outcome.passed
    assert outcome.found
