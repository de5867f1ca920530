"""`nusselt run`."""

from __future__ import annotations

import sys

import click

from nusselt.experiments.runs.experiment import Settings
from nusselt.experiments.runs.own import own_of
from nusselt.experiments.runs.run import Request, chosen, run_experiments
from nusselt.experiments.studies.suite import EXPERIMENTS
from nusselt.experiments.terminal.options import (
    Exports,
    Output,
    OwnWords,
    cluster_option,
    exports_options,
    output_options,
    own_options,
    quick_option,
    seed_option,
)
from nusselt.renderer.errors import InputError


@click.command()
@click.argument("names", metavar="NAME...|all", nargs=-1, required=True)
@click.option("--scenes", multiple=True, metavar="SCENE", help="Instead of the experiment's own; may be repeated.")
@quick_option
@click.option("--long", is_flag=True, help="Mitsuba's times measured where they are bounds: hours.")
@seed_option
@output_options
@exports_options
@cluster_option
@own_options
def command(
    *,
    names: tuple[str, ...],
    scenes: tuple[str, ...],
    quick: bool,
    long: bool,
    seed: int,
    output: Output,
    exports: Exports,
    cluster: str | None,
    own: OwnWords,
) -> None:
    """Run experiments; what is finished in the folder is not done again (see: nusselt list).

    \b
    nusselt run random-vs-stratified soft-shadows --out out
    nusselt run all --quick --out out
    nusselt run variance-table convergence --with my_module:Mine --out out
    """
    experiments = chosen(names, EXPERIMENTS)
    settings = Settings(quick, seed, scenes, own=own_of(own.with_estimator, own.with_renderer), long=long)
    for experiment in experiments:
        if settings.own.words and not experiment.takes_own:
            takers = ", ".join(one.name for one in EXPERIMENTS if one.takes_own)
            raise InputError("experiment", experiment.name, f"one that looks at yours too: {takers}")
        if long and (quick or not experiment.takes_long):
            takers = ", ".join(one.name for one in EXPERIMENTS if one.takes_long)
            raise InputError("long", True, f"it without --quick, of {takers}")
    request = Request(settings, cluster=cluster, **vars(output), **vars(exports))
    sys.exit(run_experiments(experiments, request))
