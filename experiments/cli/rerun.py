"""The command that makes one row of a check again."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence

import click

ELSEWHERE = ("classic", "out", "target", "scenes", "summary", "junit", "csv", "cache", "cluster", "verbose")
"""Options of a check that no row depends on, here or from Python."""


def shell_command(check: click.Command, scene: str, options: Mapping[str, object], images: Sequence[str] = ()) -> str:
    """The command, for a shell, without what is said by default; ``options`` by their parameters' names."""
    words = ["nusselt", "check", scene]
    for param in check.params:
        value = options.get(str(param.name))
        needed = param.name == "out" and options.get("until_decided")  # its passes are kept there
        if (param.name in ELSEWHERE and not needed) or value is None or value == param.default:
            continue
        if value is True:
            words.append(param.opts[0])
        elif value is False:
            words += param.secondary_opts
        else:
            for one in value if isinstance(value, tuple) else (value,):
                words += [param.opts[0], str(one)]
    return shlex.join([*words, *images])
