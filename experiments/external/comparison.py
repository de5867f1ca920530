"""Images of one renderer against the truth: scores, bias, verdict, likely mistakes, in one row."""

from __future__ import annotations

import time
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nusselt.experiments.check.check import Progress
from nusselt.experiments.check.question import Question
from nusselt.experiments.check.references import KeptReferences
from nusselt.experiments.check.rows import as_claimed, judged, reference_entry
from nusselt.experiments.images.formats.png import to_levels
from nusselt.experiments.images.transfer import RULES, Quantiser
from nusselt.experiments.verdict.alike import Alike
from nusselt.experiments.verdict.evidence import CHANCE
from nusselt.experiments.verdict.judge import NoiseWord, Verdict
from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.estimators import Area, Estimator
from nusselt.renderer.image import Image
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats
from nusselt.renderer.words import count as counted

from .against import ALIKE, Against, Brought, judged_against
from .areas import against_areas, may_be_areas
from .diagnosis import Diagnosis, Inputs, diagnose
from .diagnosis.diagnose import Mistake
from .expected import Renders, Scores, course_scores, described, expected_scores
from .ground_truth import Truth, ground_truth
from .shared_noise import NEAR, amount, apart, common_noise, different, whitened
from .sides import Sides, stage

SPREAD = 0.2
"""Share of the pixels below which a place is no noise's."""


@dataclass(frozen=True)
class Comparison:
    """A row, and what is behind it; ``mistaken`` (3, h, w) is the truth with the mistake in it that was named."""

    row: dict[str, Any]
    sides: Sides
    truth: Truth
    verdict: Verdict
    mistaken: Floats | None = None


def compare(
    scene: Scene,
    brought: Brought,
    question: Question,
    *,
    command: str,
    references: KeptReferences,
    executor: Executor | None = None,
    progress: Progress | None = None,
    looks_for_mistakes: bool = True,
) -> Comparison:
    """Judge somebody's images of a scene."""
    started = time.perf_counter()
    estimator = question.of(scene)
    truth = ground_truth(scene, question, references, executor, progress)
    raws = different(brought.raws)
    seen = stage(scene, truth)
    shown = judged_against(scene, brought, raws, question, truth, seen)
    verdict, sides = shown.verdict, shown.sides
    if verdict.word == "differs" and may_be_areas(scene, seen, sides):
        verdict = against_areas(verdict, scene, brought, raws, question, references, truth, executor, progress)
    diagnosis = Diagnosis(())
    if looks_for_mistakes and verdict.word == "differs":
        diagnosis = _diagnosed(scene, shown, truth, estimator, progress)
    elif looks_for_mistakes and verdict.word == "undecided" and len(raws) > sides.images:
        diagnosis = Diagnosis(_noise_in_common(shown))
    needs = prepare(scene).needs
    row = {
        "scene": scene.name,
        "estimator": brought.renderer,
        "compared_estimator": estimator.name,
        "claim": "unbiased",
        "samples": estimator.samples,
        "stratified": estimator.stratified,
        "passes": sides.images,
        "margin": shown.margin,
        "seed": question.seed,
        "command": command,
        "left_out": [vars(entry) for entry in needs.left_out],
        "warnings": _warnings(scene, brought, shown, estimator),
        "images": {},
        "brought": list(brought.names),
        **judged(verdict),
        "noise_word": _noise_word(verdict, brought, shown),
        **_noise_of_row(verdict, sides),
        **_scores(brought, shown.quantiser, truth.reference, shown.renders, seen),
        "quantisation": _said(shown.quantiser, brought),
        "saturated": {"masked": sides.saturated, "at_the_top": sides.at_the_top},
        "single_image": sides.images == 1,
        "likely_mistakes": diagnosis.rows(),
        "where": [place.said for place in diagnosis.where],
        "verdict": verdict.word,
        "as_claimed": as_claimed("unbiased", verdict.word, broken=False),
        "reference": _reference_row(truth),
        "seconds": {"pilot": 0.0, "ours": 0.0, "reference": time.perf_counter() - started},
    }
    return Comparison(row, sides, truth, verdict, diagnosis.predicted)


def _noise_word(verdict: Verdict, brought: Brought, shown: Against) -> NoiseWord | None:
    """Images of different seeds that are one, where noise is expected, have it in common."""
    repeated = shown.sides.images < len(brought.raws)
    return "alike" if repeated and shown.sides.supposed.any() and shown.noise.least else verdict.noise_word


