"""Files that are whole or not there: everything is written beside its place and renamed into it."""

from __future__ import annotations

import os
import re
import secrets
import tempfile
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


def check_place(name: str, path: Path, folder: bool = False) -> None:
    """Refuse a file, or a folder, that cannot be written: before the work whose results go there.

    Parameters
    ----------
    name : str
        The argument that says it.

    Raises
    ------
    InputError
    """
    kind = "folder" if folder else "file"
    there = next(place for place in (path, *path.absolute().parents) if place.exists())
    why = ""
    if there == path and folder != path.is_dir():
        why = "it is a folder" if path.is_dir() else "it is no folder"
    elif there != path and not there.is_dir():
        why = f"{there} is no folder"
    else:
        try:  # rights alone do not say it: file systems are read-only, or full
            tempfile.TemporaryFile(dir=there if there.is_dir() else there.parent).close()
        except OSError as error:
            why = str(error.strerror)
    if why:
        raise InputError(name, str(path), f"a {kind} that can be written to ({why})")


def folder_name(name: str) -> str:
    """A scene's name as that of a folder of its own: it leads nowhere else, and CI's artifacts take it."""
    return re.sub(r"^\.+|[/\\\0\":<>|*?\r\n]", "_", name) or "_"
