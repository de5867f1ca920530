"""`nusselt run`."""

from __future__ import annotations

import sys

import click

from nusselt.experiments.runs.experiment import Settings
from nusselt.experiments.runs.run import Request, chosen, run_experiments
from nusselt.experiments.studies.suite import EXPERIMENTS
from nusselt.experiments.terminal.options import (
    Exports,
    Output,
    cluster_option,
    exports_options,
    output_options,
    quick_option,
    seed_option,
)


@click.command()
@click.argument("names", metavar="NAME...|all", nargs=-1, required=True)
@click.option("--scenes", multiple=True, metavar="SCENE", help="Instead of the experiment's own; may be repeated.")
@quick_option
@seed_option
@output_options
@exports_options
@cluster_option
def command(
    *,
    names: tuple[str, ...],
    scenes: tuple[str, ...],
    quick: bool,
    seed: int,
    output: Output,
    exports: Exports,
    cluster: str | None,
) -> None:
    """Run experiments; what is finished in the folder is not done again (see: nusselt list).

    \b
    nusselt run random-vs-stratified soft-shadows --out out
    nusselt run all --quick --out out
    """

    request = Request(Settings(quick, seed, scenes), cluster=cluster, **vars(output), **vars(exports))
    sys.exit(run_experiments(chosen(names, EXPERIMENTS), request))
