"""`nusselt doctor`."""

from __future__ import annotations

import sys

import click

from nusselt.experiments.console import console
from nusselt.experiments.results.document import machine, package_versions
from nusselt.experiments.results.status import EXIT
from nusselt.mitsuba_bridge.llvm import backend_report


@click.command()
def command() -> None:
    """Versions, variants, which LLVM and why; what is missing and the command that mends it."""
    told = console()
    for name, value in machine().items():
        told.print(f"{name:20} {value}", markup=False)
    missing = []
    for package, version in package_versions().items():
        told.print(f"{package:20} {version or 'missing'}", markup=False)
        if version is None:
            missing.append(package)
    ready, lines = backend_report()
    for line in lines:
        told.print(line, markup=False)
    for package in missing:
        told.print(f"missing: {package}; mend with: pip install {package}", markup=False)
    sys.exit(EXIT["as claimed"] if ready else EXIT["no reference"])
