"""Arguments that a call does not have, refused as everything else that is wrong with one."""

from __future__ import annotations

import difflib
import functools
import inspect
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from nusselt.experiments.check.request import MODES
from nusselt.renderer.errors import InputError

P = ParamSpec("P")
R = TypeVar("R")
ELSEWHERE = "it left out: the command line alone has it"


def known_arguments(call: Callable[P, R]) -> Callable[P, R]:
    """A call whose unknown arguments are an `InputError` that says which it has like them."""
    known = [name for name, p in inspect.signature(call).parameters.items() if p.kind is not p.VAR_POSITIONAL]
    of_commands = frozenset[str]().union(*(mode.options for mode in MODES))

    @functools.wraps(call)
    def checked(*args: P.args, **said: P.kwargs) -> R:
        for name, value in said.items():
            if name in known:
                continue
            close = difflib.get_close_matches(name, known, 3, 0.5)
            like = f" ({', '.join(close)}?)" if close else f": {', '.join(known)}"
            accepted = f"an argument of nusselt.{call.__name__}{like}"
            raise InputError(name, value, ELSEWHERE if name in of_commands else accepted)
        return call(*args, **said)

    return checked
