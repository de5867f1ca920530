"""`nusselt check --until-decided`: passes are added on both sides until a row is decided or the time is up.

The declared false-alarm rate holds at any number of looks (see `Level.at_time`): each adds a quarter of what is there,
or as much as the first. Its parts lie on disk, so that a run that was cut short goes on where it stopped.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

from nusselt.experiments.results.store import Store, key_of
from nusselt.experiments.verdict.evidence import Expectations
from nusselt.experiments.verdict.expected import rest, with_pixels
from nusselt.experiments.verdict.judge import judge
from nusselt.experiments.verdict.pooling import combine_images, combine_references
from nusselt.mitsuba_bridge.reference import Reference, ReferenceUnavailable, render_reference
from nusselt.mitsuba_bridge.tolerance import ray_tolerance
from nusselt.renderer.estimators import Estimator
from nusselt.renderer.image import Image, render
from nusselt.renderer.scene import Scene

from .check import MAX_SAMPLES, Answer, Progress, our_image, reference_target, seeds
from .draw import offset_asked
from .excuse import reconsidered
from .expectations import appearance, expectations_of, with_grains
from .question import Question
from .rows import head_of, row_of, row_without

FOLDER = "passes"
LOOKS = 64
"""A millionfold of the first look's samples."""


def share_of(look: int) -> float:
    """Samples of look 1, 2, ... over those of the first."""
    return 1.0 if look <= 5 else 1.25 ** (look - 5)


def time_of(look: int) -> float:
    """Samples of all looks so far over those of the first."""
    return sum(share_of(k) for k in range(1, look + 1))


class Sides:
    """Both sides of one row, a part for each look."""

    def __init__(
        self, scene: Scene, question: Question, folder: Path, executor: Executor | None, progress: Progress | None
    ) -> None:
        self.scene, self.question, self.executor, self.progress = scene, question, executor, progress
        self.estimator: Estimator = question.of(scene)
        asked = (question.seed, question.margin, question.shadow_origin, question.pixel_rule, question.tolerance)
        self.ours_on_disk = Store(folder / FOLDER / key_of("ours", scene.digest(), scene.name, self.estimator, *asked))
        self.bare = appearance(scene)
        self.reference_on_disk = Store(folder / FOLDER / key_of("reference", self.bare.digest(), *asked))
        self.ours: list[Image] = []
        self.references: list[Reference] = []
        self.seconds: dict[str, Any] = {"ours": 0.0, "reference": 0.0}

    @property
    def passes(self) -> int:
        return sum(image.pass_means.size for image in self.ours)

    def kept(self, look: int) -> bool:
        """Whether a look costs nothing, because all of it is on disk."""
        here = self.ours_on_disk.has(f"ours-{look}") or (look > 1 and self.passes == 1)
        return here and self.reference_on_disk.has(self._reference_name(look))

    def add(self, look: int) -> None:
        """One more part on each side; none of ours where nothing in it is random."""
        started = time.perf_counter()
        if look == 1 or self.passes > 1:
            self.ours.append(self.ours_on_disk.get(Image, f"ours-{look}", lambda: self._ours(look)))
        rendered = time.perf_counter()
        name = self._reference_name(look)
        self.references.append(self.reference_on_disk.get(Reference, name, lambda: self._reference(look)))
        self.seconds["ours"] += rendered - started
        self.seconds["reference"] += time.perf_counter() - rendered

    def _reference_name(self, look: int) -> str:
        return f"reference-{'exact' if self.passes == 1 else 'noisy'}-{look}"

    def _ours(self, look: int) -> Image:
        if look == 1:
            return our_image(self.scene, self.estimator, self.question, self.executor, self.progress)[0]
        offset = offset_asked(self.scene, self.question.shadow_origin)
        return render(
            self.scene,
            self.estimator,
            seed=seeds(self.question.seed, self.scene.name, self.estimator.name, f"look {look}")[1],
            passes=math.ceil(self.ours[0].pass_means.size * share_of(look)),
            executor=self.executor,
            tolerance=ray_tolerance(self.scene),
            offset=offset,
            by_light=True,
            progress=self._told("ours"),
        )

    def _reference(self, look: int) -> Reference:
        more = share_of(look)
        names = (self.bare.digest(), *((f"look {look}",) if look > 1 else ()))
        return render_reference(
            self.bare,
            seed=seeds(self.question.seed, *names)[2],
            target_relative_se=reference_target(self.question, self.passes) / more**0.5,
            max_samples=round(MAX_SAMPLES * more),
            timeout=self.question.timeout,
            progress=self._told("reference"),
        )

    def _told(self, stage: str) -> Callable[[int, int], None] | None:
        told = self.progress
        return None if told is None else lambda done, total: told(stage, done, total)


def check_until(
    scene: Scene,
    question: Question,
    *,
    command: str,
    folder: Path,
    budget: float,
    executor: Executor | None = None,
    progress: Progress | None = None,
    seen: Callable[[Answer], None] | None = None,
) -> Answer:
    """Check a scene, with more samples at each look, until it is decided.

    Parameters
    ----------
    folder : Path
        Where the parts are kept.
    budget : float
        Seconds after which no look is begun that is not on disk already.
    seen : callable, optional
        Called with every look's answer.
    """
    started = time.perf_counter()
    sides = Sides(scene, question, folder, executor, progress)
    first = seeds(question.seed, scene.name)[0]
    expectations = expectations_of(scene, sides.estimator, first, question.timeout, executor)
    answer: Answer | None = None
    look = 0
    while True:
        look += 1
        begun = time.perf_counter()
        try:
            sides.add(look)
        except ReferenceUnavailable as problem:
            if answer is not None:
                return answer  # what was had before has been judged
            ours = sides.ours[0]
            head = head_of(scene, sides.estimator, ours, sides.passes, question.margin, question.seed, command)
            return Answer(row_without(head, ours, problem, sides.seconds), ours, None, None)
        answer = _look(sides, question, expectations, look, command)
        if seen is not None:
            seen(answer)
        now = time.perf_counter()
        late = now - started + (now - begun) * share_of(look + 1) / share_of(look) > budget
        decided = answer.row["verdict"] != "undecided"
        if decided or look == LOOKS or (late and not sides.kept(look + 1)):
            return answer


def _look(sides: Sides, question: Question, expectations: Expectations, look: int, command: str) -> Answer:
    """Judge everything so far, at this look's share of the false-alarm rate."""
    ours, reference = combine_images(sides.ours), combine_references(sides.references)
    level, pixels = question.level.at_time(time_of(look)), sides.scene.pixels
    expectations = with_grains(expectations, sides.scene, sides.estimator, sides.passes, reference)
    known: dict[str, Any] = {"passes": sides.passes, "margin": question.margin, "level": rest(level, pixels)}
    verdict = judge(ours, reference, **known, expectations=expectations)
    seed = seeds(question.seed, sides.scene.name)[0]
    verdict = reconsidered(
        verdict, sides.scene, ours, reference, **known, expectations=expectations, seed=seed, executor=sides.executor
    )
    verdict = with_pixels(verdict, ours, sides.passes, pixels, level)
    head = head_of(sides.scene, sides.estimator, ours, sides.passes, question.margin, question.seed, command)
    seconds = sides.seconds | {"mitsuba": reference.seconds}
    return Answer(row_of(head, verdict, reference, seconds) | {"looks": look}, ours, reference, verdict)
