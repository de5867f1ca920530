"""Files that are whole or not there: everything is written beside its place and renamed into it."""

from __future__ import annotations

import os
import re
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from nusselt.renderer.errors import InputError


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A path to write to; it takes the place of ``path`` when the block ends well, and vanishes when not.

    Raises
    ------
    InputError
        If the folder cannot be written to.
    """
    beside = path.with_name(f".{path.stem}.{secrets.token_hex(4)}{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield beside
        os.replace(beside, path)
    except OSError as error:
        raise InputError("output", str(path), f"a place that can be written to ({error.strerror})") from error
    finally:
        with suppress(OSError):  # the first error is the one to tell
            beside.unlink(missing_ok=True)


def folder_name(name: str) -> str:
    """A scene's name as that of a folder of its own: it leads nowhere else."""
    return re.sub(r"^\.+|[/\\\0]", "_", name) or "_"