def _diagnosed(
    scene: Scene, shown: Against, truth: Truth, estimator: Estimator, progress: Progress | None
) -> Diagnosis:
    """Of images that differ; where no name explains them, what noise they have in common."""
    raws, judged = shown.raws[: shown.sides.images], ~shown.sides.image.unjudged
    noise = shown.noise.deviation**2 if scene.spp > 1 else None
    given = Inputs.against(raws, shown.quantiser, truth.reference, judged, noise)
    diagnosis = diagnose(scene, given, estimator.samples, estimator.stratified, progress)
    if diagnosis.mistakes or any(place.pixels < SPREAD for place in diagnosis.where):
        return diagnosis
    return replace(diagnosis, mistakes=_noise_in_common(shown))


def _noise_in_common(shown: Against) -> tuple[Mistake, ...]:
    """Of images, or of places.

    Noise in common makes images differ less from each other than independent ones do; a mistake in common does not. A
    denoiser does both: what is left of its images is less than their noise, or its own mistake, and more.
    """
    name, image, deviation = "correlated-seeds", shown.sides.image, shown.noise.deviation.mean(axis=0)
    steps = [(shown.quantiser.decode(raw) - shown.sides.reference.mean).mean(axis=0) for raw in shown.raws]
    fields = [whitened(step, deviation, image.shaded) for step in steps]
    common = common_noise(fields)
    if common and ALIKE < amount(fields[0]) < 1 / ALIKE and apart(steps, deviation, fields[0] != 0) < ALIKE:
        return (Mistake(name, common, "images of different seeds have noise in common"),)
    alike = Alike.of(fields[0], CHANCE)
    far = max(map(abs, alike.step)) >= NEAR
    return (Mistake(name, alike.correlation, alike.said),) if alike.correlation and far else ()


def _warnings(scene: Scene, brought: Brought, shown: Against, estimator: Estimator) -> list[str]:
    found = [*scene.warnings, *dict.fromkeys(note for raw in brought.raws for note in raw.notes)]
    if shown.quantiser.transfer.name == "linear":
        found += [
            f"{said}: levels are taken for linear" for said in dict.fromkeys(r.encoding for r in brought.raws) if said
        ]
    sides, seen, count = shown.sides, shown.seen, len(brought.raws)
    if seen.back_faces:
        found.append(
            f"{counted(seen.back_faces, 'pixel', 'shows')} the back of a one-sided surface, which is black; with "
            "--two-sided backs reflect too"
        )
    if count > len(shown.raws):
        found.append(
            f"{count - len(shown.raws)} of {count} images are repeated bit by bit: your renderer does not use the "
            "seed; equal images count as one"
        )
    if len(shown.raws) > sides.images:
        found.append(
            "the images differ less from each other than from the truth: their noise may be in common, and "
            "they count as one"
        )
    if sides.images == 1:
        told = f"that of our {described(estimator)}, or " if shown.noise.least else ""
        found.append(
            f"one image: its noise is supposed to be {told}what its differences ask for; a second seed would measure "
            "it, and only then is its variance judged"
        )
    elif shown.verdict.noise_word in ("noisier", "quieter"):
        noisy = estimator if shown.noise.least else Area(samples=estimator.samples)
        found.append(f"the expected variance is that of our {described(noisy)} (--estimator, --samples, --no-stratify)")
    if sides.saturated:
        found.append(f"{sides.saturated} shaded pixels can be cut off at the top of the range: masked, not judged")
    if shown.quantiser.top and not brought.rule_given:
        found.append(f"levels are taken to be {RULES[shown.quantiser.rule]}: they fit; say --quantisation if you know")
    lossy = next(filter(None, (raw.rounding.lossy for raw in brought.raws)), "")
    if lossy:
        found.append(
            f"stored with {lossy}, which is lossy: judged with a margin of {shown.margin:.1%}, and lights and "
            "background not at all beside edges; ZIP, ZIPS, PIZ and RLE lose nothing"
        )
    if scene.spp > 1:
        partly = int((~seen.shaded & (seen.emitter < 1) & (seen.background < 1) & ~seen.unjudged).sum())
        found.append(f"pixels are areas: {partly} show part of a light or of the background; no mean holds them")
        found.append("pixels are areas: mistakes of cameras, shadows and light points are not looked for")
    return found


def _noise_of_row(verdict: Verdict, sides: Sides) -> dict[str, float | None]:
    """The standard errors by which two runs are compared; a variance that is supposed is not measured."""
    return verdict.noise | ({"variance_standard_error": None} if sides.images == 1 else {})


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
