"""Words of text files as numbers."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

NUMBER = re.compile(rb"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
LONGEST = 63
"""Bytes of a word in an array: one long word would widen every other."""


def floats(words: list[bytes]) -> NDArray[np.float64]:
    """Each word's number; NaN where it is none or not finite: ``nan``, ``-nan(ind)``, ``1.#QNAN``, ``inf``, ``1,5``."""
    text = b"".join(words)
    # 1_0 is ten in Python alone
    is_plain = b"_" not in text and b"\0" not in text and max(map(len, words), default=0) <= LONGEST
    if is_plain:
        try:
            values = np.array(words, dtype="S").astype(np.float64)
        except ValueError:
            is_plain = False
    if not is_plain:
        values = np.array([float(word) if NUMBER.fullmatch(word) else np.nan for word in words], dtype=np.float64)
    return np.where(np.isinf(values), np.nan, values)
