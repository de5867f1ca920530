"""What is wrong with words on a command line, said as everything else that is wrong: value, and what is accepted."""

from __future__ import annotations

import math

import click
from click.types import FloatParamType, FloatRange, IntParamType, IntRange

from nusselt.renderer.errors import InputError


def usage_line(error: click.UsageError, context: click.Context | None) -> str:
    """One line: what is wrong, what is accepted, and where all is told."""
    told = error.ctx or context  # an option without its value comes without
    return f"{_said(error)} (see {told.command_path} --help)" if told else _said(error)


def _said(error: click.UsageError) -> str:
    param = error.param if isinstance(error, click.BadParameter) else None
    if param is None or not isinstance(param, click.Option | click.Argument):
        message = " ".join(error.format_message().split()).replace(". (D", " (d")
        return message[:1].lower() + message[1:].rstrip(".")
    name = max(param.opts, key=len) if isinstance(param, click.Option) else param.human_readable_name
    if isinstance(error, click.MissingParameter):
        return str(InputError(name, "missing", getattr(param, "help", None) or "one"))
    value, _, rest = error.message.partition(" is not ")
    return str(InputError(name, value.strip("'"), accepted(param.type) or f"what is {rest}"))


def accepted(kind: object) -> str:
    """What a kind of value accepts, as a noun phrase; empty where that is not known."""
    if isinstance(kind, click.Choice):
        return "one of " + ", ".join(map(str, kind.choices))
    if isinstance(kind, IntRange) and kind.min is not None and kind.max is not None:
        return f"a whole number from {kind.min} to {kind.max}"
    if isinstance(kind, FloatRange) and kind.min is not None and kind.max in (None, math.inf):
        return f"a number above {kind.min:g}" if kind.min_open else f"a number of at least {kind.min:g}"
    return (
        "a whole number" if isinstance(kind, IntParamType) else "a number" if isinstance(kind, FloatParamType) else ""
    )
