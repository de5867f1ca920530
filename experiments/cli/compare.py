"""`nusselt compare`."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from nusselt.experiments.results.compare import compare


@click.command()
@click.argument("baseline", type=click.Path(path_type=Path), metavar="BASELINE.json")
@click.argument("results", type=click.Path(path_type=Path), metavar="RESULTS.json")
@click.option("--alpha", type=float, default=1e-3, show_default=True, help="Family-wise false-alarm rate.")
def command(baseline: Path, results: Path, alpha: float) -> None:
    """What changed between two runs beyond their noise; 1 where anything is worse or missing. Time is told alone.

    \b
    nusselt compare baseline.json out/results.json
    """
    found = compare(baseline, results, alpha)
    for line in found.lines():
        click.echo(line)
    sys.exit(found.status)
