"""One scene of a hunt: its images, made before anything is known of the truth, and what is wrong with them."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice

import numpy as np

from nusselt.experiments.check.estimators import noise_free
from nusselt.experiments.check.excuse import RULE, own_error
from nusselt.experiments.check.question import Question
from nusselt.experiments.check.references import KeptReferences
from nusselt.experiments.external.comparison import Comparison
from nusselt.experiments.external.judge import External, Judging, judge_images
from nusselt.experiments.external.program import ProgramFailed
from nusselt.experiments.metamorphic.ask import Asking, is_still, related_of
from nusselt.experiments.metamorphic.by_method import beside_exact, judge_by_method, steps_of
from nusselt.experiments.metamorphic.judge import judge_relation
from nusselt.experiments.metamorphic.relation import Related, Relation, Shot
from nusselt.experiments.metamorphic.relations import RELATIONS
from nusselt.experiments.metamorphic.sources import MitsubaSource, Source
from nusselt.experiments.reduce.failure import BESIDE, CRASHES, NOT_FINITE
from nusselt.experiments.search.examine import stream
from nusselt.experiments.verdict.level import Level
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats

RELATING = 2
"""Of a scene, by chance: other scenes try the others."""
KNOWN = "differs by a rule of its own"
"""As far as that rule, which is known, explains."""


@dataclass(frozen=True)
class Failing:
    """How a scene fails.

    ``manner`` is `CRASHES`, `NOT_FINITE`, `BESIDE`, `KNOWN` or a relation's name; ``names`` mistakes that it looks
    like, a relation, a rule, or a program's last words; ``hint`` says what to look for.
    """

    manner: str
    reason: str
    names: tuple[str, ...] = ()
    hint: str = ""


@dataclass(frozen=True, eq=False)
class Shots:
    """Images (3, h, w) float32 of a scene: for every seed its own, then every relation's; why there are no more.

    ``steps``: of one seed, what a method without noise may be off by.
    """

    passes: list[list[Floats]]
    failure: Failing | None = None
    steps: tuple[Floats, ...] = ()

    @property
    def digest(self) -> str:
        """Of every value, and of how it failed."""
        told = hashlib.sha256((self.failure.manner if self.failure else "").encode())
        for image in (image for each in (*self.passes, self.steps) for image in each):
            told.update(np.ascontiguousarray(image, dtype="<f4").tobytes())
        return told.hexdigest()


@dataclass(frozen=True)
class Trial:
    """A scene before a renderer.

    ``asking.alpha`` is of ``rows`` questions; ``relating`` relations are asked; ``diagnosing``: names looked for.
    """

    scene: Scene
    source: Source
    asking: Asking
    rows: int
    relating: int = RELATING
    diagnosing: bool = True

    @cached_property
    def relations(self) -> list[tuple[Relation, Related]]:
        """Some that ask for one image more, no larger than the scene's."""
        order = stream(self.asking.seed, f"relations {self.scene.name}").permutation(len(RELATIONS))
        made = ((RELATIONS[k], related_of(RELATIONS[k], self.scene, self.source, self.asking)) for k in order)
        cheap = ((one, related) for one, related in made if isinstance(related, Related) and _is_cheap(related))
        return list(islice(cheap, self.relating))

    def shots(self) -> Shots:
        """All images, by a renderer that may fail."""
        wanted = [Shot(self.scene), *(shot for _, related in self.relations for shot in related.shots)]
        passes: list[list[Floats]] = []
        for seed in range(self.asking.seed + 1, self.asking.seed + 1 + self.asking.runs):
            passes.append([])
            for shot in wanted:
                try:
                    passes[-1].append(self.source.image(shot, seed).astype(np.float32))
                except ProgramFailed as problem:
                    words = " ".join(word for word in str(problem).split(" (seed ")[0].split() if word.isalpha())
                    return Shots(passes, Failing(CRASHES, str(problem), (words,)))
        return Shots(passes, steps=tuple(steps_of(self.source, wanted)))

    def judged(self, shots: Shots) -> tuple[str, Failing | None]:
        """The verdict in a word, and how it fails; an image that differs breaks relations too: they are not asked."""
        if shots.failure is not None:
            return "differs", shots.failure
        if not all(np.isfinite(each[0]).all() for each in shots.passes):
            return "differs", Failing(NOT_FINITE, "an image has values that are no numbers")
        word, failing = "undecided", None
        if self.source.claim(self.scene) not in ("unbiased", "exact"):
            return word, failing  # what is claimed to be biased may differ
        if noise_free(self.scene) is not None:  # else relations alone are asked
            one = self._beside_exact if not shots.steps else self._by_method
            word, failing = one(shots)
        return (word, failing) if failing else next(self._broken(shots), (word, None))

    def _by_method(self, shots: Shots) -> tuple[str, Failing | None]:
        level, image = Level(self.asking.alpha, self.rows), shots.passes[0][0].astype(float)
        judged = beside_exact(self.scene, image, shots.steps[0], level, self.asking.margin)
        word = judged.word if judged else "undecided"
        return word, Failing(BESIDE, judged.reason) if judged and word == "differs" else None

    def _beside_exact(self, shots: Shots) -> tuple[str, Failing | None]:
        asked, images = self.asking, [each[0].transpose(1, 2, 0).astype(float) for each in shots.passes]
        question = Question(
            estimator="area",
            margin=asked.margin,
            seed=asked.seed,
            pixel_rule="area" if self.scene.spp > 1 else None,
            level=Level(asked.alpha, self.rows),
        )
        judging = Judging(question, External(), "", KeptReferences(None, None), diagnose=self.diagnosing)
        found = judge_images(self.scene, images, judging)
        row = found.row
        if row["verdict"] != "differs":
            return row["verdict"], None
        if explained := self._explained(found, images, replace(judging, diagnose=False)):
            return "differs", explained
        mistakes = row["likely_mistakes"]
        hint = f"{mistakes[0]['detail']}; {mistakes[0]['hint']}" if mistakes else "; ".join(row["where"])
        return "differs", Failing(BESIDE, row["reason"], tuple(one["name"] for one in mistakes), hint)

    def _explained(self, found: Comparison, images: list[Floats], judging: Judging) -> Failing | None:
        """What images (h, w, 3) that differ fail by if Mitsuba's own rule is all that it takes."""
        if not isinstance(self.source, MitsubaSource):
            return None
        known = own_error(self.scene, self.asking.seed)
        if known is None:
            return None
        truth, shaded = found.truth.reference.mean, found.sides.image.shaded
        difference = np.mean(images, axis=0).transpose(2, 0, 1) - truth
        explained = np.where(shaded, difference - known.left(difference), 0.0).transpose(1, 2, 0)
        if judge_images(self.scene, [image - explained for image in images], judging).row["verdict"] == "differs":
            return None
        return Failing(KNOWN, known.said(truth, shaded, found.row["reason"]), (RULE,))

    def _broken(self, shots: Shots) -> Iterator[tuple[str, Failing]]:
        """Relations that do not hold."""
        for number, (relation, related) in enumerate(self.relations, 1):
            images = [[made[0].astype(float), made[number].astype(float)] for made in shots.passes]
            known = replace(related, still=is_still(related, self.source))
            level, margin = Level(self.asking.alpha, self.rows), self.asking.margin
            if shots.steps:
                judged = judge_by_method(known, images[0], [shots.steps[0], shots.steps[number]], level, margin)
            else:
                judged = judge_relation(known, images, level, margin, self.source.rounding)
            if judged.word == "differs":
                yield "differs", Failing(relation.name, judged.reason, (relation.name,), relation.likely)


def _is_cheap(related: Related) -> bool:
    of, shots = related.of, related.shots
    return len(shots) == 1 and shots[0].more == 1 and shots[0].scene.width <= max(of.width, of.height)
