"""Every hypothesis against one image; one is named where it leaves nothing, or little, and no other does as well.

A hypothesis is scored by what it leaves beyond noise, over surfaces and over pixels without noise apart: the lower
share of the two counts. One that moves what was right is out. Of hypotheses that fit alike the one with fewer fitted
parameters is taken; two of other names that cannot be told apart are said to be so.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np

from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Bools, Floats

from .case import Case, Fit, Inputs
from .hints import HINTS
from .hypotheses import OF_AREAS, STAGES
from .place import Place, places
from .probe import Probe
from .shared_points import shared_points

SURE = 5.0
"""Standard errors by which a hypothesis must fit better than none, of some two hundred."""
APART = 3.0
"""Standard errors by which one hypothesis fits better than another."""
LEFT = 4.0
"""Standard errors from which what is left is more than noise."""
ENOUGH = 0.85
"""Share that a hypothesis must explain to be named."""
PARTLY = 0.92
"""The same, where more than noise is left."""
NEARLY_ALL = 0.99
"""The same of one with many parameters."""
ALL = 10.0
"""Standard errors from which one that leaves nothing but noise ends the search."""
PARAMETER = 4.0
"""Weighted squares by which a fitted parameter must lower the sum."""
MOVED = 0.02
"""Share of the plain pixels that a hypothesis may put wrong where they are right, and five."""
TESTS = 1 << 23
"""Tests of a sample against a body that one hypothesis may take: some hundred need shadow rays of their own."""
LIKELY = 30.0
"""Least sum of weighted squares explained: chance gives so much to one of a thousand at 5e-5."""
NAMED_WRONGLY = 0.02
"""Share of right images that are given a name, at most, were they diagnosed: none of 293 were, which allows 1.8 % (the
99 % interval's upper end); `nusselt run calibration` measures it again, of 800."""
MANY = 3
"""Fitted parameters beyond which a hypothesis follows whatever it is given."""
CLEAR = 1000.0
"""Sum of weighted squares explained, from which few pixels are enough."""


@dataclass(frozen=True)
class Mistake:
    """One entry of ``likely_mistakes``.

    Parameters
    ----------
    name, detail : str
    explained : float
        Share of the difference beyond noise, the lower of surfaces' and plain pixels'.
    sure : float
        Standard errors by which it fits better than no mistake.
    rest : bool
        Whether more than noise is left.
    """

    name: str
    explained: float
    detail: str
    sure: float = 0.0
    rest: bool = False

    @property
    def hint(self) -> str:
        """What to look for in one's code."""
        return HINTS[self.name]


@dataclass(frozen=True)
class Diagnosis:
    """What an image looks like.

    Parameters
    ----------
    mistakes : tuple of Mistake
        The name, or none; where two cannot be told apart, both.
    where : tuple of Place
        Where the difference is; empty where it is everywhere.
    tried : tuple of Mistake
        The best of each name, for tests and tables.
    predicted : (3, h, w) float64, optional
        The right image with the first mistake in it; where few pixels are looked at, each stands for its neighbours.
    """

    mistakes: tuple[Mistake, ...]
    where: tuple[Place, ...] = ()
    tried: tuple[Mistake, ...] = ()
    predicted: Floats | None = None

    def rows(self) -> list[dict[str, Any]]:
        return [asdict(mistake) | {"hint": mistake.hint, "named_wrongly": NAMED_WRONGLY} for mistake in self.mistakes]


@dataclass(frozen=True, eq=False)
class Scored:
    """A fit beside that of no mistake."""

    fit: Fit

    @property
    def right(self) -> Fit:
        """What no mistake leaves."""
        return self.fit.case.right

    @property
    def name(self) -> str:
        return self.fit.guess.name

    @property
    def _measures(self) -> tuple[Callable[[Fit, Bools], tuple[float, float]], ...]:
        """By pixels and by tiles; by pixels alone where noise is told that may clump, and one image cannot tell."""
        clumps = len(self.fit.left) == 1 and np.ndim(self.fit.guess.noise) > 0
        return (Fit.pixels,) if clumps else (Fit.pixels, Fit.tiles)

    @cached_property
    def explained(self) -> float:
        """The lower share of surfaces and plain pixels."""
        return min(self._surfaces, self._plain)

    @cached_property
    def _surfaces(self) -> float:
        """Of tiles or of pixels, whichever tells with less noise; 1 where nothing was wrong, and nothing is."""
        shaded = self.fit.case.shaded
        shares = []
        for of in self._measures:
            before, error = of(self.right, shaded)
            after, other = of(self.fit, shaded)
            if before > LEFT * error and before > 0:
                shares.append(1 - max(after, 0.0) / before)
            elif after > LEFT * other and after > 2 * max(before, 0):
                return 0.0
        return min(shares, default=1.0)

    @cached_property
    def _plain(self) -> float:
        before, after = self.right.plain_off, self.fit.plain_off
        if before:
            return 1 - self.fit.plain_left / max(self.right.plain_left, 1e-300)
        return 1.0 if after <= 5 + MOVED * self.fit.case.plain.sum() else 0.0

    @cached_property
    def rest(self) -> bool:
        """Whether more than noise is left."""
        shaded = self.fit.case.shaded
        for of in self._measures:
            left, error = of(self.fit, shaded)
            if left > LEFT * error and left > 0:
                return True
        return self.fit.plain_off > 1 and self.fit.plain_left > 0.03 * self.right.plain_left

    @cached_property
    def total(self) -> float:
        """Weighted squares, and what the fitted parameters cost."""
        return float(self.fit.squares.sum()) + PARAMETER * self.fit.guess.fitted

    @cached_property
    def better(self) -> float:
        """Standard errors by which it fits better than none: enough where few pixels say it all, none for a trifle."""
        gained = float(self.right.squares.sum()) - self.total
        if gained < LIKELY:
            return 0.0
        sure = self.fit.over(self.right)
        if gained > CLEAR and self.explained > ENOUGH:
            return max(sure, SURE + 1)
        return sure

    @property
    def ends_search(self) -> bool:
        """Whether nothing else need be looked for: no fit of many parameters does that."""
        return self.explained > ENOUGH and self.better > ALL and not self.rest and self.fit.guess.fitted <= 1

    @property
    def rank(self) -> tuple[bool, bool, int]:
        """Of those that fit alike the least is named."""
        fitted = self.fit.guess.fitted
        return fitted > MANY, self.rest, fitted

    @property
    def tells(self) -> bool:
        """Whether it explains enough to be named: more, where something is left, and most if it follows whatever."""
        rest = NEARLY_ALL if self.fit.guess.fitted > MANY else PARTLY
        return self.better > SURE and self.explained >= (rest if self.rest else ENOUGH)

    def told(self) -> Mistake:
        words = self.fit.guess.detail + ("; and something else" if self.rest else "")
        return Mistake(self.name, max(self.explained, 0.0), words, float(self.better), self.rest)


def diagnose(
    scene: Scene,
    given: Inputs,
    samples: int,
    stratified: bool,
    progress: Callable[[str, int, int], None] | None = None,
) -> Diagnosis:
    """Name the mistake that images of one renderer show, if one is known that explains them.

    Parameters
    ----------
    given : Inputs
    samples, stratified
        Of the estimator they were made with.
    """
    case = Case(Probe(scene, samples, stratified, tests=TESTS), given)
    if not case.valid.any():
        return Diagnosis(())
    scored: list[Scored] = []
    stages = STAGES if scene.spp == 1 else OF_AREAS
    for number, stage in enumerate(stages):
        if progress:
            progress("mistakes", number, len(stages))
        with np.errstate(all="ignore"):
            for hypothesis in stage:
                scored += [Scored(case.fit(guess)) for guess in hypothesis(case) if _finite(guess.prediction)]
        best = _best(scored)
        if best is not None and best.ends_search:
            break
    chosen = named(scored)
    mistakes = tuple(one.told() for one in chosen)
    predicted = case.probe.spread_out(chosen[0].fit.guess.prediction) if chosen else None
    share = shared_points(case) if not mistakes and scene.spp == 1 else None
    if share is not None:
        mistakes = (
            Mistake("correlated-seeds", share, "the same light points serve every pixel: the noise is one pattern"),
        )
    return Diagnosis(mistakes, places(case), _tried(scored), predicted)


def _finite(values: np.ndarray) -> bool:
    return bool(np.isfinite(values).all())


def _best(scored: list[Scored]) -> Scored | None:
    likely = [one for one in scored if one.explained > 0 and one.better > SURE]
    return min(likely, key=lambda one: one.total, default=None)


def named(scored: list[Scored]) -> list[Scored]:
    """The hypothesis to be told, and others that cannot be told from it; or none.

    Of those that fit alike, ones that follow whatever they are given come last, ones that leave nothing before ones
    that do, then the fewer fitted parameters, then the order in which they are listed.
    """
    best = _best(scored)
    if best is None:
        return []
    likely = [one for one in scored if one.tells]
    alike = [one for one in likely if best.fit.over(one.fit) < APART]
    if not alike:
        return []
    order = sorted(alike, key=lambda one: one.rank)
    same = [one for one in order if one.rank == order[0].rank]
    closest = min(same, key=lambda one: one.total)
    first = next(one for one in scored if one in same and closest.fit.over(one.fit) < 1)
    others = {one.name: one for one in sorted(same, key=lambda one: -one.total)}
    others.pop(first.name, None)
    return [first, *sorted(others.values(), key=lambda one: one.total)]


def _tried(scored: list[Scored]) -> tuple[Mistake, ...]:
    best: dict[str, Scored] = {}
    for one in sorted(scored, key=lambda one: -one.total):
        best[one.name] = one
    return tuple(one.told() for one in sorted(best.values(), key=lambda one: one.total)[:8])
