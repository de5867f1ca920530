"""`nusselt export`."""

from __future__ import annotations

from pathlib import Path

import click

from nusselt.experiments.check.request import Reading
from nusselt.experiments.terminal.options import reading_options
from nusselt.experiments.terminal.places import Place
from nusselt.mitsuba_bridge.export import export_scene


@click.command()
@click.argument("scene")
@click.option("-o", "--output", type=Place(), required=True, help="SCENE.xml")
@reading_options
def command(*, scene: str, output: Path, reading: Reading) -> None:
    """Write SCENE as an equivalent Mitsuba scene (XML and PLY).

    A purely diffuse one loads in the stock `mitsuba` executable; a glossy one needs
    `python -m nusselt.mitsuba_bridge render SCENE.xml`, which registers the Phong surface first.
    """
    read = reading.scene(scene)
    for note in (*read.warnings, *export_scene(read, output)):
        click.echo(note, err=True)
