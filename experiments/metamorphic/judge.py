"""Are two images, or sums of images, the same on average? The project's verdict on their differences, seed by seed.

Both sides of a relation are rendered with the same seeds, and each seed's difference is one pass: what noise both sides
have in common cancels, and what they have not is measured. The expected side stands as if it had no noise; the passes'
spread holds that of both.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from nusselt.experiments.check.ceiling import sample_ceilings
from nusselt.experiments.external.sides import PART
from nusselt.experiments.verdict.alike import Alike
from nusselt.experiments.verdict.decision import Word, decide
from nusselt.experiments.verdict.evidence import CHANCE, Evidence
from nusselt.experiments.verdict.intervals import average
from nusselt.experiments.verdict.level import Level, findings
from nusselt.experiments.verdict.rule import Finding
from nusselt.experiments.verdict.rules.normality import is_doubtful
from nusselt.experiments.verdict.rules.pass_spread import PassSpread
from nusselt.experiments.verdict.rules.pixels import Pixels
from nusselt.experiments.verdict.rules.tiles import Tiles
from nusselt.experiments.verdict.side import Seen, Side
from nusselt.mitsuba_bridge.tolerance import ray_tolerance
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import Image, render
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Bools, Floats

from .relation import Images, Related, Shot

FIGURES = ("bias_relative", "bias_interval", "minimum_detectable_bias", "rms_denoised_relative")


@dataclass(frozen=True)
class Judged:
    """What is said of a relation; figures are relative to the expected mean over shaded pixels.

    Parameters
    ----------
    word : {"agrees", "differs", "undecided"}
    reason : str
    figures : dict
        By their names in `results.json`.
    more : float, optional
        How many times the samples would decide.
    """

    word: Word
    reason: str
    figures: dict[str, Any]
    more: float | None = None


def stage(scene: Scene) -> Image:
    """What our camera sees where, and which pixels lie at an edge: of pixels that are areas nothing is asked."""
    if scene.spp == 1:
        return render(scene, Area(samples=1), tolerance=ray_tolerance(scene))
    nothing = np.zeros((scene.height, scene.width))
    return Image.without_noise(np.zeros((3, *nothing.shape)), nothing, nothing)


def judge_relation(
    related: Related, images: list[Images], level: Level, margin: float, rounding: float = 0.0
) -> Judged:
    """Judge a relation.

    Parameters
    ----------
    related : Related
    images : list of list of (3, h, w) float64
        For every seed, of the scene and every shot.
    level : Level
    margin : float
        Relative difference declared not to matter; the relation's own bound is added.
    rounding : float
        Relative error of a value by the images' format.
    """
    pairs = [related.sides(each) for each in images]
    expected = np.mean([wanted for _, wanted in pairs], axis=0)
    with np.errstate(invalid="ignore"):  # of images that are not finite
        difference = np.array([np.where(abs(a - b) <= _limit(a, b, rounding), 0.0, a - b) for a, b in pairs])
    if still := _silent(related, images, difference):
        return still
    unpaired = np.array([seen for seen, _ in pairs]) - np.roll([wanted for _, wanted in pairs], 1, axis=0)
    judged = partial(_judged, related, expected, (difference, unpaired), level, margin + related.bound)
    found = judged(None)
    if found.word != "differs" and not _is_glossy(related):
        return found
    # What no pass met may be all that differs; and tiles of few and large samples speak with their grain alone.
    bounded = judged(_grain(related, len(images)))
    return bounded if "differs" in (found.word, bounded.word) else found


def _judged(
    related: Related,
    expected: Floats,
    differences: tuple[Floats, Floats],
    level: Level,
    margin: float,
    grain: Floats | None,
) -> Judged:
    """By differences of passes of one seed, or else of two, and the most that one sample brings, where it is given."""
    evidence = evidence_of(related, expected, differences[0], margin, grain)
    said = _findings(related, evidence, level)
    if is_doubtful(evidence)[0]:  # what is left of noise in common is rare: all noise is taken, of seeds unpaired
        evidence = evidence_of(related, expected, differences[1], margin, grain)
        said = _findings(related, evidence, level)
    if said[PassSpread.name].fails[0]:  # pixels have noise in common: only passes are independent, no grain is known
        ours = replace(evidence.ours, by_passes=True, grain=None)
        said = _findings(related, replace(evidence, ours=ours, shares_points=True), level)
    word, reason, more = decide(said.values())
    figures = {key: value for finding in said.values() for key, value in finding.figures.items() if key in FIGURES}
    return Judged(word, reason, {key: np.asarray(value)[0].tolist() for key, value in figures.items()}, more)


def _findings(related: Related, evidence: Evidence, level: Level) -> dict[str, Finding]:
    """What the rules say; not of single pixels where anything is random: one may be seen otherwise at an edge.

    Nor of tiles where a lobe's samples may be rare and large and no grain is known: few pixels miss them all alike.
    """
    said = findings(evidence, level)
    silent = [Pixels.name] if evidence.ours.sampled else []
    silent += [Tiles.name] if _is_glossy(related) and evidence.ours.grain is None else []
    return said | {name: replace(said[name], fails=evidence.nowhere) for name in silent}


def _is_glossy(related: Related) -> bool:
    return any(scene.is_glossy for scene in (related.of, *(shot.scene for shot in related.shots)))


def _grain(related: Related, runs: int) -> Floats:
    """The most that one sample brings to a pixel of the mean, (h, w), by a renderer that may pick one of the lights."""
    shots = (Shot(related.of), *related.shots)
    images: Images = [np.broadcast_to(_most(shot) / runs, (3, *_most(shot).shape)) for shot in shots]
    sides = zip(related.sides(images), related.sides([0 * image for image in images]), strict=True)
    return np.asarray(np.max([(some - none).mean(axis=0) for some, none in sides], axis=0))


def _most(shot: Shot) -> Floats:
    """That one sample brings to an image, (h, w)."""
    scene = shot.scene
    samples = scene.spp if scene.spp > 1 else scene.light_samples * shot.more
    return np.asarray(len(scene.lights) * sample_ceilings(scene).max(axis=0, initial=0.0) / samples)


def _limit(seen: Floats, wanted: Floats, relative: float) -> Floats:
    """What rounding may bring: both sides are sums of images, none of which is below nothing."""
    size = np.abs(seen) + np.abs(wanted)
    return np.asarray(relative * (size + size.mean(where=np.isfinite(size))))


def _silent(related: Related, images: list[Images], difference: Floats) -> Judged | None:
    """Of a renderer that gives the same image for every seed although its noise should show."""
    alike = all(
        np.array_equal(image, first) for each in images[1:] for image, first in zip(each, images[0], strict=True)
    )
    if not related.soft or not alike or len(images) == 1:
        return None
    if related.stirs:
        shows = _shows_noise(related.of)
        return Judged("differs", "every seed gives the same image", {}) if shows else None
    if difference.any():
        told = "every seed gives the same image, so that its error cannot be told from a mistake"
        return Judged("undecided", told, {})
    return None


def _shows_noise(scene: Scene) -> bool:
    """Whether images of a sample a pixel differ, by ours: not where no soft light reaches what is seen."""
    one, two = (render(scene, Area(samples=1), seed=seed).mean for seed in (0, 1))
    return not np.array_equal(one, two)


def evidence_of(
    related: Related, expected: Floats, difference: Floats, margin: float, grain: Floats | None = None
) -> Evidence:
    """One row for the rules: the differences (r, 3, h, w) as passes beside what is expected, (3, h, w).

    ``grain`` (h, w) is the most that one sample brings to their mean.
    """
    view = stage(related.of)
    emitter, background, unjudged = (related.place(mask) for mask in (view.emitter, view.background, view.unjudged))
    if related.hidden is not None:  # no part of the shaded pixels
        emitter, unjudged = np.where(related.hidden, PART, emitter), unjudged | related.hidden
    passes = expected + difference
    finite = np.isfinite(passes).all(axis=(0, 1))
    judged = (emitter == 0) & (background == 0) & ~unjudged & finite
    random = related.soft and len(passes) > 1 and bool(judged.any())
    ours = _noisy(passes, judged) if random else _noiseless("the scene", passes.mean(axis=0)[:, judged])
    ours = replace(ours, grain=grain[judged] if random and grain is not None else None)

    def everywhere(values: Floats) -> Seen:
        return Seen(values.reshape(1, 3, -1), emitter.reshape(1, -1), background.reshape(1, -1))

    return Evidence(
        ours,
        _noiseless("what is expected", expected[:, judged]),
        shape=(judged.shape[0], judged.shape[1]),
        place=np.flatnonzero(judged),
        everywhere=(everywhere(passes.mean(axis=0)), everywhere(expected)),
        unjudged=unjudged.ravel(),
        margin=margin,
        still=np.full(int(judged.sum()), not related.soft),
        claims_variance=False,
    )


def _noisy(passes: Floats, judged: Bools) -> Side:
    """A side of passes (r, 3, h, w) whose pixels may have some noise in common."""
    side = Side.of_passes("the scene", passes[None, ..., judged], by_passes=False)
    noise = np.where(judged, (passes[0] - passes.mean(axis=0)).mean(axis=0), 0.0)
    clumping = Alike.of(noise, CHANCE).clumping if noise.any() else 1.0
    return replace(side, freedom=len(passes) - 1.0, clumping=clumping)


def _noiseless(name: str, mean: Floats) -> Side:
    """A side of values (3, n) in which nothing is random."""
    values = mean[None]
    zeros = np.zeros_like(values)
    return Side(name, values, zeros, zeros[:, 0], average(values.mean(axis=1))[:, None], by_passes=False, sampled=False)
