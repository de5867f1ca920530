"""The main job: a scene in, a verdict out.

Our image is made in as many passes as bring its pooled noise below a share of the margin (sized by a pilot
whose data are then dropped: only its variance is looked at), Mitsuba's likewise; then the two are judged.
"""

from __future__ import annotations

import math
import time
import zlib
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np

from nusselt.experiments.verdict.expected import rest, with_pixels
from nusselt.experiments.verdict.judge import Verdict, judge
from nusselt.mitsuba_bridge.reference import Reference, ReferenceUnavailable, render_reference
from nusselt.mitsuba_bridge.tolerance import ray_tolerance
from nusselt.renderer.estimators import Estimator
from nusselt.renderer.image import Image, render
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene

from .draw import draw_area, offset_asked
from .excuse import reconsidered
from .expectations import Offsets, appearance, expectations_of, with_grains
from .question import Question
from .rows import head_of, row_of, row_without

ROOM = 8.0
"""The standard error of the difference is brought to the margin over this: 4.8 of them to the end of the
interval (31 degrees of freedom, a dozen rows), 3.2 for the estimate's own noise."""
PILOT, PILOT_SHARED = 2, 8
FEWEST, FEWEST_SHARED = 4, 32
"""Passes of the pilot, and at least; more where pixels share their light points: only whole passes count there."""
MAX_PASSES = 4096
DARK = 3.0
"""Standard errors within which a pilot's mean is that of a black image."""
MAX_SAMPLES = 1 << 16
"""Mitsuba's samples per pixel and light, at most."""

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Answer:
    """One row and the images behind it; images are None where the reference could not run."""

    row: dict[str, Any]
    ours: Image
    reference: Reference | None
    verdict: Verdict | None


def seeds(seed: int, *names: str) -> list[int]:
    """Three seeds (pilot, ours, reference) that depend on the names but not on any order."""
    root = np.random.SeedSequence([seed, *(zlib.crc32(name.encode()) for name in names)])
    return [int(state) for state in root.generate_state(3)]


class References:
    """References rendered in this run, so that variants of one scene share theirs."""

    def __init__(self) -> None:
        self._kept: dict[str, tuple[float, Reference]] = {}
        self.offsets: Offsets = {}

    def get(self, scene: Scene, question: Question, target: float, progress: Progress | None) -> Reference:
        """The reference of a scene, its relative standard error at ``target`` or below."""
        bare = appearance(scene)
        key = bare.digest()
        kept = self._kept.get(key)
        if kept is None or kept[0] > target:
            made = render_reference(
                bare,
                seed=seeds(question.seed, bare.digest())[2],
                target_relative_se=target,
                max_samples=MAX_SAMPLES,
                timeout=question.timeout,
                progress=None if progress is None else lambda done, total: progress("reference", done, total),
            )
            self._kept[key] = kept = (target, made)
        return kept[1]


def our_image(
    scene: Scene,
    estimator: Estimator,
    question: Question,
    executor: Executor | None,
    progress: Progress | None,
) -> tuple[Image, int, dict[str, Any]]:
    """Our image, its number of passes, and raw seconds."""
    needs = prepare(scene).needs
    pilot_seed, seed, _ = seeds(question.seed, scene.name, estimator.name)
    started = time.perf_counter()
    offset = offset_asked(scene, question.shadow_origin)
    tolerance = question.tolerance or question.margin / ROOM
    area = draw_area(scene, estimator, question.pixel_rule, tolerance, executor)
    if area is not None:
        return area.image, 1, {"pilot": 0.0, "ours": time.perf_counter() - started}
    passes = 1
    if scene.spp > 1 or estimator.is_random(needs):
        piloting, fewest = (PILOT_SHARED, FEWEST_SHARED) if estimator.shares_points else (PILOT, FEWEST)
        pilot = render(scene, estimator, seed=pilot_seed, passes=piloting, executor=executor)
        passes = _passes(pilot, question.margin / ROOM / math.sqrt(2), fewest)
        each = (time.perf_counter() - started) / piloting
        passes = max(fewest, min(passes, int(question.timeout / each)))
    piloted = time.perf_counter()
    image = render(
        scene,
        estimator,
        seed=seed,
        passes=passes,
        executor=executor,
        tolerance=ray_tolerance(scene),
        offset=offset,
        by_light=True,
        progress=None if progress is None else lambda done, total: progress("ours", done, total),
    )
    return image, passes, {"pilot": piloted - started, "ours": time.perf_counter() - piloted}


def _passes(pilot: Image, target: float, fewest: int) -> int:
    """Passes that bring the pooled relative standard error to the target."""
    shaded = pilot.shaded & np.isfinite(pilot.pixel_variance)
    mean = float(np.abs(pilot.mean).mean(axis=0)[shaded].mean()) if shaded.any() else 0.0
    if mean == 0:
        return PILOT
    noise = math.sqrt(float(pilot.pixel_variance[shaded].sum()) * pilot.clumping) / shaded.sum()
    if abs(float(pilot.mean.mean(axis=0)[shaded].mean())) < DARK * noise:
        return fewest  # black, as far as its noise tells: no number of passes brings that below a share of nothing
    one = noise / mean
    return min(max(fewest, math.ceil((one / target) ** 2)), MAX_PASSES)


def reference_target(question: Question, passes: int) -> float:
    """Its relative standard error: two noisy sides share the room, a single one has it to itself."""
    return question.margin / ROOM / (math.sqrt(2) if passes > 1 else 1)


def check(
    scene: Scene,
    question: Question,
    *,
    command: str,
    references: References,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Answer:
    """Render a scene on both sides and judge ours.

    Parameters
    ----------
    command : str
        The command that makes this row again.
    """
    estimator = question.of(scene)
    ours, passes, seconds = our_image(scene, estimator, question, executor, progress)
    head = head_of(scene, estimator, ours, passes, question.margin, question.seed, command)
    started = time.perf_counter()
    try:
        reference = references.get(scene, question, reference_target(question, passes), progress)
    except ReferenceUnavailable as problem:
        return Answer(row_without(head, ours, problem, seconds), ours, None, None)
    seconds = seconds | {"reference": time.perf_counter() - started, "mitsuba": reference.seconds}
    started = time.perf_counter()
    first = seeds(question.seed, scene.name)[0]
    expectations = expectations_of(scene, estimator, first, question.timeout, executor, references.offsets)
    expectations = with_grains(expectations, scene, estimator, passes, reference)
    seconds = seconds | {"expectations": time.perf_counter() - started}
    known: dict[str, Any] = {"passes": passes, "margin": question.margin, "level": rest(question.level, scene.pixels)}
    verdict = judge(ours, reference, **known, expectations=expectations)
    verdict = reconsidered(
        verdict, scene, ours, reference, **known, expectations=expectations, seed=first, executor=executor
    )
    verdict = with_pixels(verdict, ours, passes, scene.pixels, question.level)
    return Answer(row_of(head, verdict, reference, seconds), ours, reference, verdict)
