"""Experiments as a script of their own."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from nusselt.experiments.terminal.group import OneLine
from nusselt.experiments.terminal.options import cluster_option, export_options, reporting_options

from .experiment import Experiment, Settings
from .run import Request, run_experiments


def script(*experiments: Experiment) -> None:
    """What `python experiments/studies/NAME.py` does: the same as `nusselt run NAME`."""

    @click.command(cls=OneLine, help="; ".join(experiment.summary for experiment in experiments))
    @click.option("--scenes", multiple=True, metavar="SCENE", help="Instead of its own; may be repeated.")
    @reporting_options
    @export_options
    @cluster_option
    def command(scenes: tuple[str, ...], quick: bool, seed: int, **where: Any) -> None:
        settings = Settings(quick, seed, tuple(scenes))
        sys.exit(run_experiments(experiments, Request(settings, **where)))

    command(prog_name=Path(sys.argv[0]).name)
