"""What every command does with what a user got wrong: one line, and exit status 2."""

from __future__ import annotations

import sys
from typing import Any, NoReturn

import click

from nusselt.experiments.results.document import EXIT
from nusselt.experiments.workers import WorkerLost
from nusselt.renderer.errors import InputError

ASKED = "nusselt.command"
"""Under which a group keeps the command it was asked for."""


class OneLine(click.Command):
    """Turns what a user got wrong into one line and exit status 2, whatever the command."""

    def invoke(self, context: click.Context) -> Any:
        try:
            return super().invoke(context)
        except InputError as error:
            stop(str(as_written(error, context.meta.get(ASKED, self))), EXIT["bad input"])
        except WorkerLost as error:
            stop(str(error), EXIT["not as claimed"])
        except KeyboardInterrupt:
            stop("interrupted: what was finished is written", 130)


class Group(OneLine, click.Group):
    """The same for a group of commands."""

    def resolve_command(
        self, context: click.Context, words: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The command asked for, which an error's argument is looked up in."""
        found = super().resolve_command(context, words)
        context.meta[ASKED] = found[1]
        return found


def as_written(error: InputError, command: click.Command) -> InputError:
    """An error that names an option of the command as it is written there; what came from a file stays as it is."""
    if error.where:
        return error
    for option in command.params:
        if isinstance(option, click.Option) and option.name == error.argument:
            return InputError(max(option.opts, key=len), error.value, error.accepted)
    return error


def stop(message: str, status: int) -> NoReturn:
    """One line on standard error, and out."""
    click.echo(f"nusselt: {message}", err=True)
    sys.exit(status)
