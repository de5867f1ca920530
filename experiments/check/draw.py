"""Our image alone, without Mitsuba, and what is to be said of it."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass

from nusselt.mitsuba_bridge.ray_offset import mitsuba_offset
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Estimator
from nusselt.renderer.image import Image, render
from nusselt.renderer.pixels import AreaImage, CentreImage, render_area, render_centre
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene
from nusselt.renderer.visibility.ray_offset import RayOffset
from nusselt.renderer.words import count

from .adaptive import render_until
from .bounds import bound_note
from .negative import negative_note
from .question import PixelRule, ShadowOrigin, check_sampling, chosen_estimator, number_within
from .rows import notes
from .unlit import unlit

TOLERANCE = 1e-3

Tiles = Callable[[int, int], None]
"""Progress: (tiles done, tiles in all)."""


def offset_asked(scene: Scene, origin: ShadowOrigin) -> RayOffset | None:
    """The rule by which shadow rays start, where it is not ours that is asked for."""
    return mitsuba_offset(scene) if origin == "mitsuba" else None


def draw_area(
    scene: Scene, estimator: Estimator, rule: PixelRule | None, tolerance: float, executor: Executor | None
) -> AreaImage | None:
    """Pixels by area without sampling, if that is asked for and the estimator has no noise in this scene."""
    needs = prepare(scene).needs
    if rule != "area" or estimator.is_random(needs):
        return None
    return render_area(scene, estimator, tolerance=tolerance, executor=executor)


@dataclass(frozen=True)
class Drawing:
    """What is asked of an image of ours.

    Parameters
    ----------
    estimator, samples, stratified, seed, shadow_origin, pixel_rule
        As in `Question`.
    tolerance : float or None
        Relative RMS error of noise-free pixels by area, or of interpolated centres; in (0, 1).
    error : float or None
        Sample until the relative RMS error is at most this; in (0, 1).

    Raises
    ------
    InputError
    """

    estimator: str | type[Estimator] | None = None
    samples: int | None = None
    stratified: bool | None = None
    seed: int = 0
    shadow_origin: ShadowOrigin = "surface"
    pixel_rule: PixelRule | None = None
    tolerance: float | None = None
    error: float | None = None

    def __post_init__(self) -> None:
        check_sampling(self, ("centre", "area"))
        if self.error is None:
            return
        number_within("error", self.error, 0, 1)
        for name in ("samples", "tolerance"):
            if getattr(self, name) is not None:
                raise InputError(name, getattr(self, name), "it left out: an error chooses its own")

    def of(self, scene: Scene) -> Estimator:
        """The estimator to use on a scene."""
        name = self.estimator or (None if self.error is None else "common-points")
        return chosen_estimator(scene, name, self.samples, self.stratified)


@dataclass(frozen=True)
class Drawn:
    """An image, and sentences about it: warnings, and what is known of its error."""

    image: Image
    warnings: tuple[str, ...]
    told: tuple[str, ...]


def draw(scene: Scene, drawing: Drawing, executor: Executor | None = None, progress: Tiles | None = None) -> Drawn:
    """Render a scene as asked."""
    estimator = drawing.of(scene)
    warnings, told = [*scene.warnings, *notes(scene, estimator)], []
    if drawing.error is not None:
        offset = offset_asked(scene, drawing.shadow_origin)
        reached = render_until(
            scene, estimator, drawing.error, seed=drawing.seed, executor=executor, progress=progress, offset=offset
        )
        image = reached.image
        passes = f"8 independent passes of {count(reached.samples, 'sample')}"
        said = f"relative RMS error {reached.error:.2g}, from {passes}"
        told.append(said if reached.error else "no sampling error")
    elif (by_tolerance := _by_tolerance(scene, estimator, drawing, executor)) is not None:
        image, tolerance = by_tolerance.image, drawing.tolerance or TOLERANCE
        if by_tolerance.error > tolerance:
            warnings.append(f"the error may be {by_tolerance.error:.1e}, above the tolerance {tolerance:g}")
    else:
        offset = offset_asked(scene, drawing.shadow_origin)
        image = render(
            scene, estimator, seed=drawing.seed, executor=executor, offset=offset, progress=progress, by_light=True
        )
    if image.back_faces:
        warnings.append(f"{count(image.back_faces, 'pixel', 'shows')} the black back of a one-sided surface")
    if image.bound is not None:
        told.append(bound_note(image))
    if not image.mean.any():
        warnings.append("the image is black all over" + "".join(f"; {why}" for why in unlit(scene)))
    if note := negative_note(image, estimator, estimator.claim(prepare(scene).needs)):
        warnings.append(note)
    return Drawn(image, tuple(warnings), tuple(told))


def _by_tolerance(
    scene: Scene, estimator: Estimator, drawing: Drawing, executor: Executor | None
) -> AreaImage | CentreImage | None:
    """Pixels by area, or centres with interpolation between them; None where neither is asked for or can be."""
    tolerance = drawing.tolerance or TOLERANCE
    between = drawing.pixel_rule == "centre" and drawing.tolerance is not None and drawing.shadow_origin != "mitsuba"
    if between and not estimator.is_random(prepare(scene).needs):
        return render_centre(scene, estimator, tolerance=tolerance, executor=executor)
    return draw_area(scene, estimator, drawing.pixel_rule, tolerance, executor)
