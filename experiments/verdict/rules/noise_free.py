"""What must hold without any noise: emitters, background, finite values, the same kind of pixel on both sides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.experiments.verdict.evidence import ROUNDING, TILE_MARGIN, Evidence
from nusselt.experiments.verdict.rule import Finding
from nusselt.renderer.vectors import Bools
from nusselt.renderer.words import count as counted

UNJUDGED = 1e-2
"""Share of the shaded pixels that may lie within rounding of an edge: rooms of 64 pixels a side have 3 in 1000."""


@dataclass(frozen=True)
class NoiseFree:
    """Fails where pixels without noise differ, objects where the pixels judged may not stand for the image.

    The latter is no defect: an image of few pixels whose centres happen to lie on edges has such a share too, and no
    number of samples helps. ``broken`` are rows in which what no estimator computes is wrong.
    """

    name: str = "noise-free"
    share: float | None = None

    def __call__(self, evidence: Evidence, level: float) -> Finding:
        broken = [(mask.sum(axis=1), told) for mask, told in _broken(evidence)]
        still, off = (mask.sum(axis=1) for mask in _still(evidence))
        shaded = evidence.everywhere[0].shaded
        hidden, whole = (shaded & evidence.unjudged).sum(axis=1), shaded.sum(axis=1)
        wrong = np.any([count > 0 for count, _ in broken], axis=0)

        def say(k: int) -> str:
            failures = [f"{counted(count[k], *told[:2])} {told[2]}" for count, told in broken if count[k]]
            if off[k]:
                allowed = TILE_MARGIN * evidence.margin + ROUNDING
                failures.append(f"{off[k]} of {still[k]} pixels without noise are off by more than {allowed:.2%}")
            if not failures and unseen[k]:
                return (
                    f"{hidden[k]} of {whole[k]} shaded pixels lie within rounding of an edge: more pixels would decide"
                )
            return "; ".join(failures)

        unseen = hidden > UNJUDGED * np.maximum(whole, 1)
        return Finding(wrong | (off > 0), say, unseen, figures={"broken": wrong, "non_finite": broken[0][0]})


def _broken(evidence: Evidence) -> list[tuple[Bools, tuple[str, str, str]]]:
    """Pixels (b, p) that are wrong whatever the estimator; noun, verb and the rest of a sentence on them."""
    ours, theirs = evidence.everywhere
    finite = np.isfinite(ours.mean).all(axis=1)
    whole = ~evidence.unjudged & ours.is_whole & theirs.is_whole
    other = whole & ((ours.emitter != theirs.emitter) | (ours.background != theirs.background))
    plain = whole & finite & ~other & ~ours.shaded
    off = (np.abs(ours.mean - theirs.mean) > ROUNDING * np.abs(theirs.mean)).any(axis=1)
    return [
        (~finite, ("pixel", "is", "not finite")),
        (other, ("pixel", "shows", "an emitter or the background on one side only")),
        (plain & off, ("emitter or background pixel", "differs", "beyond rounding")),
    ]


def _still(evidence: Evidence) -> tuple[Bools, Bools]:
    """Judged pixels (b, n) that are known to be without noise on either side, and those of them that are off."""
    ours, theirs = evidence.ours, evidence.reference
    still = np.broadcast_to(evidence.still, ours.grey_variance.shape)
    allowed = TILE_MARGIN * evidence.margin + ROUNDING
    limit = allowed * np.maximum(np.abs(theirs.mean), evidence.scale[:, None, None])
    return still, still & (np.abs(ours.mean - theirs.mean) > limit).any(axis=1)
