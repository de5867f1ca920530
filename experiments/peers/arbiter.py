"""The exact image as the arbiter, and entrants' images made comparable with it and with each other.

Some renderers take pixels' centres, others their areas. Each is held against the exact image of its own rule; between
two rules, images are compared by what they differ from their exact ones.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np

from nusselt.experiments.check.ceiling import sample_ceilings
from nusselt.experiments.check.check import Progress
from nusselt.experiments.check.estimators import noise_free
from nusselt.experiments.check.question import PixelRule, Question, with_pixel_rule
from nusselt.experiments.check.references import KeptReferences
from nusselt.experiments.external.ground_truth import Truth, ground_truth
from nusselt.experiments.external.sides import stage
from nusselt.experiments.verdict.alike import Alike
from nusselt.experiments.verdict.evidence import CHANCE
from nusselt.experiments.verdict.intervals import error_of_mean
from nusselt.experiments.verdict.side import Side
from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Analytic
from nusselt.renderer.image import render
from nusselt.renderer.lights import QuadLight
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Bools, Floats

from .entrant import ORDER, Entrant

AREAS = 4.0
"""The RMS error of an exact image by area, in halves of a margin: its mean is far better."""
SURE = 3.0
"""Standard errors of the mean step that are allowed: in half shadows a midpoint rule's error is no smooth function of
its points, and scatters from pixel to pixel."""

BLACK = (0.0, 0.0, 0.0)
PARTLY = 1e-9
"""Share of a light that is hidden, or seen, from which it is so in part."""


@dataclass(frozen=True)
class Contestant:
    """An entrant, or the exact image, at the judged pixels.

    Parameters
    ----------
    name : str
    side : Side
        A batch of one.
    lights : (3,) float64
        Mean radiance where lights alone are seen; NaN where none is.
    bias_slack, rms_slack : float
        What the method itself may be off by, in the mean and pixel by pixel, relative.
    row : callable, optional
        Of a method without noise: what a row of its points brings where a light is hidden in part, (n,), relative.
    """

    name: str
    side: Side
    lights: Floats
    bias_slack: float = 0.0
    rms_slack: float = 0.0
    row: Callable[[], Floats] | None = None

    def widened(self) -> Contestant:
        """Allowed that row too: a light that is cut along its rows is cut alike by both grids, and no step tells it."""
        if self.row is None:
            return self
        off = self.row()
        rms = self.rms_slack + math.sqrt(float((off * off).mean()))
        return replace(self, bias_slack=self.bias_slack + float(off.mean()), rms_slack=rms, row=None)


@dataclass(frozen=True)
class Arbiter:
    """The exact images of a scene, by what a pixel is, and the pixels that all of them judge.

    Parameters
    ----------
    scene : Scene
        With pixels' centres.
    truths : dict
        By rule; "centre" is always there.
    shaded, emitter : (h, w) bool
        Judged pixels: surfaces alone, away from edges; and lights alone.
    ceiling : (h, w) float64
        The most that one point of a light brings to a pixel, if all do.
    """

    scene: Scene
    truths: dict[PixelRule, Truth]
    shaded: Bools
    emitter: Bools
    ceiling: Floats

    @property
    def said(self) -> str:
        """What it is: for centres, and for areas where somebody has them."""
        return "; ".join(truth.said for truth in self.truths.values())

    @property
    def scale(self) -> float:
        """What "relative" is to: the mean over the judged pixels."""
        return float(self.truths["centre"].reference.mean[:, self.shaded].mean()) or 1.0

    def exact(self) -> Contestant:
        """The arbiter itself."""
        truth = self.truths["centre"]
        error = truth.reference.standard_error
        return self._contestant("exact", truth.reference.mean, error**2, truth.reference.pixel_standard_error**2, 2)

    def residual(self, entrant: Entrant) -> Floats:
        """An entrant's image less the exact one of its own rule, (3, h, w)."""
        return np.asarray(entrant.image - self.truths[entrant.rule].reference.mean)

    def contestant(self, entrant: Entrant) -> Contestant:
        """An entrant made comparable: its difference from its own exact image, added to that at pixels' centres."""
        difference, images = self.residual(entrant), entrant.images
        image, count = self.truths["centre"].reference.mean + difference, len(images)
        clumping = 1.0
        if count > 1:
            variance = images.var(axis=0, ddof=1) / count
            grey = images.mean(axis=1).var(axis=0, ddof=1) / count
            noise = np.where(self.shaded, (images[0] - images.mean(axis=0)).mean(axis=0), 0.0)
            clumping = Alike.of(noise, CHANCE).clumping
        elif entrant.step is None:  # one image of unknown noise: what does not vary smoothly is taken for it
            spread = error_of_mean(difference.mean(axis=0), self.shaded) ** 2 * int(self.shaded.sum())
            variance, grey = np.full(image.shape, spread), np.full(image.shape[1:], spread)
        else:
            variance, grey = np.zeros(image.shape), np.zeros(image.shape[1:])
        found = self._contestant(entrant.name, image, variance, grey, count, clumping)
        if entrant.points and found.side.sampled:
            grain = self.ceiling[self.shaded] / (entrant.points * count)
            found = replace(found, side=replace(found.side, grain=grain))
        if entrant.step is None:
            return found
        bias, rms = slacks(entrant.step[:, self.shaded], self.scale)
        row = cache(partial(self._row, entrant.points)) if entrant.points else None
        return replace(found, bias_slack=bias, rms_slack=rms, row=row)

    def _row(self, points: int) -> Floats:
        row = row_of_points(self.scene, points)[:, self.shaded]
        return np.asarray(np.abs(row).mean(axis=0) / self.scale)

    def _contestant(
        self, name: str, image: Floats, variance: Floats, grey: Floats, count: int, clumping: float = 1.0
    ) -> Contestant:
        noisy = bool(grey.any())
        means = np.full((1, max(count, 1)), float(image[:, self.shaded].mean()))
        side = Side(
            name,
            mean=image[None][..., self.shaded],
            variance=variance[None][..., self.shaded],
            grey_variance=grey[None][..., self.shaded],
            passes=means,
            by_passes=False,
            sampled=noisy,
            freedom=max(count - 1, 1),
            clumping=clumping,
        )
        lights = image[:, self.emitter]
        return Contestant(name, side, lights.mean(axis=1) if lights.size else np.full(3, math.nan))


