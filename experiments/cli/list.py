"""`nusselt list`."""

from __future__ import annotations

import click

from nusselt.experiments.scenes import catalogue
from nusselt.experiments.scenes.procedural import GENERATED
from nusselt.experiments.studies.suite import EXPERIMENTS
from nusselt.renderer.estimators import ESTIMATORS


@click.command(name="list")
def command() -> None:
    """Scenes, estimators and experiments, one line each."""
    click.echo("scenes")
    for name in (*catalogue.CLASSIC, *GENERATED):
        click.echo(f"  {name:18} {catalogue.summary(name)}")
    click.echo("estimators")
    for kind in ESTIMATORS:
        click.echo(f"  {kind.name:18} {kind.summary}")
    click.echo("experiments")
    for experiment in EXPERIMENTS:
        click.echo(f"  {experiment.name:20} {experiment.summary}")
