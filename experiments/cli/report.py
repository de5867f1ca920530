"""`nusselt report`."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from nusselt.experiments.results.report import write_report
from nusselt.experiments.results.status import EXIT
from nusselt.experiments.terminal.places import Place
from nusselt.experiments.terminal.progress import progress_bar


@click.command()
@click.argument("folder", type=click.Path(path_type=Path), metavar="OUT")
@click.option("-o", "--output", type=Place(), required=True, help="REPORT.html")
@click.option("--precise", is_flag=True, help="Images in four times the bytes: more bits, more pixels.")
def command(folder: Path, output: Path, precise: bool) -> None:
    """One offline HTML file from the folder OUT alone: verdicts, images to flip through, figures.

    Exit status 1 where nothing was measured.

    \b
    nusselt check --classic --out out; nusselt report out -o report.html
    """
    with progress_bar("report") as tell:
        rows = write_report(folder, output, tell, precise)
    sys.exit(EXIT["as claimed" if rows else "not as claimed"])
