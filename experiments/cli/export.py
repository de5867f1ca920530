"""`nusselt export`."""

from __future__ import annotations

from pathlib import Path

import click

from nusselt.experiments.scenes import catalogue
from nusselt.mitsuba_bridge.export import export_scene


@click.command()
@click.argument("scene")
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="SCENE.xml")
@click.option("--lenient", is_flag=True, help="Warn of unknown commands instead of refusing the scene.")
@click.option("--two-sided", is_flag=True, help="Surfaces reflect at their back too.")
def command(scene: str, output: Path, lenient: bool, two_sided: bool) -> None:
    """Write SCENE as an equivalent Mitsuba scene (XML and PLY).

    A purely diffuse one loads in the stock `mitsuba` executable; a glossy one needs
    `python -m nusselt.mitsuba_bridge render SCENE.xml`, which registers the Phong surface first.
    """

    read = catalogue.load(scene, lenient).with_(two_sided=two_sided)
    for note in (*read.warnings, *export_scene(read, output)):
        click.echo(note, err=True)
