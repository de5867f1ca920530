"""From scenes that fail to distinct causes: what known ones do not explain is made small, and named.

Two failures are taken for one cause where they fail in the same manner, one's smallest scene holds all that the
other's does, and both have a name in common, or one has none; what a rule explains that is known, by its name alone. A
scene that holds what a known cause needs counts as its, unless it fails without that too. A cause that shows in every
scene may hide others.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from nusselt.experiments.metamorphic.ask import Asking
from nusselt.experiments.metamorphic.judge import Judged
from nusselt.experiments.reduce.failure import BESIDE, STEPS, Failure
from nusselt.experiments.reduce.reduce import Trials, reduced
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene

from .scenes import held, without
from .trial import KNOWN, Failing, Trial

SECONDS = 120.0
"""Of one scene's reduction, at most."""


@dataclass(frozen=True)
class BesideExact(Failure):
    """Another image than the exact one."""

    def judged(self, scene: Scene) -> Judged | None:
        """What is said of a scene; None where nothing can be."""
        trial = Trial(scene, self.source, self.asking, STEPS, relating=0, diagnosing=False)
        try:
            word, failing = trial.judged(trial.shots())
        except InputError:
            return None
        wrong = failing is not None and failing.manner == self.manner
        return Judged("differs" if wrong else "undecided", failing.reason if failing else word, {})


@dataclass(frozen=True)
class Cause:
    """A distinct way to fail.

    ``scene`` is the smallest, and holds ``needs``; not ``shown`` at the stricter level of reductions it is as
    it was drawn. ``seen`` are the scenes that were put down to it.
    """

    failing: Failing
    needs: tuple[str, ...]
    scene: Scene
    shown: bool
    seen: tuple[str, ...]

    def is_like(self, other: Cause) -> bool:
        """Whether both are taken for one."""
        one, two = set(self.needs), set(other.needs)
        names = [set(cause.failing.names) for cause in (self, other)]
        named = names[0] & names[1] or not all(names)
        alike = self.failing.manner == KNOWN or one <= two or two <= one
        return self.failing.manner == other.failing.manner and bool(named) and alike


@dataclass
class Causes:
    """All that are known, and what finds more; ``asking`` is of reductions, ``until`` of `time.monotonic`."""

    trial: Callable[[Scene], Trial]
    asking: Asking
    until: float = math.inf
    known: list[Cause] = field(default_factory=list)

    def explain(self, scene: Scene, failing: Failing) -> None:
        """Put a failure down to a known cause, or find its own."""
        number, left, now = self._explained(scene, failing)
        if number is None:
            self._add(self._smallest(left, now, scene.name))
        else:
            self.known[number] = replace(self.known[number], seen=(*self.known[number].seen, scene.name))

    def _explained(self, scene: Scene, failing: Failing) -> tuple[int | None, Scene, Failing]:
        """The known cause that explains a failure; or what still fails when all that they need is taken out."""
        left, now = scene, failing
        for number, cause in enumerate(self.known):
            if cause.failing.manner == now.manner == KNOWN and set(cause.failing.names) == set(now.names):
                return number, scene, failing
            if cause.failing.manner != now.manner or not set(cause.needs) <= set(held(left)):
                continue
            less = next((less for name in cause.needs if (less := without(left, name)) is not None), None)
            rest = None if less is None else self._fails(less)
            rest = None if rest is not None and rest.manner == KNOWN else rest
            if set(now.names) & set(cause.failing.names) or (rest is None and (less is not None or not now.names)):
                return number, scene, failing
            if less is not None and rest is not None:
                left, now = less, rest
        return None, left, now

    def _fails(self, scene: Scene) -> Failing | None:
        try:
            trial = self.trial(scene)
            return trial.judged(trial.shots())[1]
        except InputError:
            return None

    def _smallest(self, scene: Scene, failing: Failing, name: str) -> Cause:
        """The scene made small, and what it looks like at the size it was drawn in, where it still fails so."""
        kind = BesideExact if failing.manner in (BESIDE, KNOWN) else Failure
        failure = kind(failing.manner, self.trial(scene).source, self.asking)
        shown = failure.there(scene)
        small = reduced(scene, Trials(failure, min(self.until, time.monotonic() + SECONDS))) if shown else scene
        size = {"width": scene.width, "height": scene.height, "light_samples": scene.light_samples}
        again = self._fails(small.with_(**size, stratify=scene.stratify)) if shown else None
        same = again is not None and again.manner == failing.manner
        return Cause(again if same and again else failing, held(small), small, shown, (name,))

    def _add(self, cause: Cause) -> None:
        for number, other in enumerate(self.known):
            if cause.is_like(other):
                best = min(other, cause, key=lambda one: (not one.shown, not one.failing.names, len(one.needs)))
                self.known[number] = replace(best, seen=(*other.seen, *cause.seen))
                return
        self.known.append(cause)
