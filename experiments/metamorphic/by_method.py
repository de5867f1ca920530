"""Images of a method without noise, allowed what it says that it may be off by: its step from a quarter of the samples.

Pixel by pixel such a method is right in no half shadow, so that its mean and its root mean square alone are asked for,
as in the cross-check. It may also be off by a row of its points wherever a light is hidden in part: one that is cut
along its own rows is cut alike by both grids, and the step tells nothing of it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np

from nusselt.experiments.check.estimators import noise_free
from nusselt.experiments.peers.arbiter import Contestant, row_of_points, slacks
from nusselt.experiments.peers.compare import difference
from nusselt.experiments.verdict.level import Level
from nusselt.experiments.verdict.side import Side
from nusselt.renderer.image import render
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats

from .judge import Judged, evidence_of
from .peer_source import LEAST, PeerSource
from .relation import Images, Related, Shot
from .sources import Source

Sides = tuple[Floats, Floats]


def steps_of(source: Source, shots: Sequence[Shot]) -> list[Floats]:
    """What a method without noise may be off by in each shot; of every other source none."""
    if isinstance(source, PeerSource) and not source.peer.noise:
        return [source.step(shot) for shot in shots]
    return []


def judge_by_method(related: Related, images: Images, steps: Images, level: Level, margin: float) -> Judged:
    """Judge a relation by the images and the steps of the scene and of every shot."""

    def rows() -> Sides:
        return related.sides([_row(related.of), *(_row(shot.scene, shot.more) for shot in related.shots)])

    return _judged(related, related.sides(images), related.sides(steps), rows, level, margin)


def beside_exact(scene: Scene, image: Floats, step: Floats, level: Level, margin: float) -> Judged | None:
    """Judge a scene's image (3, h, w) beside the exact one; None where there is none."""
    exact = noise_free(scene)
    if exact is None:
        return None
    sides, none = (image, render(scene, exact).mean), 0 * step
    related = Related(scene, (), lambda images: sides)
    return _judged(related, sides, (step, none), lambda: (_row(scene), none), level, margin)


def _row(scene: Scene, more: int = 1) -> Floats:
    return row_of_points(scene, max(scene.light_samples * more, LEAST))


def _judged(
    related: Related, sides: Sides, steps: Sides, rows: Callable[[], Sides], level: Level, margin: float
) -> Judged:
    seen, expected = sides
    if not np.isfinite(seen).all():
        return Judged("differs", "values are not finite", {})
    evidence = evidence_of(related, expected, (seen - expected)[None], margin + related.bound)
    shaded = np.zeros(evidence.shape, dtype=bool)
    shaded.flat[evidence.place] = True
    if not shaded.any():
        return Judged("undecided", "no surface is seen", {})
    scale, rows = float(evidence.scale[0]), cache(rows)

    def contestant(side: Side, number: int) -> Contestant:
        seen = evidence.everywhere[number]
        whole = (seen.emitter[0] == 1) & ~evidence.unjudged
        lights = seen.mean[0][:, whole].mean(axis=1) if whole.any() else np.full(3, np.nan)
        bias, rms = slacks(steps[number][:, shaded], scale)
        return Contestant(
            side.name, side, lights, bias, rms, lambda: np.abs(rows()[number][:, shaded]).mean(axis=0) / scale
        )

    one, other = contestant(evidence.ours, 0), contestant(evidence.reference, 1)
    found = difference(one, other, shaded, margin + related.bound, level)
    interval = list(found.interval)
    return Judged(found.word, found.reason, {"bias_relative": found.bias, "bias_interval": interval})
