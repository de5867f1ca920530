"""`nusselt reference`: Mitsuba's reference in a file."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from nusselt.experiments.check.check import ROOM
from nusselt.experiments.check.question import Question
from nusselt.experiments.check.references import KeptReferences, write_reference
from nusselt.experiments.check.request import Reading
from nusselt.experiments.results.status import EXIT
from nusselt.experiments.terminal.options import reading_options, seed_option
from nusselt.experiments.terminal.places import Place
from nusselt.experiments.terminal.progress import progress_bar
from nusselt.mitsuba_bridge.reference import ReferenceUnavailable
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene
from nusselt.renderer.words import count


@click.command()
@click.argument("scene")
@click.option("-o", "--output", type=Place(), required=True, help="REF.npz")
@click.option("--margin", type=float, default=1e-3, show_default=True, help="The finest margin it is to serve.")
@seed_option
@click.option("--timeout", type=float, default=600.0, show_default=True, help="Seconds.")
@click.option("--cache", type=click.Path(path_type=Path), help="Folder to keep references in, by content.")
@reading_options
def command(
    *, scene: str, output: Path, margin: float, seed: int, timeout: float, cache: Path | None, reading: Reading
) -> None:
    """Write Mitsuba's reference of SCENE to a file, for places without Mitsuba: nusselt check --reference."""
    if output.suffix != ".npz":
        raise InputError("output", str(output), "a name that ends in .npz")
    question = Question(margin=margin, seed=seed, timeout=timeout)
    sys.exit(run_reference(reading.scene(scene), output, question, KeptReferences(None, cache)))


def run_reference(scene: Scene, output: Path, question: Question, references: KeptReferences) -> int:
    """Render and write one reference; returns the exit status."""
    target = question.margin / ROOM
    try:
        with progress_bar(scene.name) as report:
            found = references.get(scene, question, target, report)
    except ReferenceUnavailable as problem:
        click.echo(f"nusselt: {problem}", err=True)
        return EXIT["no reference"]
    write_reference(output, scene, found, target)
    made = f"{count(found.passes, 'pass')}, {count(found.samples, 'sample')} per light"
    click.echo(f"{output}: {scene.name} by Mitsuba {found.version}, {made}")
    return EXIT["as claimed"]
