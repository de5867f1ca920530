"""Where commands write: refused before any work where nothing can be written."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from nusselt.experiments.files import check_place


class Place(click.Path):
    """A file, or a folder, that a command is going to write.

    Parameters
    ----------
    folder : bool
        Whether it is a folder.
    dash : bool
        Whether "-", standard output, may stand in its place; the value is a text then, else a path.
    """

    def __init__(self, folder: bool = False, dash: bool = False) -> None:
        super().__init__()
        self.folder, self.dash = folder, dash

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The place; `InputError` where it cannot be written to."""
        if self.dash and value == "-":
            return value
        check_place(param.name if param and param.name else "output", Path(value), self.folder)
        return value if self.dash else Path(value)
