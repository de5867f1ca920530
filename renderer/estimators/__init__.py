"""The estimators, each listed once: tests, experiments, report and documentation all iterate this tuple.

An estimator is a frozen dataclass with one pure vectorised call: shading points, one light and a random
generator in, reflected radiance (3, n) out. What it claims of itself is what the harness holds it to.
"""

from __future__ import annotations

from .analytic import Analytic
from .area import Area
from .area_lattice import AreaLattice
from .common_points import CommonPoints, CommonPointsFixed
from .control_variate import ControlVariate
from .exact import Exact
from .protocol import Claim, Estimator
from .solid_angle import SolidAngle
from .visibility_analytic import VisibilityAnalytic
from .visibility_centre import VisibilityCentre

ESTIMATORS: tuple[type[Estimator], ...] = (
    Analytic,
    Area,
    AreaLattice,
    SolidAngle,
    VisibilityCentre,
    VisibilityAnalytic,
    ControlVariate,
    CommonPoints,
    CommonPointsFixed,
    Exact,
)

__all__ = [
    "ESTIMATORS",
    "Analytic",
    "Area",
    "AreaLattice",
    "Claim",
    "CommonPoints",
    "CommonPointsFixed",
    "ControlVariate",
    "Estimator",
    "Exact",
    "SolidAngle",
    "VisibilityAnalytic",
    "VisibilityCentre",
    "estimator_named",
]


def estimator_named(name: str, samples: int, stratified: bool) -> Estimator:
    """The estimator called ``name`` with N samples per light.

    Raises
    ------
    InputError
        If no estimator has that name, or strata are asked of a number that is not a square.
    """
    from nusselt.renderer.errors import InputError

    for kind in ESTIMATORS:
        if kind.name == name:
            return kind(samples=samples, stratified=stratified)
    raise InputError("estimator", name, "one of " + ", ".join(kind.name for kind in ESTIMATORS))
