"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

cluster_option = click.option(
    "--cluster", metavar="ADDRESS", help="Of a Dask scheduler, tcp://HOST:PORT: work goes there; same numbers."
)


def sampling_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """The options that choose an estimator."""
    for option in (
        click.option("--estimator", metavar="NAME", help="Instead of the one the scene asks for; see: nusselt list."),
        click.option("--samples", type=click.IntRange(1, 1 << 24), help="Per light, instead of the scene's."),
        click.option("--stratify/--no-stratify", "stratified", default=None, help="Instead of the scene's."),
        click.option("--seed", type=click.IntRange(0, 2**63 - 1), default=0, show_default=True),
        click.option("--lenient", is_flag=True, help="Warn of unknown commands in a scene instead of refusing it."),
        click.option(
            "--shadow-origin",
            type=click.Choice(["surface", "mitsuba"]),
            default="surface",
            show_default=True,
            help="Where shadow rays start: ours, or Mitsuba 3.9's rule, to be wrong as it is.",
        ),
        click.option("--two-sided", is_flag=True, help="Surfaces reflect at their back too, on both renderers."),
        click.option("--pixel-rule", type=click.Choice(["centre", "area"]), help="Instead of the scene's."),
        click.option(
            "--tolerance",
            type=float,
            help="Relative RMS error of noise-free pixels by area; render: or of interpolated centres.",
        ),
    ):
        command = option(command)
    return command


def export_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """The options that write results for other programs."""
    for name, words in (("csv", "CSV"), ("junit", "JUnit XML"), ("summary", "Markdown under 1 MiB")):
        help_text = f"Write the rows there as {words}."
        command = click.option(f"--{name}", metavar="FILE", type=click.Path(dir_okay=False), help=help_text)(command)
    return command


def reporting_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """The options of every experiment."""
    for option in (
        click.option("--quick", is_flag=True, help="Small images, few samples."),
        click.option("--seed", type=click.IntRange(0, 2**63 - 1), default=0, show_default=True),
        click.option("--out", type=click.Path(path_type=Path), help="Folder for figures, tables and results.json."),
        click.option("--json", "target", metavar="FILE|-", help="Write the results there ('-': standard output)."),
    ):
        command = option(command)
    return command
