"""Options of `nusselt check` for what a user brings."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click


def bring_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """The options for what a user brings."""
    kinds = click.Choice([".exr", ".png", ".pfm", ".hdr", ".npy"])
    for option in (
        click.option(
            "--transfer", default="linear", show_default=True, help="Curve of levels: linear, srgb, gamma:2.2."
        ),
        click.option("--quantisation", default="auto", show_default=True, help="Of levels: truncate, round or auto."),
        click.option("--renderer", metavar="COMMAND", help="A program with {scene} {xml} {samples} {seed} {output}."),
        click.option("--image-type", type=kinds, default=".exr", show_default=True, help="What {output} ends in."),
        click.option("--runs", type=click.IntRange(1, 256), default=4, show_default=True, help="Seeds of --renderer."),
        click.option("--steps", type=click.IntRange(1, 8), default=3, show_default=True, help="Times 4 samples each."),
        click.option("--run-timeout", type=click.FloatRange(0, min_open=True), default=600.0, show_default=True),
        click.option("--reference", type=click.Path(path_type=Path), help="A kept one; see: nusselt reference."),
        click.option("--cache", type=click.Path(path_type=Path), help="Folder to keep references in, by content."),
    ):
        command = option(command)
    return command
