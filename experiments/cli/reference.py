"""`nusselt reference`: Mitsuba's reference in a file."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from nusselt.experiments.check.check import ROOM, Question
from nusselt.experiments.check.references import KeptReferences, write_reference
from nusselt.experiments.results.document import EXIT
from nusselt.experiments.scenes import catalogue
from nusselt.experiments.terminal.progress import progress_bar
from nusselt.mitsuba_bridge.reference import ReferenceUnavailable
from nusselt.renderer.errors import InputError


@click.command()
@click.argument("scene")
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="REF.npz")
@click.option("--margin", type=float, default=1e-3, show_default=True, help="The finest margin it is to serve.")
@click.option("--seed", type=click.IntRange(0, 2**63 - 1), default=0, show_default=True)
@click.option("--timeout", type=float, default=600.0, show_default=True, help="Seconds.")
@click.option("--cache", type=click.Path(path_type=Path), help="Folder to keep references in, by content.")
@click.option("--lenient", is_flag=True, help="Warn of unknown commands in a scene instead of refusing it.")
@click.option("--two-sided", is_flag=True, help="Surfaces reflect at their back too.")
def command(scene: str, output: Path, **options: Any) -> None:
    """Write Mitsuba's reference of SCENE to a file, for places without Mitsuba: nusselt check --reference."""

    sys.exit(run_reference(scene, output, options))


def run_reference(name: str, output: Path, options: dict[str, Any]) -> int:
    """Render and write one reference; returns the exit status."""
    if output.suffix != ".npz":
        raise InputError("output", str(output), "a name that ends in .npz")
    if not 0 < options["margin"] <= 1:
        raise InputError("--margin", options["margin"], "a number above 0, at most 1")
    scene = catalogue.load(name, options["lenient"]).with_(two_sided=options["two_sided"])
    question = Question(margin=options["margin"], seed=options["seed"], timeout=options["timeout"])
    target = question.margin / ROOM
    try:
        with progress_bar(scene.name) as report:
            found = KeptReferences(None, options["cache"]).get(scene, question, target, report)
    except ReferenceUnavailable as problem:
        click.echo(f"nusselt: {problem}", err=True)
        return EXIT["no reference"]
    write_reference(output, scene, found, target)
    click.echo(
        f"{output}: {scene.name} by Mitsuba {found.version}, {found.passes} passes, {found.samples} samples per light"
    )
    return EXIT["as claimed"]
