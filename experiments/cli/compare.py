"""`nusselt compare`."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from nusselt.experiments.results.compare import compare
from nusselt.experiments.results.compare.files import write
from nusselt.experiments.terminal.places import Place


@click.command()
@click.argument("baseline", type=click.Path(path_type=Path), metavar="BASELINE.json")
@click.argument("results", type=click.Path(path_type=Path), metavar="RESULTS.json...", nargs=-1, required=True)
@click.option("--alpha", type=float, default=1e-3, show_default=True, help="Family-wise false-alarm rate.")
@click.option("--json", type=Place(dash=True), metavar="FILE|-", help="What was found as JSON ('-': standard output).")
@click.option("--junit", type=Place(), metavar="FILE", help="What was found as JUnit XML, a case a row.")
@click.option("--summary", type=Place(), metavar="FILE", help="What was found as Markdown.")
def command(baseline: Path, results: tuple[Path, ...], alpha: float, **files: Path | str | None) -> None:
    """What changed between two runs beyond their noise; 1 where anything is worse or missing. Time is told alone.

    Of more runs than two, the oldest first, the one in which each figure changed.

    \b
    nusselt compare baseline.json out/results.json --summary changes.md
    nusselt compare 2026-10.json 2026-11.json 2026-12.json
    """
    found = compare(baseline, *results, alpha=alpha)
    write(found, files)
    for line in found.lines():
        click.echo(line, err=files["json"] == "-")
    sys.exit(found.status)
