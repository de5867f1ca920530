"""How a renderer fails on a scene, and whether it still does: by a test whose errors are declared for all steps."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nusselt.experiments.external.program import ProgramFailed
from nusselt.experiments.metamorphic.ask import Asking, Pictures, put
from nusselt.experiments.metamorphic.by_method import beside_exact, steps_of
from nusselt.experiments.metamorphic.judge import Judged
from nusselt.experiments.metamorphic.relation import Images, Related, Shot
from nusselt.experiments.metamorphic.relations import RELATIONS
from nusselt.experiments.metamorphic.sources import EstimatorSource, Source
from nusselt.experiments.search.examine import stream
from nusselt.experiments.verdict.level import Level
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats
from nusselt.renderer.words import count

CRASHES, NOT_FINITE, BESIDE = "gives no image", "gives values that are not finite", "differs from ours"
STEPS = 2000
"""Scenes among which the false-alarm rate is divided: so many are tried at most."""
OURS = "area"


@dataclass(frozen=True)
class Beside:
    """A source and ours: the second image is ours, with seeds of its own."""

    theirs: Source
    ours: Source

    @property
    def name(self) -> str:
        return self.theirs.name

    @property
    def rounding(self) -> float:
        return self.theirs.rounding

    @property
    def knows(self) -> tuple[str, ...]:
        return self.theirs.knows

    def claim(self, scene: Scene) -> str:
        return self.theirs.claim(scene)

    def image(self, shot: Shot, seed: int) -> Floats:
        return (self.ours if shot.step else self.theirs).image(shot, seed)


def _first_two(images: Images) -> tuple[Floats, Floats]:
    return images[0], images[1]


@dataclass(frozen=True)
class Failure:
    """A way to fail.

    Parameters
    ----------
    manner : str
        `CRASHES`, `NOT_FINITE`, `BESIDE`, or the name of a relation.
    source : Source
    asking : Asking
        Its ``alpha`` is of all scenes tried together.
    """

    manner: str
    source: Source
    asking: Asking

    def judged(self, scene: Scene) -> Judged | None:
        """What is said of a scene; None where nothing can be."""
        try:
            if self.manner in (CRASHES, NOT_FINITE):
                return self._images(scene)
            if self.manner == BESIDE and (step := steps_of(self.source, [Shot(scene)])):
                image, level = self.source.image(Shot(scene), self.asking.seed + 1), Level(self.asking.alpha, STEPS)
                return beside_exact(scene, image, step[0], level, self.asking.margin)
            related, source = self._related(scene)
            if isinstance(related, str):
                return None
            level = Level(self.asking.alpha, STEPS)
            return put(Pictures(scene, source), related, self.asking, level)[0]
        except ProgramFailed as problem:
            return Judged("differs", str(problem), {}) if self.manner == CRASHES else None
        except InputError:
            return None

    def _images(self, scene: Scene) -> Judged:
        """Whether every seed gives an image, of numbers."""
        for seed in range(self.asking.seed + 1, self.asking.seed + 1 + self.asking.runs):
            wrong = int(np.count_nonzero(~np.isfinite(self.source.image(Shot(scene), seed))))
            if wrong and self.manner == NOT_FINITE:
                return Judged("differs", f"{count(wrong, 'value', 'is')} not finite with seed {seed}", {})
        return Judged("agrees", "", {})

    def _related(self, scene: Scene) -> tuple[Related | str, Source]:
        if self.manner == BESIDE:
            return Related(scene, (Shot(scene, step=1),), _first_two), Beside(self.source, EstimatorSource(OURS))
        relation = next(one for one in RELATIONS if one.name == self.manner)
        return relation.make(scene, stream(self.asking.seed, relation.name)), self.source

    def there(self, scene: Scene) -> bool:
        """Whether it fails: proven, not only likely."""
        judged = self.judged(scene)
        return judged is not None and judged.word == "differs"


def manner_of(
    scene: Scene, source: Source, asking: Asking, wanted: Sequence[str] = (), until: float = math.inf
) -> tuple[Failure | None, list[str]]:
    """The first way in which a renderer fails on a scene, and those before it of which nothing is known.

    No image, one not of numbers, another than ours, a broken relation; none is asked after a time of `time.monotonic`.
    """
    names = wanted or (
        CRASHES,
        NOT_FINITE,
        BESIDE,
        *(r.name for r in RELATIONS if not set(r.kinds) - set(source.knows)),
    )
    unknown: list[str] = []
    for name in names:
        failure = Failure(name, source, asking)
        judged = failure.judged(scene) if time.monotonic() < until else Judged("undecided", "", {})
        if judged is not None and judged.word == "differs":
            return failure, unknown
        if judged is not None and judged.word == "undecided":
            unknown.append(name)
    return None, unknown
