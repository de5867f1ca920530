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
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mitsuba_bridge.reference import GlossyNeedsLLVM, Reference, ReferenceUnavailable, render_reference
from mitsuba_bridge.tolerance import ray_tolerance
from renderer.estimators import Claim, Estimator, estimator_named
from renderer.image import Image, prepare, render
from renderer.needs import LeftOut, Needs
from renderer.scene import Scene

from .statistics import Level
from .verdict import Verdict, judge, pixel_counts

ROOM = 8.0
"""The standard error of the difference is brought to the margin over this: 4.8 of them to the end of the
interval (31 degrees of freedom, a dozen rows), 3.2 for the estimate's own noise."""
PILOT = 2
PILOT_COMMON = 8
"""For estimators whose pixels share their light points."""
MAX_PASSES = 4096
MAX_SAMPLES = 1 << 16
"""Mitsuba's samples per pixel and light, at most."""

Progress = Callable[[str, int, int], None]


def chosen_estimator(scene: Scene, name: str | None, samples: int | None, stratified: bool | None) -> Estimator:
    """What the user asks for, and for the rest what the scene does."""
    name = name or {"analyticdirect": "analytic", "direct": "area"}[scene.integrator]
    strata = scene.stratify if stratified is None else stratified
    return estimator_named(name, samples or scene.light_samples, strata)


@dataclass(frozen=True)
class Question:
    """What is asked of every scene.

    Parameters
    ----------
    estimator : str or None
        None: the one the scene's integrator names.
    samples : int or None
        Per light; None: the scene's.
    stratified : bool or None
        None: the scene's.
    margin : float
        Relative bias declared not to matter.
    seed : int
    level : Level
    timeout : float
        Seconds the reference may take.
    """

    estimator: str | None = None
    samples: int | None = None
    stratified: bool | None = None
    margin: float = 1e-3
    seed: int = 0
    level: Level = field(default_factory=Level)
    timeout: float = 600.0

    def of(self, scene: Scene) -> Estimator:
        """The estimator to use on a scene."""
        return chosen_estimator(scene, self.estimator, self.samples, self.stratified)


@dataclass(frozen=True)
class Answer:
    """One row and the images behind it; images are None where the reference could not run."""

    row: dict[str, Any]
    ours: Image
    reference: Reference | None
    verdict: Verdict | None

    def _repr_html_(self) -> str:
        from .notebook import answer_html

        return answer_html(self)


def seeds(seed: int, *names: str) -> list[int]:
    """Three seeds (pilot, ours, reference) that depend on the names but not on any order."""
    root = np.random.SeedSequence([seed, *(zlib.crc32(name.encode()) for name in names)])
    return [int(state) for state in root.generate_state(3)]


def appearance(scene: Scene) -> Scene:
    """The scene without what only our estimators read: scenes that look alike share a reference."""
    return scene.with_(integrator="direct", light_samples=1, stratify=False, name="", output="", warnings=())


class References:
    """References rendered in this run, so that variants of one scene share theirs."""

    def __init__(self) -> None:
        self._kept: dict[str, tuple[float, Reference]] = {}

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
    _, needs = prepare(scene)
    pilot_seed, seed, _ = seeds(question.seed, scene.name, estimator.name)
    started = time.perf_counter()
    passes = 1
    if scene.spp > 1 or estimator.is_random(needs):
        common = getattr(estimator, "common", False)
        pilot = render(scene, estimator, seed=pilot_seed, passes=PILOT_COMMON if common else PILOT, executor=executor)
        passes = _passes(pilot, question.margin / ROOM / math.sqrt(2))
    piloted = time.perf_counter()
    image = render(
        scene,
        estimator,
        seed=seed,
        passes=passes,
        executor=executor,
        tolerance=ray_tolerance(scene),
        progress=None if progress is None else lambda done, total: progress("ours", done, total),
    )
    return image, passes, {"pilot": piloted - started, "ours": time.perf_counter() - piloted}


def _passes(pilot: Image, target: float) -> int:
    """Passes that bring the pooled relative standard error to the target."""
    shaded = pilot.shaded & np.isfinite(pilot.pixel_variance)
    mean = float(np.abs(pilot.mean).mean(axis=0)[shaded].mean()) if shaded.any() else 0.0
    if mean == 0:
        return PILOT
    one = math.sqrt(float(pilot.pixel_variance[shaded].sum()) * pilot.clumping) / shaded.sum() / mean
    fewest = 4 if pilot.clumping == 1 else 32  # the clumping is known from the passes alone
    return min(max(fewest, math.ceil((one / target) ** 2)), MAX_PASSES)


