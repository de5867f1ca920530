"""Images of a method without noise, allowed what it says that it may be off by: its step from a quarter of the samples.

Pixel by pixel such a method is right in no half shadow, so that its mean and its root mean square alone are asked for,
as in the cross-check. It may also be off by a row of its points wherever a light is hidden in part: one that is cut
along its own rows is cut alike by both grids, and the step tells nothing of it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from nusselt.experiments.check.estimators import noise_free
from nusselt.experiments.peers.arbiter import Contestant, slacks
from nusselt.experiments.peers.compare import difference
from nusselt.experiments.verdict.evidence import Evidence
from nusselt.experiments.verdict.level import Level
from nusselt.experiments.verdict.side import Side
from nusselt.renderer.estimators import Analytic
from nusselt.renderer.image import render
from nusselt.renderer.lights import QuadLight
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats

from .judge import Judged, evidence_of
from .peer_source import LEAST, PeerSource
from .relation import Images, Related, Shot
from .sources import Source

BLACK = (0.0, 0.0, 0.0)
PARTLY = 1e-9
"""Share of a light that is hidden, or seen, from which it is so in part."""


def steps_of(source: Source, shots: Sequence[Shot]) -> list[Floats]:
    """What a method without noise may be off by in each shot; of every other source none."""
    if isinstance(source, PeerSource) and not source.peer.noise:
        return [source.step(shot) for shot in shots]
    return []


def judge_by_method(related: Related, images: Images, steps: Images, level: Level, margin: float) -> Judged:
    """Judge a relation by the images and the steps of the scene and of every shot."""
    told = partial(_judged, related, related.sides(images), related.sides(steps), level, margin)
    judged = told()
    if judged.word != "differs":
        return judged
    rows = [_row(related.of, 1), *(_row(shot.scene, shot.more) for shot in related.shots)]
    return told(related.sides(rows))


def beside_exact(scene: Scene, image: Floats, step: Floats, level: Level, margin: float) -> Judged | None:
    """Judge a scene's image (3, h, w) beside the exact one; None where there is none."""
    exact = noise_free(scene)
    if exact is None:
        return None
    sides, none = (image, render(scene, exact).mean), 0 * step
    told = partial(_judged, Related(scene, (), lambda images: sides), sides, (step, none), level, margin)
    judged = told()
    return judged if judged.word != "differs" else told((_row(scene, 1), none))


def _row(scene: Scene, more: int) -> Floats:
    """What a row of points brings (3, h, w), of lights that are hidden in part; nothing where that is not known."""
    found, exact = np.zeros((3, scene.height, scene.width)), noise_free(scene)
    lights = [light for light in scene.lights if isinstance(light, QuadLight)]  # the only ones that peers know
    if exact is None or len(lights) < len(scene.lights):
        return found
    for light in lights:
        alone = scene.with_(lights=tuple(one if one is light else replace(one, radiance=BLACK) for one in lights))
        seen, whole = render(alone, exact).mean, render(alone, Analytic()).mean
        found += np.where((seen > PARTLY * whole) & (seen < (1 - PARTLY) * whole), whole, 0.0)
    return found / math.isqrt(max(scene.light_samples * more, LEAST))


def _judged(
    related: Related,
    sides: tuple[Floats, Floats],
    steps: tuple[Floats, Floats],
    level: Level,
    margin: float,
    rows: tuple[Floats, Floats] | None = None,
) -> Judged:
    seen, expected = sides
    if not np.isfinite(seen).all():
        return Judged("differs", "values are not finite", {})
    evidence = evidence_of(related, expected, (seen - expected)[None], margin + related.bound)
    shaded = np.zeros(evidence.shape, dtype=bool)
    shaded.flat[evidence.place] = True
    if not shaded.any():
        return Judged("undecided", "no surface is seen", {})
    some = [[one[:, shaded] for one in (steps[k], rows[k] if rows else 0 * steps[k])] for k in (0, 1)]
    one = _contestant(evidence, evidence.ours, 0, *some[0])
    other = _contestant(evidence, evidence.reference, 1, *some[1])
    found = difference(one, other, shaded, margin + related.bound, level)
    interval = list(found.interval)
    return Judged(found.word, found.reason, {"bias_relative": found.bias, "bias_interval": interval})


def _contestant(evidence: Evidence, side: Side, number: int, step: Floats, row: Floats) -> Contestant:
    seen, scale = evidence.everywhere[number], float(evidence.scale[0])
    whole = (seen.emitter[0] == 1) & ~evidence.unjudged
    lights = seen.mean[0][:, whole].mean(axis=1) if whole.any() else np.full(3, np.nan)
    off, (bias, rms) = np.abs(row).mean(axis=0) / scale, slacks(step, scale)
    return Contestant(side.name, side, lights, bias + float(off.mean()), rms + math.sqrt(float((off * off).mean())))
