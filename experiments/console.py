"""What is printed: a console of a known width, and sentences and commands on it."""

from __future__ import annotations

import os

from rich.console import Console

WIDE = 140
"""Columns from which everything is shown; what is not a terminal has them."""


def console(stderr: bool = False) -> Console:
    """A console as wide as its terminal or as COLUMNS says, or wide enough for every column where nothing is known."""
    found = Console(stderr=stderr, highlight=False, emoji=False)
    known = found.is_terminal or os.environ.get("COLUMNS", "").isdigit()
    return found if known else Console(stderr=stderr, highlight=False, emoji=False, width=WIDE)


def say(told: Console, sentence: str, style: str | None = None) -> None:
    """A sentence: a terminal's lines end between its words; elsewhere it is one line."""
    told.print(sentence, style=style, markup=False, soft_wrap=not told.is_terminal)


def say_command(told: Console, command: str) -> None:
    """A command to be copied: one line, wherever a terminal breaks it."""
    told.print(command, markup=False, soft_wrap=True)
