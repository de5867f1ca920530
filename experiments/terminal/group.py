"""What every command does with what a user got wrong: one line, and exit status 2."""

from __future__ import annotations

import re
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NoReturn

import click

from nusselt.experiments.results.status import EXIT
from nusselt.renderer.errors import InputError, WorkerLost

from .usage import usage_line

ASKED = "nusselt.command"
"""Under which a group keeps the command it was asked for."""


class Ended(KeyboardInterrupt):
    """A signal to end, of a system or of a terminal that was closed: an interrupt by another name."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self.number = number


def _end(number: int, frame: object) -> NoReturn:
    signal.signal(number, signal.SIG_IGN)  # once is enough: the way out is not to be interrupted
    raise Ended(number)


@contextmanager
def _endings_heard() -> Iterator[None]:
    """Signals to end are interrupts meanwhile, where nobody else has a use for them."""
    known = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    here = threading.current_thread() is threading.main_thread()
    heard = [number for number in known if here and signal.getsignal(number) is signal.SIG_DFL]
    for number in heard:
        signal.signal(number, _end)
    try:
        yield
    finally:
        for number in heard:
            signal.signal(number, signal.SIG_DFL)


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
    except Ended as ended:
        stop(f"ended by {signal.Signals(ended.number).name}: what was finished is written", 128 + ended.number)
    except KeyboardInterrupt:
        stop("interrupted: what was finished is written", 130)


class Group(OneLine, click.Group):
    """The same for a group of commands."""

    def invoke(self, context: click.Context) -> Any:
        with _one_line(self, context), _endings_heard():
            return super().invoke(context)

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
    from nusselt.experiments.console import console, say  # takes a while, which nothing else here does

    say(console(stderr=True), f"nusselt: {message}")
    sys.exit(status)
