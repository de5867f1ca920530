"""`nusselt list`."""

from __future__ import annotations

import click

from nusselt.experiments.console import console
from nusselt.experiments.scenes import catalogue
from nusselt.experiments.scenes.procedural import GENERATED
from nusselt.experiments.studies.suite import EXPERIMENTS
from nusselt.renderer.estimators import ESTIMATORS


@click.command(name="list")
def command() -> None:
    """Scenes, estimators and experiments, one line each."""
    lists = {
        "scenes": {name: catalogue.summary(name) for name in (*catalogue.CLASSIC, *GENERATED)},
        "estimators": {kind.name: kind.summary for kind in ESTIMATORS},
        "experiments": {experiment.name: experiment.summary for experiment in EXPERIMENTS},
    }
    page = click.HelpFormatter(width=console().width)
    for kind, entries in lists.items():
        with page.section(kind):
            page.write_dl(list(entries.items()))
    click.echo(page.getvalue().strip())
