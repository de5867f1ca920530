"""`nusselt run`."""

from __future__ import annotations

import sys
from typing import Any

import click

from nusselt.experiments.runs.experiment import Settings
from nusselt.experiments.runs.run import Request, chosen, run_experiments
from nusselt.experiments.studies.suite import EXPERIMENTS
from nusselt.experiments.terminal.options import cluster_option, export_options, reporting_options


@click.command()
@click.argument("names", metavar="NAME...|all", nargs=-1, required=True)
@click.option("--scenes", multiple=True, metavar="SCENE", help="Instead of the experiment's own; may be repeated.")
@reporting_options
@export_options
@cluster_option
def command(names: tuple[str, ...], scenes: tuple[str, ...], quick: bool, seed: int, **where: Any) -> None:
    """Run experiments; what is finished in the folder is not done again (see: nusselt list).

    \b
    nusselt run random-vs-stratified soft-shadows --out out
    nusselt run all --quick --out out
    """

    settings = Settings(quick, seed, tuple(scenes))
    sys.exit(run_experiments(chosen(names, EXPERIMENTS), Request(settings, **where)))
