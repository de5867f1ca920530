"""The rows of the main job in `results.json`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from nusselt.experiments.results.schema import COURSE, JUDGED, Row, names
from nusselt.experiments.verdict.decision import AS_CLAIMED
from nusselt.experiments.verdict.evidence import pixel_counts
from nusselt.experiments.verdict.judge import Verdict
from nusselt.mitsuba_bridge.reference import GlossyNeedsLLVM, Reference, ReferenceUnavailable
from nusselt.renderer.estimators import Claim, Estimator
from nusselt.renderer.estimators.protocol import Bounded
from nusselt.renderer.image import Image
from nusselt.renderer.needs import LeftOut, Needs
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene
from nusselt.renderer.words import count

from .estimators import told_name


def as_claimed(claim: Claim, verdict: str, broken: bool) -> bool | None:
    """Whether a verdict fits what the estimator says of itself; None where it is undecided.

    An estimator that admits a bias, for good or at few samples, may show it. None may be wrong where nothing is
    random: emitters, background, values that are not finite.
    """
    if broken:
        return False
    if claim in ("biased", "consistent"):
        return True
    return AS_CLAIMED[verdict]


def reference_entry(reference: Reference, standard_error: float, notes: Sequence[str]) -> dict[str, Any]:
    """What a row says of its reference; ``standard_error`` of its pooled mean, relative."""
    told = {name: getattr(reference, name) for name in ("renderer", "version", "variant", "llvm", "samples", "passes")}
    told |= {"standard_error_relative": standard_error, "notes": list(notes)}
    return told | {"limits": list(reference.limits)} if reference.limits else told


def head_of(
    scene: Scene, estimator: Estimator, ours: Image, passes: int, margin: float, seed: int, command: str
) -> dict[str, Any]:
    """What was asked, and what the scene did not need."""
    needs = prepare(scene).needs
    return {
        "scene": scene.name,
        "estimator": told_name(estimator),
        "claim": estimator.claim(needs),
        "samples": estimator.samples,
        "stratified": estimator.stratified,
        "passes": passes,
        "margin": margin,
        "seed": seed,
        "command": command,
        "left_out": [vars(entry) for entry in _left_out(ours, needs, estimator, scene)],
        "routes": ours.routes,
        "bound": _bound(ours),
        "warnings": [*_warnings(scene, ours), *notes(scene, estimator)],
    }


def _bound(ours: Image) -> float | None:
    """The largest bound of any value that has one; see `Image.bound`."""
    if ours.bound is None:
        return None
    known = ours.bound[np.isfinite(ours.bound)]
    return float(known.max(initial=0.0))


def _left_out(ours: Image, needs: Needs, estimator: Estimator, scene: Scene) -> list[LeftOut]:
    found = list(ours.left_out)
    if scene.spp == 1 and not estimator.is_random(needs):
        found.append(LeftOut("further passes of ours", "nothing in this image is random"))
    if not scene.is_glossy:
        found.append(LeftOut("the Phong plugin in Mitsuba", "no surface has a specular albedo"))
    return found


def notes(scene: Scene, estimator: Estimator) -> list[str]:
    """What an estimator without noise leaves to sampling because of what stands before a light."""
    return list(estimator.sampled(prepare(scene).needs)) if isinstance(estimator, Bounded) else []


def _warnings(scene: Scene, ours: Image) -> list[str]:
    found = list(scene.warnings)
    if ours.back_faces:
        found.append(f"{count(ours.back_faces, 'pixel', 'shows')} the back of a one-sided surface, which is black")
    return found


def row_without(head: dict[str, Any], ours: Image, problem: ReferenceUnavailable, seconds: dict[str, Any]) -> Row:
    """The row of a scene that could not be compared: nothing measured is never passed."""
    renderer = "mitsuba" if isinstance(problem, GlossyNeedsLLVM) else None
    nothing = dict.fromkeys(names((*JUDGED, *COURSE)))
    return {
        **head,
        **nothing,
        "samples_to_decide": None,
        "pixels": pixel_counts(ours),
        "variance": float(ours.pixel_variance[ours.shaded].mean()) if ours.shaded.any() else 0.0,
        "non_finite": int((~np.isfinite(ours.mean).all(axis=0)).sum()),
        "verdict": "undecided",
        "as_claimed": None,
        "reason": str(problem),
        "reference": {"renderer": renderer, "version": None, "variant": None, "samples": 0},
        "seconds": seconds,
    }


def to_decide(head: dict[str, Any], verdict: Verdict, reference: Reference) -> dict[str, int] | None:
    """Samples a pixel and light that would decide, if the bias is what it seems; None where it is decided."""
    if verdict.more is None:
        return None
    ours, theirs = head["samples"] * head["passes"], reference.samples
    return {"ours": math.ceil(ours * verdict.more), "reference": math.ceil(theirs * verdict.more)}


def judged(verdict: Verdict) -> Row:
    """What the judge says, by the names of `results.json`."""
    return {name: getattr(verdict, name) for name in names(JUDGED)}


def row_of(head: dict[str, Any], verdict: Verdict, reference: Reference, seconds: dict[str, Any]) -> Row:
    """A whole row of `results.json`."""
    return {
        **head,
        **judged(verdict),
        **verdict.noise,
        "samples_to_decide": to_decide(head, verdict, reference),
        "course_bias": verdict.course.bias,
        "course_mse": verdict.course.mse,
        "course_expected": verdict.course.expected,
        "verdict": verdict.word,
        "as_claimed": as_claimed(head["claim"], verdict.word, verdict.broken),
        "reference": reference_entry(reference, verdict.reference_error_relative, reference.notes),
        "seconds": seconds,
    }
