"""The closed forms on stiff cases, and whole images against their twins."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.experiments.studies.stability.cases import OWN, Case, read_cases
from nusselt.experiments.studies.stability.closed_forms import case_rows
from nusselt.experiments.studies.stability.figures import error_figures
from nusselt.experiments.studies.stability.images import twin_row
from nusselt.experiments.studies.stability.lights import LightCase, light_rows, read_lights
from nusselt.experiments.studies.stability.twins import Twin, twins


def cases_job(cases: Sequence[Case], seed: int, ask: bool) -> Outcome:
    """Rows of the closed forms; as claimed where the bound holds."""
    return _claimed(case_rows(cases, seed, ask))


def twin_job(twin: Twin, seed: int, ask: bool) -> Outcome:
    """The row of one twin."""
    return _claimed(twin_row(twin, seed, ask))


def lights_job(cases: Sequence[LightCase]) -> Outcome:
    """Rows of all kinds of lights."""
    return _claimed(light_rows(cases))


def _claimed(outcome: Outcome) -> Outcome:
    return Outcome([row | {"as_claimed": row["bound_held"]} for row in outcome.rows], outcome.arrays)


def file_jobs(files: Sequence[str], settings: Settings) -> list[Job]:
    """Jobs for the cases of these files alone; every file is read before any is run."""
    ask = not settings.quick
    return [
        Job(cases_job, {"cases": read_cases(Path(name)), "seed": settings.seed_of(name), "ask": ask}, alone=True)
        for name in files
    ]


def jobs(settings: Settings) -> list[Job]:
    """The project's own cases, and the twins."""
    every, ask = settings.pick((1, True), (1, False), (12, False))
    own = {"cases": read_cases(OWN)[::every], "seed": settings.seed_of("own"), "ask": ask}
    images = [
        Job(twin_job, {"twin": twin, "seed": settings.seed_of(twin.name), "ask": ask}, alone=twin.ask)
        for twin in twins()[::every]
    ]
    return [Job(cases_job, own, alone=True), Job(lights_job, {"cases": read_lights()[::every]}), *images]


STABILITY = Experiment(
    "stability",
    "closed forms on stiff cases against many digits, and images against their scaled, moved or exact twins",
    jobs,
    error_figures,
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(STABILITY)
