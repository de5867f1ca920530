"""What a reference may itself be wrong by: before ours is said to differ, that is taken out of the difference.

Mitsuba's rule for shadow rays is known, and followed: how much it changes each pixel is measured, with and without it
and the same random numbers. What float32 makes of narrow lights is known to its size. Only as much of the difference,
where it is and with its sign, is forgiven. What is left is judged again: if that is enough, the row is `undecided` and
says why; if not, it differs as before.
"""

from __future__ import annotations

import math
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from nusselt.experiments.verdict.evidence import NO_EXPECTATIONS, Expectations, unjudged
from nusselt.experiments.verdict.judge import Verdict, judge
from nusselt.experiments.verdict.level import Level
from nusselt.experiments.verdict.rules.noise_free import UNJUDGED
from nusselt.mitsuba_bridge.lights import rounding
from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.camera.rays import pixel_centres
from nusselt.renderer.camera.view import look
from nusselt.renderer.estimators import Area
from nusselt.renderer.estimators.analytic import without_shadows
from nusselt.renderer.image import Image
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Bools, Floats

from .expectations import moved_by, offset_of

ROUNDS = 8
"""Images with and without the rule: their spread is the error of the difference."""
PATHS = 1 << 25
SURE = 5.0
"""Standard errors by which a pixel's explained error may be further out."""
RULE = "Mitsuba's rule for shadow rays"
LIFTS = "Mitsuba up to 3.9 lifts shadow rays off the surface and ends them short of the light"


@dataclass(frozen=True, eq=False)
class OwnError:
    """What an image of Mitsuba's is known to be wrong by, (3, h, w) each.

    Parameters
    ----------
    added, error
        What its rule for shadow rays adds, and the standard error of that.
    rounded
        What float32 may add, or take.
    """

    added: Floats
    error: Floats
    rounded: Floats

    def left(self, difference: Floats) -> Floats:
        """What of the difference of such an image from a right one is not explained."""
        room = SURE * self.error + self.rounded
        low, high = np.minimum(self.added, 0) - room, np.maximum(self.added, 0) + room
        return np.asarray(difference - np.clip(difference, low, high))

    def said(self, mean: Floats, shaded: Bools, reason: str, causes: tuple[str, ...] = ()) -> str:
        """That it explains what is said of an image beside such a mean (3, h, w)."""
        size = float(np.abs(mean).mean(axis=0)[shaded].mean()) or 1.0
        told = f"by {RULE} its own mean is {float(self.added.mean(axis=0)[shaded].mean()) / size:+.2%} off"
        if self.rounded.any():
            told += f", by its roundings up to {float(self.rounded.mean(axis=0)[shaded].mean()) / size:.2%}"
        return f"{'; '.join(causes) or LIFTS}: {told}, which explains that {reason}"


def own_error(scene: Scene, seed: int, executor: Executor | None = None) -> OwnError | None:
    """Both together; None where nothing is known."""
    known, rounded = rule_error(scene, seed, executor), rounding_error(scene)
    if known is None and not rounded.any():
        return None
    return OwnError(*(known or (np.zeros_like(rounded), np.zeros_like(rounded))), rounded)


def rule_error(scene: Scene, seed: int, executor: Executor | None = None) -> tuple[Floats, Floats] | None:
    """What Mitsuba's rule for shadow rays adds to each pixel, (3, h, w), and its standard error; None if not known."""
    rule = offset_of(scene)
    if rule is None:
        return None
    rays = scene.width * scene.height * max(len(scene.lights), 1)
    side = math.isqrt(max(1, min(64, PATHS // (rays * 2 * ROUNDS))))
    estimator = Area(samples=side * side, stratified=True)
    steps = []
    for state in np.random.SeedSequence(seed).generate_state(ROUNDS):
        steps.append(moved_by(rule, scene, estimator, int(state), executor))
        if not prepare(scene).needs.random:
            break
    found = np.stack(steps)
    if len(steps) == 1:
        return found[0], np.zeros_like(found[0])
    error = found.std(axis=0, ddof=1) / math.sqrt(ROUNDS)
    return found.mean(axis=0), error


def rounding_error(scene: Scene) -> Floats:
    """By how much Mitsuba's float32 may be off in each pixel (3, h, w), where lights are narrow; at centres."""
    near, geometry, needs = prepare(scene)
    out = np.zeros((3, scene.height * scene.width))
    view = look(near, geometry, *pixel_centres(range(scene.width), range(scene.height)))
    for source in needs.sources:
        share = rounding(source.light, view.points.position)
        if share.any():
            out[:, view.lit] += share * without_shadows(view.points, replace(source, light=source.light.without_rim()))
    return out.reshape(3, scene.height, scene.width)


def reconsidered(
    verdict: Verdict,
    scene: Scene,
    ours: Image,
    reference: Reference,
    *,
    passes: int,
    margin: float,
    level: Level,
    expectations: Expectations = NO_EXPECTATIONS,
    seed: int = 0,
    executor: Executor | None = None,
) -> Verdict:
    """The verdict, or `undecided` with the cause where the reference's own limits explain what differs.

    Parameters
    ----------
    verdict : Verdict
        What `judge` says, given the same.
    seed : int
        Of the images that measure the reference's rule.
    """
    if verdict.word == "undecided" and reference.limits:
        hidden = int((unjudged(ours, reference) & ours.shaded).sum())
        if hidden > UNJUDGED * max(int(ours.shaded.sum()), 1):
            return replace(verdict, reason=f"{hidden} shaded pixels are not judged: {'; '.join(reference.limits)}")
    if verdict.word != "differs" or reference.renderer != "mitsuba":
        return verdict
    known = own_error(scene, seed, executor)
    if known is None:
        return verdict
    difference = reference.mean - ours.mean
    shaded = ours.shaded & (reference.emitter == 0) & (reference.background == 0)
    left = np.where(shaded, known.left(difference), difference)
    again = judge(
        replace(ours, mean=reference.mean - left),
        reference,
        passes=passes,
        margin=margin,
        level=level,
        expectations=expectations,
    )
    if again.word == "differs":
        return verdict
    told = known.said(reference.mean, shaded, verdict.reason, reference.limits)
    return replace(verdict, word="undecided", reason=told, more=None)
