"""Every experiment, listed once, in the order in which the lecture and the README tell of them."""

from __future__ import annotations

from .analytic import ANALYTIC
from .calibration import CALIBRATION
from .closed_form_cost import CLOSED_FORM_COST
from .convergence import CONVERGENCE
from .cornell import CORNELL
from .error_against_time import ERROR_AGAINST_TIME
from .glossy import GLOSSY
from .light_units import LIGHT_UNITS
from .mesh import MESH
from .mesh_cost import MESH_COST
from .mesh_rays import MESH_RAYS
from .nusselt_analog import NUSSELT_ANALOG
from .offset import OFFSET
from .planted_defects import PLANTED_DEFECTS
from .random_scenes import RANDOM_SCENES
from .random_vs_stratified import RANDOM_VS_STRATIFIED
from .runs.declared import Experiment
from .soft_shadows import SOFT_SHADOWS
from .stability import STABILITY
from .unshadowed import UNSHADOWED
from .variance_table import VARIANCE_TABLE
from .visibility_only import VISIBILITY_ONLY

EXPERIMENTS: tuple[Experiment, ...] = (
    RANDOM_VS_STRATIFIED,
    ANALYTIC,
    NUSSELT_ANALOG,
    SOFT_SHADOWS,
    VISIBILITY_ONLY,
    LIGHT_UNITS,
    GLOSSY,
    CORNELL,
    MESH,
    CONVERGENCE,
    UNSHADOWED,
    STABILITY,
    CLOSED_FORM_COST,
    CALIBRATION,
    PLANTED_DEFECTS,
    OFFSET,
    VARIANCE_TABLE,
    ERROR_AGAINST_TIME,
    MESH_RAYS,
    MESH_COST,
    RANDOM_SCENES,
)
