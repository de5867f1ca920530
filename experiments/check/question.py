"""What is asked of a scene: validated where it is made, whoever makes it, and named as the caller wrote it.

An error names the field; the command line says it as its option (see `nusselt.experiments.terminal.group`).
"""

from __future__ import annotations

import math
import operator
from dataclasses import dataclass, field
from numbers import Real
from typing import Literal, Protocol, get_args

from nusselt.experiments.verdict.level import Level
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Estimator, estimator_named
from nusselt.renderer.scene import Scene

from .estimators import estimator_at, estimator_of, is_path

PixelRule = Literal["centre", "area"]
ShadowOrigin = Literal["surface", "mitsuba"]
BOX_RAYS = 16
"""Rays over a pixel's box for an estimator with noise, where the scene names no number."""
MOST_SAMPLES = 1 << 24
MOST_SEED = 2**63 - 1


def number_within(name: str, value: object, low: float, high: float) -> None:
    """Refuse what is no number above ``low`` and at most ``high``.

    Raises
    ------
    InputError
    """
    if isinstance(value, bool) or not isinstance(value, Real) or not low < float(value) <= high:
        most = "" if high == math.inf else f", at most {high:g}"
        raise InputError(name, value, f"a number above {low:g}{most}")


def whole_within(name: str, value: object, low: int, high: int) -> None:
    """Refuse what is no whole number from ``low`` to ``high``.

    Raises
    ------
    InputError
    """
    try:
        number = low - 1 if isinstance(value, bool) else operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        number = low - 1
    if not low <= number <= high:
        raise InputError(name, value, f"a whole number from {low} to {high}")


def one_of(name: str, value: object, accepted: tuple[str, ...]) -> None:
    """Refuse what is not among some words.

    Raises
    ------
    InputError
    """
    if value not in accepted:
        raise InputError(name, value, "one of " + ", ".join(accepted))


def chosen_estimator(
    scene: Scene, estimator: str | type[Estimator] | None, samples: int | None, stratified: bool | None
) -> Estimator:
    """What the user asks for, and for the rest what the scene does.

    Raises
    ------
    InputError
        If there is no such estimator, or it cannot be made so.
    """
    count = samples or scene.light_samples
    strata = scene.stratify if stratified is None else stratified
    if isinstance(estimator, type):
        return estimator_of(estimator, count, strata)
    name = estimator or {"analyticdirect": "analytic", "direct": "area"}[scene.integrator]
    named = estimator_at if is_path(name) else estimator_named
    return named(name, count, strata)


def with_pixel_rule(scene: Scene, rule: PixelRule | None) -> Scene:
    """The scene with pixels by their centres or by their areas, on both renderers; None: as it says itself."""
    if rule is None:
        return scene
    if rule == "area" and scene.is_textured:
        raise InputError("pixel_rule", rule, "centre: a texture varies inside a pixel")
    return scene.with_(spp=1 if rule == "centre" else scene.spp if scene.spp > 1 else BOX_RAYS)


class Sampled(Protocol):
    """How an image of ours is made: what `Question` and `Drawing` have in common."""

    @property
    def estimator(self) -> str | type[Estimator] | None: ...

    @property
    def samples(self) -> int | None: ...

    @property
    def stratified(self) -> bool | None: ...

    @property
    def seed(self) -> int: ...

    @property
    def shadow_origin(self) -> ShadowOrigin: ...

    @property
    def pixel_rule(self) -> PixelRule | None: ...

    @property
    def tolerance(self) -> float | None: ...


def check_sampling(asked: Sampled, toleranced: tuple[PixelRule, ...]) -> None:
    """Refuse what no image can be made with.

    Parameters
    ----------
    asked : Sampled
    toleranced : tuple
        Pixel rules that make use of a tolerance.

    Raises
    ------
    InputError
    """
    if not isinstance(asked.estimator, str | type | None):
        raise InputError("estimator", asked.estimator, "a name, package.module:Name or a class")
    if asked.samples is not None:
        whole_within("samples", asked.samples, 1, MOST_SAMPLES)
    if not isinstance(asked.stratified, bool | None):
        raise InputError("stratified", asked.stratified, "True, False or None for the scene's")
    whole_within("seed", asked.seed, 0, MOST_SEED)
    one_of("shadow_origin", asked.shadow_origin, get_args(ShadowOrigin))
    if asked.pixel_rule is not None:
        one_of("pixel_rule", asked.pixel_rule, get_args(PixelRule))
    if asked.pixel_rule == "area" and asked.shadow_origin == "mitsuba":
        raise InputError("shadow_origin", "mitsuba", "surface, where pixels are drawn by area")
    if asked.tolerance is not None:
        number_within("tolerance", asked.tolerance, 0, math.nextafter(1, 0))
        if asked.pixel_rule not in toleranced:
            raise InputError("tolerance", asked.tolerance, f"pixel_rule {' or '.join(toleranced)} beside it")


@dataclass(frozen=True)
class Question:
    """What is asked of every scene.

    Parameters
    ----------
    estimator : str, class or None
        Name, ``package.module:Name`` or class; None: the one the scene's integrator names.
    samples : int or None
        Per light; None: the scene's.
    stratified : bool or None
        None: the scene's.
    margin : float
        Relative bias declared not to matter, in (0, 1].
    seed : int
    level : Level
        Its ``alpha`` in (0, 0.5].
    timeout : float
        Seconds the reference may take.
    shadow_origin : {"surface", "mitsuba"}
        Where shadow rays start: at the surface, or by Mitsuba's rule.
    pixel_rule : {"centre", "area"} or None
        None: the scene's.
    tolerance : float or None
        Relative RMS error of pixels by area from an estimator without noise, in (0, 1); None: the margin over 8.

    Raises
    ------
    InputError
        If one of them is not accepted, or two do not go together.
    """

    estimator: str | type[Estimator] | None = None
    samples: int | None = None
    stratified: bool | None = None
    margin: float = 1e-3
    seed: int = 0
    level: Level = field(default_factory=Level)
    timeout: float = 600.0
    shadow_origin: ShadowOrigin = "surface"
    pixel_rule: PixelRule | None = None
    tolerance: float | None = None

    def __post_init__(self) -> None:
        check_sampling(self, ("area",))
        number_within("margin", self.margin, 0, 1)
        number_within("alpha", self.level.alpha, 0, 0.5)
        number_within("timeout", self.timeout, 0, math.inf)

    def of(self, scene: Scene) -> Estimator:
        """The estimator to use on a scene."""
        return chosen_estimator(scene, self.estimator, self.samples, self.stratified)
