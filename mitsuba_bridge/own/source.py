"""What Mitsuba is to parse: a file, or a dict of `mi.load_dict` as words that its process can be told.

A dict holds objects of the Mitsuba that made it. Written as XML (`mi.parser.write_string`) its transforms come apart
into scales and angles that are off by 1e-7; so it crosses as it is, each value with its kind, and is parsed there.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nusselt.renderer.errors import InputError

DICT = "dict"
"""What messages call a dict."""
ACCEPTED = (
    "numbers, text, dicts, Mitsuba's scalar transforms and colours; what is loaded goes into a file that is named"
)


@dataclass(frozen=True)
class Source:
    """A scene of somebody's, for Mitsuba to parse.

    Parameters
    ----------
    file : str
        Its path, absolute; what messages call it where it is no file.
    words : str
        A dict as JSON; empty for a file.
    """

    file: str
    words: str = ""

    @classmethod
    def of_file(cls, path: Path) -> Source:
        return cls(str(path.resolve()))

    @classmethod
    def of_dict(cls, given: Mapping[str, Any]) -> Source:
        """A dict of `mi.load_dict`; names of files are relative to the working directory.

        Raises
        ------
        InputError
            For what cannot leave the process that made it, by its place in the dict.
        """
        return cls(DICT, json.dumps(_entries(given, DICT)))


def _entries(given: Mapping[Any, Any], place: str) -> dict[str, Any]:
    """A dict's own values by their names: dicts, and [kind, value]."""
    for name in given:
        if not isinstance(name, str):
            raise InputError("name", repr(name), "names that are text", place)
    if not isinstance(given.get("type"), str):
        raise InputError("type", given.get("type", "none"), "the name of a Mitsuba plugin, or scene", place)
    return {name: _entry(name, value, f"{place}.{name}") for name, value in given.items()}


def _entry(name: str, value: Any, place: str) -> dict[str, Any] | list[Any]:
    if isinstance(value, Mapping):
        return _entries(value, place)
    if isinstance(value, str | Path):
        return ["plain", str(Path(value).resolve()) if name == "filename" else str(value)]
    if isinstance(value, np.bool_ | np.integer | np.floating):
        value = value.item()
    if isinstance(value, bool | int | float):
        return ["plain", value]
    kind = "numbers"
    if type(value).__module__.partition(".")[0] == "mitsuba":
        kind = next((kind for kind in ("Transform", "Color") if kind in type(value).__name__), kind)
    numbers = _numbers(value.matrix if kind == "Transform" else value)
    if numbers is None or (kind == "Transform" and numbers.shape != (4, 4)):
        raise InputError(name, f"a {type(value).__name__}", ACCEPTED, place)
    return [kind, numbers.tolist()]


def _numbers(value: Any) -> Any:
    """An array of them; None for what is no list of numbers, nor a table."""
    try:
        found = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, RuntimeError):
        return None
    return found if found.ndim in (1, 2) and found.size else None
