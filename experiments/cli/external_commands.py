"""The commands `nusselt reference` and `nusselt test-estimator`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click


@click.command()
@click.argument("scene")
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="REF.npz")
@click.option("--margin", type=float, default=1e-3, show_default=True, help="The finest margin it is to serve.")
@click.option("--seed", type=click.IntRange(0, 2**63 - 1), default=0, show_default=True)
@click.option("--timeout", type=float, default=600.0, show_default=True, help="Seconds.")
@click.option("--cache", type=click.Path(path_type=Path), help="Folder to keep references in, by content.")
@click.option("--lenient", is_flag=True, help="Warn of unknown commands in a scene instead of refusing it.")
@click.option("--two-sided", is_flag=True, help="Surfaces reflect at their back too.")
def reference(scene: str, output: Path, **options: Any) -> None:
    """Write Mitsuba's reference of SCENE to a file, for places without Mitsuba: nusselt check --reference."""
    from .reference import run_reference

    sys.exit(run_reference(scene, output, options, _bar()))


@click.command(name="test-estimator")
@click.argument("estimator", metavar="PACKAGE.MODULE:NAME")
@click.option("--json", "target", metavar="FILE|-", help="Write the results there ('-': standard output).")
@click.option("--seed", type=click.IntRange(0, 2**63 - 1), default=0, show_default=True)
def trial_estimator(estimator: str, target: str | None, seed: int) -> None:
    """Put an estimator of yours through every test ours go through.

    \b
    nusselt test-estimator my_package.my_module:MyEstimator
    """
    from .conformance import run_trials

    sys.exit(run_trials(estimator, seed, target, _bar()))


def _bar() -> Any:
    from .main import progress_bar

    return progress_bar