def arbiter_of(
    scene: Scene,
    rules: Iterable[PixelRule],
    margin: float,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Arbiter:
    """Make the exact images of a scene that entrants of these rules are held against.

    Raises
    ------
    InputError
        If surfaces are seen from behind, which in ours is black, and in peers is not.
    """
    references, question = KeptReferences(None, None), Question(margin=min(AREAS * margin, 1.0))
    wanted: list[PixelRule] = ["centre", *sorted(set(rules) - {"centre"})]
    truths = {
        rule: ground_truth(with_pixel_rule(scene, rule), question, references, executor, progress) for rule in wanted
    }
    stages = [stage(with_pixel_rule(scene, rule), truths[rule]) for rule in wanted]
    seen, unjudged = stages[0], np.logical_or.reduce([one.unjudged for one in stages])
    if seen.back_faces and not scene.two_sided:
        told = "surfaces seen from their front; or --two-sided: other renderers' surfaces have no black back"
        raise InputError("scene", f"{scene.name}, {seen.back_faces} pixels of backs", told)
    sees = [truths[rule].reference for rule in wanted]
    shaded = seen.shaded & ~unjudged & np.logical_and.reduce([_none(one) for one in sees])
    if not shaded.any():
        raise InputError("scene", scene.name, "one whose camera sees a surface")
    emitter = ~unjudged & np.logical_and.reduce([one.emitter == 1 for one in sees])
    scene = with_pixel_rule(scene, "centre")
    ceiling = sample_ceilings(scene).sum(axis=0)
    return Arbiter(scene, truths, shaded, emitter, ceiling)


def slacks(step: Floats, scale: float) -> tuple[float, float]:
    """What a method without noise may be off by in the mean and pixel by pixel, by its step (3, n), over a scale."""
    grey = step.mean(axis=0) / scale
    bias = abs(float(grey.mean())) / ORDER + SURE * float(grey.std()) / math.sqrt(grey.size)
    return bias, math.sqrt(float((grey * grey).mean()))


def row_of_points(scene: Scene, points: int) -> Floats:
    """What a row of so many points brings (3, h, w), of lights that are hidden in part; nothing where none is known."""
    found, exact = np.zeros((3, scene.height, scene.width)), noise_free(scene)
    lights = [light for light in scene.lights if isinstance(light, QuadLight)]  # the only ones that peers know
    if exact is None or len(lights) < len(scene.lights):
        return found
    for light in lights:
        alone = scene.with_(lights=tuple(one if one is light else replace(one, radiance=BLACK) for one in lights))
        seen, whole = render(alone, exact).mean, render(alone, Analytic()).mean
        found += np.where((seen > PARTLY * whole) & (seen < (1 - PARTLY) * whole), whole, 0.0)
    return found / math.isqrt(points)


def _none(reference: Reference) -> Bools:
    """Pixels of which no part shows a light, or nothing."""
    return np.asarray((reference.emitter == 0) & (reference.background == 0) & (reference.holes == 0))
