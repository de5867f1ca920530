"""The planted defects, each with the scene that shows it, and the controls, which are right."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from nusselt.renderer.estimators import Analytic, Area, AreaLattice, ControlVariate, Exact
from nusselt.renderer.image import Image, render
from nusselt.renderer.scene import Scene

from . import estimators, images, scenes
from .estimators import gain

RIGHT = Area(samples=64, stratified=True)
MARGIN = 1e-3
FINE = 2e-4
"""The margin at which a gain of 0.999 must be found."""


def _as_it_is(scene: Scene) -> Scene:
    return scene


@dataclass(frozen=True)
class Planted:
    """A wrong renderer.

    Parameters
    ----------
    name : str
    scene : callable
        What shows it.
    estimator : Estimator
    render : callable
        Instead of `nusselt.renderer.image.render`.
    convert : callable
        What the converter makes of the scene before Mitsuba sees it.
    margin : float
    """

    name: str
    scene: Callable[[], Scene]
    estimator: Any = RIGHT
    render: Callable[..., Image] = render
    convert: Callable[[Scene], Scene] = _as_it_is
    margin: float = MARGIN


DEFECTS = (
    Planted("gain 0.98", scenes.penumbra, gain(0.98)),
    Planted("gain 0.999", scenes.open_floor, gain(0.999), margin=FINE),
    Planted("no cosine at the surface", scenes.open_floor, estimators.no_surface_cosine()),
    Planted("no cosine at the light", scenes.open_floor, estimators.no_light_cosine()),
    Planted("1/r for 1/r^2", scenes.open_floor, estimators.one_over_r()),
    Planted("light area 1 % too large", scenes.open_floor, estimators.light_area(1.01)),
    Planted("light's normal flipped", scenes.open_floor, estimators.flipped_light()),
    Planted("light from its back", scenes.behind_the_light, estimators.two_sided_light()),
    Planted("albedo not over pi", scenes.open_floor, estimators.no_pi()),
    Planted("(s+1) for (s+2)", scenes.lobes, estimators.other_norm()),
    Planted("lobe not clamped", scenes.lobes, estimators.unclamped_lobe()),
    Planted("half a pixel off", scenes.penumbra, render=images.half_pixel),
    Planted("fov off by 0.5 degrees", scenes.penumbra, render=images.other_fov),
    Planted("no gap at the light", scenes.near_ceiling, estimators.no_gap()),
    Planted("shadow rays 1 % short", scenes.near_blocker, estimators.short_rays()),
    Planted("a light forgotten", scenes.three_lights, estimators.forgotten_light(1)),
    Planted("strata at their corners", scenes.penumbra, estimators.stratum_corners()),
    Planted("offsets shared by all", scenes.penumbra, estimators.shared_offsets()),
    Planted("parallelogram as rectangle", scenes.sheared, estimators.sheared_as_rectangle()),
    Planted("density in another measure", scenes.open_floor, estimators.area_measure()),
    Planted("passes share their seed", scenes.penumbra, estimators.same_seed()),
    Planted("one NaN", scenes.penumbra, estimators.one_nan()),
    Planted("emission once per light", scenes.three_lights, render=images.emission_per_light),
    Planted("one triangle inverted", scenes.penumbra, estimators.inverted_triangle(2)),
    Planted("matrix transposed", scenes.turned_ellipsoid, convert=images.transposed),
    Planted("image mirrored", scenes.penumbra, render=images.mirrored),
    Planted("channels swapped", scenes.colours, render=images.swapped_channels),
    Planted("sums in float16", scenes.small_lamps, render=images.half_floats),
    Planted("sun's radius as diameter", scenes.umbra, estimators.wide_sun()),
    Planted("point light without square", scenes.small_lamps, estimators.linear_point()),
)


@dataclass(frozen=True)
class Control:
    """A right renderer against another.

    Parameters
    ----------
    scene : callable
    estimator : Estimator or None
        Ours; None: Mitsuba, with other seeds.
    against : Estimator or None
        What it is compared with; None: Mitsuba.
    margin : float
    """

    scene: Callable[[], Scene]
    estimator: Any = RIGHT
    against: Any = None
    margin: float = MARGIN


UNBIASED = (Area(samples=64), RIGHT, AreaLattice(samples=64), ControlVariate(samples=64, stratified=True), Exact())

CONTROLS = (
    *(Control(scene) for scene in dict.fromkeys(planted.scene for planted in DEFECTS)),
    Control(scenes.open_floor, margin=FINE),
    Control(scenes.open_floor, Analytic()),
    Control(scenes.penumbra, None),
    *(Control(scenes.penumbra, estimator) for estimator in UNBIASED if estimator != RIGHT),
    *(Control(scenes.penumbra, a, b) for k, a in enumerate(UNBIASED) for b in UNBIASED[k:]),
)
"""Every defect's scene, rightly rendered; ours against ours with other seeds, and every pair of right ones."""
