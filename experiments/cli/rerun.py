"""The command that makes one row of a check again."""

from __future__ import annotations

import shlex
from typing import Any

import click

ELSEWHERE = ("classic", "out", "target", "scenes", "summary", "junit", "csv", "cache", "cluster")
"""Options of a check that no row depends on."""


def shell_command(check: click.Command, scene: str, options: dict[str, Any]) -> str:
    """The command, for a shell, without what is said by default."""
    words = ["nusselt", "check", scene]
    defaults = {param.name: param.default for param in check.params}
    for param in check.params:
        value = options.get(str(param.name))
        if param.name in ELSEWHERE or value is None or value == defaults[param.name]:
            continue
        if value is True:
            words.append(param.opts[0])
        elif value is False:
            words += param.secondary_opts
        else:
            words += [param.opts[0], str(value)]
    return shlex.join(words)
