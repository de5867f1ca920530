"""Images of one renderer against the truth: scores, bias, verdict, likely mistakes, in one row."""

from __future__ import annotations

import math
import time
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nusselt.experiments.check.check import Progress
from nusselt.experiments.check.question import Question
from nusselt.experiments.check.references import KeptReferences
from nusselt.experiments.check.rows import as_claimed, judged, reference_entry
from nusselt.experiments.images.formats import Raw
from nusselt.experiments.images.formats.png import to_levels
from nusselt.experiments.images.transfer import RULES, Quantiser, Rule
from nusselt.experiments.verdict.judge import Verdict, judge
from nusselt.experiments.verdict.level import Level
from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.image import Image
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene

from .diagnosis import diagnose
from .diagnosis.diagnose import Diagnosis, Mistake
from .diagnosis.probe import Probe
from .expected import Renders, Scores, course_scores, expected_scores, own_renders
from .ground_truth import Truth, ground_truth
from .shared_noise import common_noise, different, repeated_noise, whitened
from .sides import Sides, stage, two_sides


@dataclass(frozen=True)
class Brought:
    """What a user brings.

    Parameters
    ----------
    names : tuple of str
        Where each image came from.
    raws : list of Raw
    quantiser : Quantiser
    rule_given : bool
        Whether the user said how levels were made.
    renderer : str
        What made the images, for the row.
    """

    names: tuple[str, ...]
    raws: list[Raw]
    quantiser: Quantiser
    rule_given: bool
    renderer: str = "image"


@dataclass(frozen=True)
class Comparison:
    """A row, and what is behind it."""

    row: dict[str, Any]
    sides: Sides
    truth: Truth
    verdict: Verdict


