"""The cross-check of a scene: every two renderers against each other, and each against the exact image."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from typing import Any

from nusselt.experiments.check.check import Progress
from nusselt.experiments.check.question import number_within
from nusselt.experiments.results.schema import Row
from nusselt.experiments.verdict.decision import AS_CLAIMED
from nusselt.experiments.verdict.level import Level
from nusselt.renderer.scene import Scene

from .arbiter import Arbiter, arbiter_of
from .clusters import Findings, Pairs, find_clusters
from .compare import Difference, difference
from .departures import Departure
from .entrant import Entrant
from .times.measure import Times
from .times.rows import time_rows


@dataclass(frozen=True)
class CrossQuestion:
    """What is asked.

    Parameters
    ----------
    margin : float
        Relative bias declared not to matter, in (0, 1].
    alpha : float
        Chance that any right renderer of the report is called ``differs``, in (0, 0.5].
    scenes : int
        In the report.
    """

    margin: float = 2e-4
    alpha: float = 1e-3
    scenes: int = 1

    def __post_init__(self) -> None:
        number_within("margin", self.margin, 0, 1)
        number_within("alpha", self.alpha, 0, 0.5)

    def level(self, entrants: int) -> Level:
        """Shared by every comparison of every scene."""
        return Level(self.alpha, self.scenes * max(entrants * (entrants + 1) // 2, 1))


@dataclass(frozen=True)
class Cross:
    """What came out of one scene.

    Parameters
    ----------
    exact : dict
        Each one's difference from the exact image, by name.
    pairs : mapping
        Of the first of two names from the second.
    missing : dict
        Why a renderer is not there, by name.
    departures : tuple of Departure
        What settings cost that are left at their defaults, where it was asked for.
    times : Times, optional
        Error against time, where it was asked for.
    """

    scene: Scene
    entrants: tuple[Entrant, ...]
    arbiter: Arbiter
    exact: dict[str, Difference]
    pairs: Pairs
    findings: Findings
    missing: dict[str, str] = field(default_factory=dict)
    departures: tuple[Departure, ...] = ()
    times: Times | None = None

    def rows(self, question: CrossQuestion, command: str) -> list[Row]:
        """A row for each renderer, each setting left, and each side of the times, as `results.json` has them."""
        rows = [_row(self, entrant, question, command) for entrant in self.entrants]
        rows += [departure.row(self.scene.name) for departure in self.departures]
        return rows + (time_rows(self.scene.name, self.times) if self.times else [])


def cross_check(
    scene: Scene,
    entrants: Sequence[Entrant],
    question: CrossQuestion,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Cross:
    """Compare renderers' images of a scene with the exact image and with each other."""
    arbiter = arbiter_of(scene, (entrant.rule for entrant in entrants), question.margin, executor, progress)
    level, contestants = question.level(len(entrants)), [arbiter.contestant(entrant) for entrant in entrants]
    judge, shaded, margin = arbiter.exact(), arbiter.shaded, question.margin
    exact = {one.name: difference(one, judge, shaded, margin, level) for one in contestants}
    pairs: dict[tuple[str, str], Difference] = {}
    for a, b in itertools.combinations(contestants, 2):
        pairs[a.name, b.name] = difference(a, b, shaded, margin, level)
        pairs[b.name, a.name] = pairs[a.name, b.name].turned()
    findings = find_clusters([entrant.name for entrant in entrants], pairs, exact)
    return Cross(scene, tuple(entrants), arbiter, exact, pairs, findings)


def _row(cross: Cross, entrant: Entrant, question: CrossQuestion, command: str) -> Row:
    found = cross.exact[entrant.name]
    others = {name: vars(pair) for (one, name), pair in cross.pairs.items() if one == entrant.name}
    settings: list[dict[str, Any]] = [dict(setting) for setting in entrant.about.get("settings", ())]
    return {
        "experiment": "cross",
        "scene": cross.scene.name,
        "estimator": entrant.name,
        "verdict": found.word,
        "as_claimed": AS_CLAIMED[found.word],
        "reason": found.reason,
        "bias_relative": found.bias,
        "bias_interval": list(found.interval),
        "bias_relative_standard_error": found.standard_error,
        "minimum_detectable_bias": found.finds,
        "rms_denoised_relative": found.rms,
        "rms_denoised_interval": list(found.rms_interval),
        "margin": found.margin,
        "passes": len(entrant.images),
        "samples": entrant.about.get("samples"),
        "command": command,
        "renderer_version": entrant.version,
        "pixel_rule": entrant.rule,
        "arbiter": cross.arbiter.said,
        "pairs": others,
        "settings": [{name: setting[name] for name in ("what", "used", "left")} for setting in settings],
    }
