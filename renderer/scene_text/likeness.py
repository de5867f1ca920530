"""Which command an unknown word may have been meant for."""

from __future__ import annotations

import difflib

from .commands import COMMANDS, REFUSED

NAMES = {name.lower(): name for name in (*REFUSED, *COMMANDS)}
"""Every name that is known, by its lower case: a command that differs by case alone is that command."""
_TELLING = {"light": "quadLight", "transform": "pushTransform", "matrix": "pushTransform", "vertex": "vertex"}
LIKE = 0.75
"""Ratio of common letters, beside the same first letter."""


def likely(word: str) -> str:
    """The name that ``word`` resembles: misspelt, its letters swapped, begun or gone on; else an empty text.

    What resembles nothing here may be left out of a scene on request; what does would be missed.
    """
    word = word.lower()[:40]
    like = difflib.get_close_matches(word, [name for name in NAMES if name[0] == word[0]], 1, LIKE)
    like += [name for name in NAMES if sorted(name) == sorted(word)]
    like += [name for name in NAMES if len(word) >= 3 and (name.startswith(word) or word.startswith(name))]
    return NAMES[like[0]] if like else next((known for part, known in _TELLING.items() if part in word), "")
