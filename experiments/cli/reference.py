"""`nusselt reference`: Mitsuba's reference in a file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from nusselt.experiments.check.check import ROOM, Question
from nusselt.experiments.check.references import KeptReferences, write_reference
from nusselt.experiments.results.document import EXIT
from nusselt.experiments.scenes import catalogue
from nusselt.mitsuba_bridge.reference import ReferenceUnavailable
from nusselt.renderer.errors import InputError


def run_reference(name: str, output: Path, options: dict[str, Any], progress_bar: Callable[[str], Any]) -> int:
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
