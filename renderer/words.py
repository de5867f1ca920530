"""Numbers with their nouns, for everything that is said to people."""

from __future__ import annotations

import re

_SEVERAL = {"is": "are", "has": "have"}


def count(number: int, noun: str, verb: str = "") -> str:
    """A number, its noun, and a verb that agrees: "1 pixel is", "2 pixels are".

    Parameters
    ----------
    noun, verb : str
        As one thing has them: "pixel", "shows".
    """
    if number != 1:
        noun = re.sub("([^aeiou])y$", r"\1ie", noun)
        noun += "es" if noun.endswith(("s", "x", "ch", "sh")) else "s"
        verb = _SEVERAL.get(verb, verb.removesuffix("s"))
    return f"{number} {noun} {verb}".rstrip()
