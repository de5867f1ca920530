"""Every experiment, listed once, in the order in which the lecture and the README tell of them."""

from __future__ import annotations

from nusselt.experiments.runs.experiment import Experiment
from nusselt.experiments.studies.against_mitsuba import CORNELL, MESH, UNSHADOWED
from nusselt.experiments.studies.analytic import ANALYTIC
from nusselt.experiments.studies.calibration import CALIBRATION
from nusselt.experiments.studies.closed_form_cost import CLOSED_FORM_COST
from nusselt.experiments.studies.convergence import CONVERGENCE
from nusselt.experiments.studies.glossy import GLOSSY
from nusselt.experiments.studies.honest_images import HONEST_IMAGES
from nusselt.experiments.studies.light_units import LIGHT_UNITS
from nusselt.experiments.studies.mesh_cost import MESH_COST
from nusselt.experiments.studies.mesh_rays import MESH_RAYS
from nusselt.experiments.studies.metamorphic_mistakes import METAMORPHIC_MISTAKES
from nusselt.experiments.studies.museum import MUSEUM_STUDY
from nusselt.experiments.studies.nusselt_analog import NUSSELT_ANALOG
from nusselt.experiments.studies.offset import OFFSET
from nusselt.experiments.studies.planted_defects import PLANTED_DEFECTS
from nusselt.experiments.studies.planted_images import PLANTED_IMAGES
from nusselt.experiments.studies.planted_mistakes import PLANTED_MISTAKES
from nusselt.experiments.studies.public_tables.study import PUBLIC_TABLES
from nusselt.experiments.studies.race.study import ERROR_AGAINST_TIME
from nusselt.experiments.studies.random_scenes import RANDOM_SCENES
from nusselt.experiments.studies.random_vs_stratified import RANDOM_VS_STRATIFIED
from nusselt.experiments.studies.soft_shadows import SOFT_SHADOWS
from nusselt.experiments.studies.stability.study import STABILITY
from nusselt.experiments.studies.variance_table import VARIANCE_TABLE
from nusselt.experiments.studies.visibility_only import VISIBILITY_ONLY

EXPERIMENTS: tuple[Experiment, ...] = (
    RANDOM_VS_STRATIFIED,
    ANALYTIC,
    PUBLIC_TABLES,
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
    PLANTED_MISTAKES,
    HONEST_IMAGES,
    PLANTED_IMAGES,
    METAMORPHIC_MISTAKES,
    MUSEUM_STUDY,
    OFFSET,
    VARIANCE_TABLE,
    ERROR_AGAINST_TIME,
    MESH_RAYS,
    MESH_COST,
    RANDOM_SCENES,
)
