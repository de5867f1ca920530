"""What an entry of `results.json` may hold: a kind of value in words, with the test of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Kind:
    """A kind of value.

    Parameters
    ----------
    words : str
        What is accepted, as a noun phrase.
    accepts : callable
        Whether a JSON value that is not null is of this kind.
    """

    words: str
    accepts: Callable[[Any], bool]

    def __or__(self, other: Kind) -> Kind:
        return Kind(f"{self.words}, or {other.words}", lambda value: self.accepts(value) or other.accepts(value))


@dataclass(frozen=True)
class Entry:
    """One name of a row, of the head, or of an object in them.

    Parameters
    ----------
    name : str
    kind : Kind
    meaning : str
    unit : str
        Empty where the kind says it, or there is none.
    parts : tuple of Entry
        The names in the object, or in each object of the list; others may stand beside them.
    """

    name: str
    kind: Kind
    meaning: str
    unit: str = ""
    parts: tuple[Entry, ...] = ()


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def _listed(of: Callable[[Any], bool]) -> Callable[[Any], bool]:
    """Lists whose items are null or accepted."""
    return lambda value: isinstance(value, list) and all(item is None or of(item) for item in value)


def _is_interval(value: Any) -> bool:
    if not isinstance(value, list) or len(value) != 2:
        return False
    ends = [end for end in value if end is not None]
    return all(map(_is_number, ends)) and ends == sorted(ends)


def _is_grid(value: Any) -> bool:
    rows = _listed(_listed(_is_number))
    return rows(value) and len({len(row or ()) for row in value}) <= 1


def one_of(*words: str) -> Kind:
    """One of these words."""
    return Kind("one of " + ", ".join(words), lambda value: value in words)


TEXT = Kind("a text", lambda value: isinstance(value, str))
FLAG = Kind("true or false", lambda value: isinstance(value, bool))
NUMBER = Kind("a finite number", _is_number)
COUNT = Kind("a whole number, 0 or more", lambda value: type(value) is int and value >= 0)
INTERVAL = Kind("two numbers, the lower first", _is_interval)
NUMBERS = Kind("a list of numbers", _listed(_is_number))
TEXTS = Kind("a list of texts", _listed(TEXT.accepts))
GRID = Kind("lists of numbers, all of one length", _is_grid)
OBJECT = Kind("an object", lambda value: isinstance(value, dict))
OBJECTS = Kind("a list of objects", _listed(OBJECT.accepts))
TIMES = NUMBER | NUMBERS | OBJECT