def compare(
    scene: Scene,
    brought: Brought,
    question: Question,
    *,
    command: str,
    references: KeptReferences,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Comparison:
    """Judge somebody's images of a scene."""
    started = time.perf_counter()
    estimator = question.of(scene)
    truth = ground_truth(scene, question, references, executor, progress)
    seen = stage(scene)
    probe = Probe(scene, estimator.samples, estimator.stratified)
    renders = own_renders(scene, estimator, probe)
    raws = different(brought.raws)
    quantiser = brought.quantiser
    if quantiser.top and not brought.rule_given:
        quantiser = _found_out(seen, raws, quantiser, truth.reference, renders)
    sides = two_sides(seen, raws, quantiser, truth.reference, renders)
    level: Level = question.level
    verdict = judge(sides.image, sides.reference, passes=sides.images, margin=question.margin, level=level)
    diagnosis = _diagnosis(scene, brought, raws, estimator.samples, estimator.stratified, progress)
    mistakes = _with_noise(diagnosis, brought, raws, sides, renders)
    needs = prepare(scene).needs
    row = {
        "scene": scene.name,
        "estimator": brought.renderer,
        "compared_estimator": estimator.name,
        "claim": "unbiased",
        "samples": estimator.samples,
        "stratified": estimator.stratified,
        "passes": sides.images,
        "margin": question.margin,
        "seed": question.seed,
        "command": command,
        "left_out": [vars(entry) for entry in needs.left_out],
        "warnings": _warnings(scene, brought, sides, quantiser),
        "images": {},
        "brought": list(brought.names),
        **judged(verdict),
        **_scores(brought, quantiser, truth.reference, renders, seen),
        "quantisation": _said(quantiser, brought),
        "saturated": {"masked": sides.saturated, "at_the_top": sides.at_the_top},
        "single_image": sides.images == 1,
        "likely_mistakes": [vars(mistake) for mistake in mistakes],
        "verdict": verdict.word,
        "as_claimed": as_claimed("unbiased", verdict.word, broken=False),
        "reference": _reference_row(truth),
        "seconds": {"pilot": 0.0, "ours": 0.0, "reference": time.perf_counter() - started},
    }
    return Comparison(row, sides, truth, verdict)


def _found_out(seen: Image, raws: list[Raw], quantiser: Quantiser, truth: Reference, renders: Renders) -> Quantiser:
    """The rule under which the images lie nearer to the truth."""
    both = {rule: two_sides(seen, raws, replace(quantiser, rule=rule), truth, renders) for rule in RULES}
    some = ~seen.unjudged
    for sides in both.values():
        some = some & sides.image.shaded

    def distance(rule: Rule) -> float:
        step = (both[rule].image.mean - both[rule].reference.mean)[:, some]
        return float((step * step).mean()) if step.size else 0.0

    usual_first = sorted(RULES, key=lambda rule: rule != quantiser.rule)
    return replace(quantiser, rule=min(usual_first, key=distance))


def _diagnosis(
    scene: Scene, brought: Brought, raws: list[Raw], samples: int, stratified: bool, progress: Progress | None
) -> Diagnosis:
    if scene.spp > 1:
        return Diagnosis((), math.nan, math.nan)
    return diagnose(scene, raws, brought.quantiser, samples, stratified, progress)


def _with_noise(
    diagnosis: Diagnosis, brought: Brought, raws: list[Raw], sides: Sides, renders: Renders
) -> tuple[Mistake, ...]:
    """The hypotheses' ranking, with noise that images or places have in common."""
    name, mistakes = "correlated-seeds", diagnosis.mistakes
    noisy = bool((255 * renders.deviation > 0.5).any())
    if len(raws) < len(brought.raws) and noisy:
        told = f"{len(brought.raws) - len(raws)} of {len(brought.raws)} images are repeated bit by bit"
        return (Mistake(name, 1.0, told), *mistakes)
    deviation = renders.deviation.mean(axis=0)
    base = sides.reference.mean
    fields = [
        whitened((brought.quantiser.decode(raw) - base).mean(axis=0), deviation, sides.image.shaded) for raw in raws
    ]
    common = common_noise(fields)
    if common:
        return (Mistake(name, common, "images of different seeds have noise in common"), *mistakes)
    again, (down, right) = repeated_noise(fields[0])
    if again and (not mistakes or again > mistakes[0].explained):
        told = f"the noise is repeated {right} pixels to the side and {down} down"
        return (Mistake(name, again, told), *mistakes)
    return mistakes


def _warnings(scene: Scene, brought: Brought, sides: Sides, quantiser: Quantiser) -> list[str]:
    found = [*scene.warnings, *dict.fromkeys(note for raw in brought.raws for note in raw.notes)]
    if sides.images == 1:
        found.append(
            "one image: its noise is supposed to be our estimator's, or what its differences ask for; "
            "a second seed would measure it, and only then is its variance judged"
        )
    if sides.saturated:
        found.append(f"{sides.saturated} shaded pixels can be cut off at the top of the range: masked, not judged")
    if quantiser.top and not brought.rule_given:
        told = "rounded" if quantiser.rule == "round" else "truncated"
        found.append(f"levels are taken to be {told}: so they fit better; say --quantisation if you know")
    if scene.spp > 1:
        found.append("mistakes are looked for only where a pixel is its centre (spp 1)")
    return found


def _scores(brought: Brought, quantiser: Quantiser, truth: Reference, renders: Renders, seen: Image) -> dict[str, Any]:
    """The course's scores of every image, in its own eight bits, beside what a right one gets."""
    inside = (truth.mean > 0) & (truth.mean < 1)
    blur = float(np.where(inside, (255 * truth.standard_error) ** 2, 0.0).mean())
    scores: list[Scores] = []
    for raw in brought.raws:
        levels = raw.values if quantiser.top == 255 else to_levels(quantiser.decode(raw))
        scores.append(course_scores(np.asarray(levels, dtype=np.float64), truth.mean, blur))
    flat = truth.mean.reshape(3, -1)[:, renders.pixels]
    expected = expected_scores(renders, flat, blur, truth.mean[0].size)
    return {
        "course_bias": scores[0].bias,
        "course_mse": scores[0].mse,
        "course_expected": expected,
        "course_scores": [vars(score) for score in scores],
    }


def _said(quantiser: Quantiser, brought: Brought) -> dict[str, Any]:
    if not quantiser.top:
        return {"levels": 0, "transfer": None, "rule": None, "given": True}
    return {
        "levels": quantiser.top + 1,
        "transfer": quantiser.transfer.name,
        "rule": quantiser.rule,
        "given": brought.rule_given,
    }


def _reference_row(truth: Truth) -> dict[str, Any]:
    reference = truth.reference
    mean = float(np.abs(reference.pass_means.mean())) or 1.0
    return reference_entry(reference, reference.pooled_error / mean, (truth.said, *reference.notes))
