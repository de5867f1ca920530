"""Images of a method without noise, allowed what it says that it may be off by: its step from a quarter of the samples.

Pixel by pixel such a method is right in no half shadow, so that its mean and its root mean square alone are asked for,
as in the cross-check.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nusselt.experiments.check.estimators import noise_free
from nusselt.experiments.peers.arbiter import Contestant, slacks
from nusselt.experiments.peers.compare import difference
from nusselt.experiments.verdict.evidence import Evidence
from nusselt.experiments.verdict.level import Level
from nusselt.experiments.verdict.side import Side
from nusselt.renderer.image import render
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats

from .judge import Judged, evidence_of
from .peer_source import PeerSource
from .relation import Images, Related, Shot
from .sources import Source


def steps_of(source: Source, shots: Sequence[Shot]) -> list[Floats]:
    """What a method without noise may be off by in each shot; of every other source none."""
    if isinstance(source, PeerSource) and not source.peer.noise:
        return [source.step(shot) for shot in shots]
    return []


def judge_by_method(related: Related, images: Images, steps: Images, level: Level, margin: float) -> Judged:
    """Judge a relation by the images and the steps of the scene and of every shot."""
    return _judged(related, related.sides(images), related.sides(steps), level, margin)


def beside_exact(scene: Scene, image: Floats, step: Floats, level: Level, margin: float) -> Judged | None:
    """Judge a scene's image (3, h, w) beside the exact one; None where there is none."""
    exact = noise_free(scene)
    if exact is None:
        return None
    sides = image, render(scene, exact).mean
    return _judged(Related(scene, (), lambda images: sides), sides, (step, 0 * step), level, margin)


def _judged(
    related: Related, sides: tuple[Floats, Floats], steps: tuple[Floats, Floats], level: Level, margin: float
) -> Judged:
    seen, expected = sides
    if not np.isfinite(seen).all():
        return Judged("differs", "values are not finite", {})
    evidence = evidence_of(related, expected, (seen - expected)[None], margin + related.bound)
    shaded = np.zeros(evidence.shape, dtype=bool)
    shaded.flat[evidence.place] = True
    if not shaded.any():
        return Judged("undecided", "no surface is seen", {})
    one = _contestant(evidence, evidence.ours, steps[0][:, shaded], 0)
    other = _contestant(evidence, evidence.reference, steps[1][:, shaded], 1)
    found = difference(one, other, shaded, margin + related.bound, level)
    interval = list(found.interval)
    return Judged(found.word, found.reason, {"bias_relative": found.bias, "bias_interval": interval})


def _contestant(evidence: Evidence, side: Side, step: Floats, number: int) -> Contestant:
    seen = evidence.everywhere[number]
    whole = (seen.emitter[0] == 1) & ~evidence.unjudged
    lights = seen.mean[0][:, whole].mean(axis=1) if whole.any() else np.full(3, np.nan)
    return Contestant(side.name, side, lights, *slacks(step, float(evidence.scale[0])))
