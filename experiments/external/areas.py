"""Are pixels averages over their areas, where they were taken for their centres?

A path tracer that jitters its camera rays over each pixel is right, and differs from the centres at every edge. That is
said only where the areas explain it: images nearer to them than to the centres, and nothing else that differs.
"""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import replace

import numpy as np
from scipy import ndimage, special

from nusselt.experiments.check.check import Progress
from nusselt.experiments.check.question import Question, with_pixel_rule
from nusselt.experiments.check.references import KeptReferences
from nusselt.experiments.images.formats import Raw
from nusselt.experiments.verdict.judge import Verdict
from nusselt.renderer.image import Image
from nusselt.renderer.scene import Scene

from .against import Against, Brought, judged_against
from .ground_truth import Truth, ground_truth
from .sides import Sides, beside_another, stage

FEWEST = 0.1
"""Share of the plain pixels beside an edge that differ where pixels are areas, at least, but for chance."""
CHANCE = 1e-3
CLEAR = 0.02
"""Of the brightest around, by which a centre and an area differ that are compared."""
NEARER = 0.75
"""Share, at most, that is left of the squared difference of centres from areas: a ray at the pixel's corner in place of
its centre leaves four times as much, r rays at random 2 / r."""


def may_be_areas(scene: Scene, seen: Image, sides: Sides) -> bool:
    """Whether the plain pixels do not speak against it: of those beside edges some are off, of the others fewer.

    A sliver between the centres makes a pixel a part of another without an edge beside it; areas tell whether it is so.
    """
    if scene.spp > 1:
        return False
    off = (sides.image.mean != sides.reference.mean).any(axis=0)
    plain = ~seen.shaded & ~seen.unjudged
    edge = beside_another(sides.reference.mean, 3)
    beside = off[plain & edge]
    far, near = np.count_nonzero(off[plain & ~edge]), np.count_nonzero(beside)
    return bool(far == 0 if not beside.size else far < near and special.bdtr(near, beside.size, FEWEST) > CHANCE)


def against_areas(
    verdict: Verdict,
    scene: Scene,
    brought: Brought,
    raws: list[Raw],
    question: Question,
    references: KeptReferences,
    centres: Truth,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Verdict:
    """The verdict against centres, or `undecided` where areas explain what differs."""
    if references.given(scene) is not None:
        return verdict  # what was given says nothing of areas
    boxed, asked = with_pixel_rule(scene, "area"), replace(question, pixel_rule="area")
    truth = ground_truth(boxed, asked, references, executor, progress)
    shown = judged_against(boxed, brought, raws, asked, truth, stage(boxed, truth))
    if shown.verdict.word == "differs" or not _explained(shown, centres, truth):
        return verdict
    told = f"your pixels are areas: --pixel-rule area (against their centres: {verdict.reason})"
    return replace(verdict, word="undecided", reason=told, broken=False, more=None)


def _explained(shown: Against, centres: Truth, areas: Truth) -> bool:
    """Whether images lie nearer to areas than centres do, where the two are clearly apart; noise taken out."""
    image = np.mean([shown.quantiser.decode(raw) for raw in shown.raws], axis=0).mean(axis=0)
    centre, area = (truth.reference.mean.mean(axis=0) for truth in (centres, areas))
    scale = ndimage.maximum_filter(np.maximum(centre, area), 3)  # an edge of a light counts as much as any other
    apart = (np.abs(centre - area) > CLEAR * scale) & np.isfinite(image)
    if not apart.any():
        return False
    noise = shown.noise.variance / len(shown.raws) + areas.reference.pixel_standard_error**2
    left, right = ((image - area) ** 2 - noise)[apart], ((centre - area) ** 2)[apart]
    return float((left / scale[apart] ** 2).sum()) <= NEARER * float((right / scale[apart] ** 2).sum())
