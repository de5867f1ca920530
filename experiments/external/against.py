"""Somebody's images judged against one truth: how their levels are read, what noise they have, the verdict."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from nusselt.experiments.check.check import seeds
from nusselt.experiments.check.expectations import shadow_offset
from nusselt.experiments.check.question import Question
from nusselt.experiments.images.formats import Raw
from nusselt.experiments.images.transfer import RULES, Quantiser, Rule
from nusselt.experiments.verdict.evidence import Expectations
from nusselt.experiments.verdict.judge import Verdict, judge
from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import Image
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats

from .diagnosis.case import nearer
from .expected import PASSES, Renders, own_renders, supposed_sampling
from .ground_truth import Truth
from .noise import Noise, noise_of
from .shared_noise import rough, smooth
from .sides import Sides, two_sides

SURE = 3.0
"""Standard errors beyond which a rule of levels fits worse than another."""
NOISIER = 1.5
"""Variance over what is supposed at which samples may have been left out at random: half of them double it."""
WIDE = 2.0
"""Of an interval of the bias, relative: one that holds both no light and twice as much explains nothing."""
HALF_OF_SQUARES = 0.455
"""Median of the square of a normal number."""
SHOWN = 0.5
"""Share of a bias that levels must show."""
ALIKE = 0.5
"""Variance among images, over what is supposed, below which their noise may be in common."""
LOSSY = 0.01
"""Margin, at least, of images of a lossy compression: B44 makes noisy pixels 0.5 % brighter on average."""


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
class Against:
    """Images and a truth, and all that was made of them."""

    raws: list[Raw]
    verdict: Verdict
    sides: Sides
    seen: Image
    quantiser: Quantiser
    renders: Renders
    noise: Noise
    margin: float


def judged_against(
    scene: Scene, brought: Brought, raws: list[Raw], question: Question, truth: Truth, seen: Image
) -> Against:
    """Judge different images ``raws`` of those that were brought.

    A renderer may pick one light a sample, or end half of its paths at random, and so have noise where ours has none.
    Nobody says so: what differs is judged again as its image, and where that explains it it does not differ.

    Parameters
    ----------
    seen : Image
        From `stage`.
    """
    estimator, rays = supposed_sampling(scene, question)
    renders = own_renders(scene, estimator, rays)
    known = len(renders.passes) > 1
    supposed = renders if known else own_renders(scene, Area(samples=estimator.samples), rays)
    draws = estimator.samples if scene.spp == 1 else rays

    def judged(weight: int, quantiser: Quantiser | None = None) -> Against:
        noise = noise_of(scene, draws, seen, truth, supposed, least=1.0 if known else 0.0, weight=weight)
        said = brought if quantiser is None else replace(brought, quantiser=quantiser, rule_given=True)
        return _judged(scene, said, raws, question, truth, seen, renders, noise)

    against = judged(1)
    if against.verdict.word == "differs" and brought.quantiser.top and not brought.rule_given:
        against = by_another_rule(against, partial(judged, 1))
    if against.verdict.word != "differs" or (len(scene.lights) < 2 and not _scatters(against.sides)):
        return against
    picked = judged(max(2, len(scene.lights)))
    low, high = picked.verdict.bias_interval
    explains = picked.verdict.word != "differs" and high - low < WIDE
    return picked if explains else against


def by_another_rule(against: Against, judged: Callable[[Quantiser], Against]) -> Against:
    """`undecided` where levels made by a rule that nobody named would not differ: half a level is seen so.

    Parameters
    ----------
    judged : callable
        The same images with another quantiser.
    """
    for rule in RULES:
        if rule == against.quantiser.rule:
            continue
        other = judged(replace(against.quantiser, rule=rule))
        if other.verdict.word != "differs":
            word = "agrees" if other.verdict.word == "agrees" else "would be undecided"
            reason = f"by levels of another rule it {word}: say --quantisation {rule}"
            told = f"{reason} (by {against.quantiser.rule}: {against.verdict.reason})"
            return replace(against, verdict=replace(against.verdict, word="undecided", reason=told, more=None))
    return against


def _scatters(sides: Sides) -> bool:
    """Whether most pixels of an image are off by more than the noise supposed, and a thousandth of themselves."""
    expected = sides.reference.mean.mean(axis=0)
    square = (sides.image.first.mean(axis=0) - expected) ** 2
    usual = sides.supposed + sides.reference.pixel_standard_error**2 + (1e-3 * expected) ** 2
    some = sides.image.shaded & ~sides.image.unjudged & (usual > 0) & np.isfinite(square)
    return bool(some.any()) and float(np.median(square[some] / usual[some])) > NOISIER * HALF_OF_SQUARES


def _judged(
    scene: Scene,
    brought: Brought,
    raws: list[Raw],
    question: Question,
    truth: Truth,
    seen: Image,
    renders: Renders,
    noise: Noise,
) -> Against:
    quantiser = brought.quantiser
    if quantiser.top and not brought.rule_given:
        quantiser = _found_out(seen, raws, quantiser, truth.reference, noise)
    sides = two_sides(seen, raws, quantiser, truth.reference, noise)
    if in_common(sides, noise):
        sides = two_sides(seen, raws[:1], quantiser, truth.reference, noise)
    margin = max(question.margin, LOSSY if any(raw.rounding.lossy for raw in raws) else 0.0)
    verdict = judge(
        sides.image,
        sides.reference,
        passes=sides.images,
        margin=margin,
        level=question.level,
        expectations=_expectations(scene, question, noise, sides, truth),
    )
    if _hidden(verdict, sides, truth.reference.mean, quantiser, margin):
        reason = f"levels are too coarse to show a bias of {margin:.3%}, and no noise evens them out: bring EXR or PFM"
        told = f" (now {verdict.reason})" if verdict.word == "differs" else ""
        verdict = replace(verdict, word="undecided", reason=reason + told, more=None)
    return Against(raws, verdict, sides, seen, quantiser, renders, noise, margin)


def _hidden(verdict: Verdict, sides: Sides, truth: Floats, quantiser: Quantiser, margin: float) -> bool:
    """Whether an image as much brighter, or darker, as the margin would have levels that hardly tell.

    What differs is hidden as well, if it is less than half a level, in the mean and all over.
    """
    some = sides.image.shaded & ~sides.image.unjudged
    if not quantiser.top or not some.any():
        return False
    now = quantiser.expected(truth, sides.deviation)
    if verdict.word == "differs":
        half = math.sqrt(3 * float(quantiser.spread(truth)[:, some].mean()))
        small = max(abs(verdict.bias), verdict.rms_denoised_relative * verdict.reference_mean) < half
        if verdict.broken or verdict.pixels_off or verdict.non_finite or not small:
            return False
    steps = [quantiser.expected((1 + off) * truth, sides.deviation) - now for off in (margin, -margin)]
    shown = min(abs(float(step[:, some].mean())) for step in steps)
    return shown < SHOWN * margin * float(truth[:, some].mean())


def in_common(sides: Sides, noise: Noise) -> bool:
    """Whether images that vary little among each other are as far from the truth as noise of the supposed size.

    Seeds that are not used, but for the order of a sum, give such images; they tell as little of noise as one does.
    What is smooth in the difference is not noise, and dark images vary as little as they are dark. Where not one of the
    largest samples is to be expected in all images, all may have missed what is rare: alike, they tell nothing.
    """
    if sides.images == 1 or sides.factor > ALIKE:
        return False
    seen, expected = sides.image.mean.mean(axis=0), sides.reference.mean.mean(axis=0)
    some = sides.image.shaded & ~sides.image.unjudged & noise.sampled & np.isfinite(seen)
    some &= sides.images * expected >= noise.grain
    level = smooth(expected, some)
    dark = np.divide(smooth(seen, some), level, out=np.ones_like(level), where=level > 0)
    supposed = float((np.clip(dark, 0.0, 1.0) ** 2 * sides.supposed)[some].sum())
    if float(sides.image.pixel_variance[some].sum()) > ALIKE * supposed:
        return False
    own = sides.image.pixel_variance / sides.images + sides.reference.pixel_standard_error**2
    left = float((rough(seen - expected, some) ** 2).sum())
    return left > max(float(own[some].sum()) / ALIKE, ALIKE * supposed)


def _expectations(scene: Scene, question: Question, noise: Noise, sides: Sides, truth: Truth) -> Expectations:
    """What is known before the images are looked at; of one image, that its grains are coarser if it is noisier."""
    alone = sides.images == 1
    offset = None
    if not truth.exact:
        offset = shadow_offset(scene, seeds(question.seed, scene.name, "offset")[0])
    return Expectations(
        variance=None if alone else sides.supposed,
        offset=offset,
        sampled=noise.sampled,
        grain=noise.grain * (sides.factor if alone or not noise.least else 1.0) / sides.images,
        reference_grain=noise.reference_grain,
        freedom=PASSES - 1 if alone else None,
        claims_variance=False,
    )


def _found_out(seen: Image, raws: list[Raw], quantiser: Quantiser, truth: Reference, noise: Noise) -> Quantiser:
    """The usual rule, unless another fits better beyond chance: pixel by pixel, or in the mean, quiet pixels first.

    Half a level is seen in the mean long before it is in noisy pixels; where it is not, the rule does not matter.
    Lights that are seen have no noise: rules that do not fit them are out, if one does.
    """
    sides = {rule: two_sides(seen, raws, replace(quantiser, rule=rule), truth, noise) for rule in RULES}
    wrong = {rule: _plain_misfits(one) for rule, one in sides.items()}
    sides = {rule: one for rule, one in sides.items() if wrong[rule] == min(wrong.values())}
    usual = quantiser.rule if quantiser.rule in sides else next(iter(sides))
    some = ~seen.unjudged & np.logical_and.reduce([one.image.shaded for one in sides.values()])
    size = np.sqrt(np.maximum(sides[usual].supposed, quantiser.spread(truth.mean).mean(axis=0)))
    steps = {rule: ((one.image.mean - one.reference.mean).mean(axis=0) / size)[some] for rule, one in sides.items()}
    if not steps[usual].size:
        return replace(quantiser, rule=usual)
    best = min(steps.values(), key=lambda step: float((step * step).mean()))
    likely = {rule: step for rule, step in steps.items() if nearer(best**2, step**2) < SURE}

    def off(rule: Rule) -> float:
        """Standard errors of the mean."""
        error = float(likely[rule].std()) / math.sqrt(best.size)
        return abs(float(likely[rule].mean())) / error if error else 0.0

    return replace(quantiser, rule=usual if usual in likely and off(usual) < SURE else min(likely, key=off))


def _plain_misfits(sides: Sides) -> int:
    """Pixels without noise that are no surface's and differ."""
    plain = ~sides.image.shaded & ~sides.image.unjudged
    return int((sides.image.mean != sides.reference.mean).any(axis=0)[plain].sum())
