"""What every command does with what a user got wrong: one line, and exit status 2."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NoReturn

import click

from nusselt.experiments.results.status import EXIT
from nusselt.experiments.workers import WorkerLost
from nusselt.renderer.errors import InputError

from .usage import usage_line

ASKED = "nusselt.command"
"""Under which a group keeps the command it was asked for."""


class OneLine(click.Command):
    """Turns what a user got wrong into one line and exit status 2, whatever the command."""

    def make_context(self, *args: Any, **more: Any) -> click.Context:
        with _one_line(self):
            return super().make_context(*args, **more)

    def invoke(self, context: click.Context) -> Any:
        with _one_line(self, context):
            return super().invoke(context)


@contextmanager
def _one_line(command: click.Command, context: click.Context | None = None) -> Iterator[None]:
    try:
        yield
    except InputError as error:
        stop(str(as_written(error, context.meta.get(ASKED, command) if context else command)), EXIT["bad input"])
    except click.exceptions.NoArgsIsHelpError:
        raise  # nothing is wrong: it shows what there is
    except click.UsageError as error:
        stop(usage_line(error, context), EXIT["bad input"])
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
        known = self.list_commands(context)
        if words and words[0] not in known and not words[0].startswith("-"):
            raise InputError("command", words[0], "one of " + ", ".join(known))
        found = super().resolve_command(context, words)
        context.meta[ASKED] = found[1]
        return found


def as_written(error: InputError, command: click.Command) -> InputError:
    """An error that names the command's options as they are written there; what came from a file stays as it is."""
    if error.where:
        return error
    written = {str(o.name): max(o.opts, key=len) for o in command.params if isinstance(o, click.Option)}
    accepted = re.sub(r"\b\w+_\w+\b", lambda word: written.get(word[0], word[0]), error.accepted)
    return InputError(written.get(error.argument, error.argument), error.value, accepted)


def stop(message: str, status: int) -> NoReturn:
    """One line on standard error, and out."""
    click.echo(f"nusselt: {message}", err=True)
    sys.exit(status)
