"""The command that makes a row again."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence

import click

from nusselt.experiments.terminal.options import said_in

ELSEWHERE = ("classic", "out", "target", "scenes", "summary", "junit", "csv", "cache", "cluster", "verbose")
"""Options of a check that no row depends on, here or from Python."""


def option_words(param: click.Parameter, value: object) -> list[str]:
    """An option as it is written to give it this value."""
    if value is True:
        return [param.opts[0]]
    if value is False:
        return list(param.secondary_opts)
    return [word for one in (value if isinstance(value, tuple) else (value,)) for word in (param.opts[0], str(one))]


def said_words(context: click.Context, elsewhere: Sequence[str]) -> list[str]:
    """The options that were said, but for these."""
    said = said_in(context)
    params = [param for param in context.command.params if param.name in said and param.name not in elsewhere]
    return [word for param in params for word in option_words(param, said[str(param.name)])]


def shell_command(check: click.Command, scene: str, options: Mapping[str, object], images: Sequence[str] = ()) -> str:
    """The command, for a shell, without what is said by default; ``options`` by their parameters' names."""
    words = ["nusselt", "check", scene]
    for param in check.params:
        value = options.get(str(param.name))
        needed = param.name == "out" and options.get("until_decided")  # its passes are kept there
        if (param.name in ELSEWHERE and not needed) or value is None or value == param.default:
            continue
        words += option_words(param, value)
    return shlex.join([*words, *images])
