"""Whether worker processes can be started from the script that runs: each of them imports it again.

Python's `spawn` has a worker import the main script before its first work. A script that asks for an image at its top
level would ask for it again in every worker; so its source is looked at, and work stays in the one process.
"""

from __future__ import annotations

import ast
import os
import sys
import threading
from collections.abc import Iterable, Iterator
from functools import partial
from importlib.machinery import PathFinder
from types import FrameType, ModuleType
from typing import Any

DEEP = 3
"""Work holds a job, a job an estimator."""
GUARD = 'if __name__ == "__main__":'


def unguarded() -> str:
    """Why workers must not be started, with the line that mends it; empty if they may."""
    main = sys.modules.get("__main__")
    path = getattr(main, "__file__", None)
    spec = getattr(main, "__spec__", None)
    if main is None or path is None or (spec is not None and spec.name.endswith("__main__")):
        return ""  # a notebook, `python -c`, `python -m package`: nothing is imported again
    line = _line_of(main)
    if line is not None and _guarded(path, line):
        return ""
    where = f"{os.path.basename(path)}, line {line}" if line else os.path.basename(path)
    return f"rendered in one process: for all cores put what calls nusselt ({where}) under {GUARD}"


def _line_of(main: ModuleType) -> int | None:
    """The line of the main script at which the main thread is; None if it has run to its end."""
    frame: FrameType | None = sys._current_frames().get(threading.main_thread().ident or 0)
    while frame is not None:
        if frame.f_globals is main.__dict__ and frame.f_code.co_name == "<module>":
            return frame.f_lineno
        frame = frame.f_back
    return None


def _guarded(path: str, line: int) -> bool:
    """Whether a line of a script stands under an `if` that looks at ``__name__``."""
    try:
        with open(path, "rb") as stream:
            tree = ast.parse(stream.read())
    except (OSError, SyntaxError, ValueError):
        return False
    return any(
        isinstance(node, ast.If)
        and node.lineno <= line <= (node.end_lineno or 0)
        and any(isinstance(part, ast.Name) and part.id == "__name__" for part in ast.walk(node.test))
        for node in ast.walk(tree)
    )


def portable(values: Iterable[Any]) -> bool:
    """Whether workers can be sent these: they and their parts are of classes that workers can import."""
    return all(_importable(type(part)) for value in values for part in _parts(value, DEEP))


def _parts(value: Any, depth: int) -> Iterator[Any]:
    """A value and what it is made of, as far as an estimator may lie within work on an image."""
    yield value
    if depth:
        inside = (value.func, *value.args) if isinstance(value, partial) else getattr(value, "__dict__", {}).values()
        for part in inside:
            yield from _parts(part, depth - 1)


def _importable(kind: type) -> bool:
    name = kind.__module__.partition(".")[0]
    if name in ("builtins", "nusselt", "numpy"):
        return True
    if "<locals>" in kind.__qualname__:
        return False
    if name == "__main__":
        return getattr(sys.modules["__main__"], "__file__", None) is not None
    return name in sys.stdlib_module_names or PathFinder.find_spec(name) is not None