def as_claimed(claim: Claim, verdict: str, non_finite: int) -> bool | None:
    """Whether a verdict fits what the estimator says of itself; None where it is undecided.

    An estimator that admits a bias may show it. None may give a pixel that is not finite.
    """
    if non_finite:
        return False
    if claim == "biased":
        return True
    return {"agrees": True, "differs": False, "undecided": None}[verdict]


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
    _, needs = prepare(scene)
    ours, passes, seconds = our_image(scene, estimator, question, executor, progress)
    head = {
        "scene": scene.name,
        "estimator": estimator.name,
        "claim": estimator.claim(needs),
        "samples": estimator.samples,
        "stratified": estimator.stratified,
        "passes": passes,
        "margin": question.margin,
        "seed": question.seed,
        "command": command,
        "left_out": [vars(entry) for entry in _left_out(ours, needs, estimator, scene)],
        "warnings": _warnings(scene, ours),
    }
    started = time.perf_counter()
    try:
        # Two noisy sides share the room; a single one has it to itself.
        target = question.margin / ROOM / (math.sqrt(2) if passes > 1 else 1)
        reference = references.get(scene, question, target, progress)
    except ReferenceUnavailable as problem:
        renderer = "mitsuba" if isinstance(problem, GlossyNeedsLLVM) else None
        return Answer(_row_without(head, ours, str(problem), renderer, seconds), ours, None, None)
    seconds = seconds | {"reference": time.perf_counter() - started, "mitsuba": reference.seconds}
    verdict = judge(ours, reference, passes=passes, margin=question.margin, level=question.level)
    return Answer(_row(head, verdict, reference, seconds), ours, reference, verdict)


def _left_out(ours: Image, needs: Needs, estimator: Estimator, scene: Scene) -> list[LeftOut]:
    found = list(ours.left_out)
    if scene.spp == 1 and not estimator.is_random(needs):
        found.append(LeftOut("further passes of ours", "nothing in this image is random"))
    if not scene.is_glossy:
        found.append(LeftOut("the Phong plugin in Mitsuba", "no surface has a specular albedo"))
    return found


def _warnings(scene: Scene, ours: Image) -> list[str]:
    found = list(scene.warnings)
    if ours.back_faces:
        found.append(f"{ours.back_faces} pixels show the back of a one-sided surface, which is black")
    return found


def _row_without(
    head: dict[str, Any], ours: Image, problem: str, renderer: str | None, seconds: dict[str, Any]
) -> dict[str, Any]:
    """The row of a scene that could not be compared: nothing measured is never passed."""
    nothing = dict.fromkeys(
        (
            *("bias", "bias_relative", "bias_interval", "minimum_detectable_bias", "rms", "rms_relative"),
            *(
                "rms_denoised_relative",
                "rms_denoised_interval",
                "course_bias",
                "course_mse",
                "course_expected",
            ),
        )
    )
    return {
        **head,
        **nothing,
        "pixels": pixel_counts(ours),
        "variance": float(ours.pixel_variance[ours.shaded].mean()) if ours.shaded.any() else 0.0,
        "non_finite": int((~np.isfinite(ours.mean).all(axis=0)).sum()),
        "verdict": "undecided",
        "as_claimed": None,
        "reason": problem,
        "reference": {"renderer": renderer, "version": None, "variant": None, "samples": 0},
        "seconds": seconds,
    }


def _row(head: dict[str, Any], verdict: Verdict, reference: Reference, seconds: dict[str, Any]) -> dict[str, Any]:
    figures = {
        name: getattr(verdict, name)
        for name in (
            *("pixels", "bias", "bias_relative", "bias_interval", "minimum_detectable_bias", "rms"),
            *("rms_relative", "rms_denoised_relative", "rms_denoised_interval", "variance"),
            *("non_finite", "reason"),
        )
    }
    return {
        **head,
        **figures,
        **verdict.noise,
        "course_bias": verdict.course.bias,
        "course_mse": verdict.course.mse,
        "course_expected": verdict.course.expected,
        "verdict": verdict.word,
        "as_claimed": as_claimed(head["claim"], verdict.word, verdict.non_finite),
        "reference": {
            "renderer": reference.renderer,
            "version": reference.version,
            "variant": reference.variant,
            "llvm": reference.llvm,
            "samples": reference.samples,
            "passes": reference.passes,
            "standard_error_relative": verdict.reference_error_relative,
            "notes": list(reference.notes),
        },
        "tiles": verdict.tiles,
        "tile_p": verdict.tile_p,
        "seconds": seconds,
    }
