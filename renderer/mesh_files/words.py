"""Words of text files as numbers."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

NUMBER = re.compile(rb"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
LONGEST = 63
"""Bytes of a word in an array: one long word would widen every other."""


def floats(words: list[bytes]) -> NDArray[np.float64]:
    """Each word's number, NaN where it is none: ``nan``, ``-nan(ind)``, ``1.#QNAN``, ``1,5``."""
    text = b"".join(words)
    is_plain = b"_" not in text and b"\0" not in text  # 1_0 is ten in Python alone
    if is_plain and max(map(len, words), default=0) <= LONGEST:
        try:
            return np.array(words, dtype="S").astype(np.float64)
        except ValueError:
            pass
    return np.array([float(word) if NUMBER.fullmatch(word) else np.nan for word in words], dtype=np.float64)
