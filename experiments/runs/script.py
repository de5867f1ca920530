"""Experiments as a script of their own."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from nusselt.experiments.terminal.group import OneLine
from nusselt.experiments.terminal.options import (
    Exports,
    Output,
    cluster_option,
    exports_options,
    output_options,
    quick_option,
    seed_option,
)

from .experiment import Experiment, Settings
from .run import Request, run_experiments


def script(*experiments: Experiment) -> None:
    """What `python experiments/studies/NAME.py` does: the same as `nusselt run NAME`."""

    @click.command(cls=OneLine, help="; ".join(experiment.summary for experiment in experiments))
    @click.option("--scenes", multiple=True, metavar="SCENE", help="Instead of its own; may be repeated.")
    @quick_option
    @seed_option
    @output_options
    @exports_options
    @cluster_option
    def command(
        *, scenes: tuple[str, ...], quick: bool, seed: int, output: Output, exports: Exports, cluster: str | None
    ) -> None:
        request = Request(Settings(quick, seed, scenes), cluster=cluster, **vars(output), **vars(exports))
        sys.exit(run_experiments(experiments, request))

    command(prog_name=Path(sys.argv[0]).name)
