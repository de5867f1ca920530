"""`nusselt export`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import click

from nusselt.experiments.check.request import Reading
from nusselt.experiments.exchange.export import WRITERS, write_text
from nusselt.experiments.terminal.options import reading_options
from nusselt.experiments.terminal.places import Place
from nusselt.mitsuba_bridge.export import export_scene
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene

FORMATS: dict[str, Callable[[Scene, Path], list[str]]] = {".xml": export_scene, **dict.fromkeys(WRITERS, write_text)}


@click.command()
@click.argument("scene")
@click.option("-o", "--output", type=Place(), required=True, help="SCENE.xml, SCENE.pbrt or SCENE.usda")
@reading_options
def command(*, scene: str, output: Path, reading: Reading) -> None:
    """Write SCENE as an equivalent scene of Mitsuba (XML and PLY), pbrt-v4 or USD, by the ending of the name.

    For Mitsuba, a purely diffuse one loads in the stock `mitsuba` executable; a glossy one needs
    `python -m nusselt.mitsuba_bridge render SCENE.xml`, which registers the Phong surface first. The others hold
    diffuse surfaces alone.
    """
    write = FORMATS.get(output.suffix.lower())
    if write is None:
        raise InputError("output", str(output), f"a name that ends in {', '.join(FORMATS)}")
    read = reading.scene(scene)
    for note in (*read.warnings, *write(read, output)):
        click.echo(note, err=True)
