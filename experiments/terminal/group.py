"""What every command does with what a user got wrong: one line, and exit status 2."""

from __future__ import annotations

import sys
from typing import Any, NoReturn

import click

from nusselt.experiments.results.document import EXIT
from nusselt.experiments.workers import WorkerLost
from nusselt.renderer.errors import InputError


class OneLine(click.Command):
    """Turns what a user got wrong into one line and exit status 2, whatever the command."""

    def invoke(self, context: click.Context) -> Any:
        try:
            return super().invoke(context)
        except InputError as error:
            stop(str(error), EXIT["bad input"])
        except WorkerLost as error:
            stop(str(error), EXIT["not as claimed"])
        except KeyboardInterrupt:
            stop("interrupted: what was finished is written", 130)


class Group(OneLine, click.Group):
    """The same for a group of commands."""


def stop(message: str, status: int) -> NoReturn:
    """One line on standard error, and out."""
    click.echo(f"nusselt: {message}", err=True)
    sys.exit(status)
