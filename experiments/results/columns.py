"""The columns in which every table shows a verdict: terminal, notebook, Markdown and report."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from .rows import method, percent
from .schema import Row


@dataclass(frozen=True)
class Column:
    """A column.

    Parameters
    ----------
    name, hint : str
        Its head, and what it means.
    of : callable
        A row to words, to a share, or to the two ends of an interval of shares.
    digits : int or None
        Of a share in percent; None for words.
    sign : bool
        Whether a share shows its plus.
    most : float
        Share from which only that is said.
    """

    name: str
    hint: str
    of: Callable[[Row], Any]
    digits: int | None = None
    sign: bool = False
    most: float = math.inf

    @property
    def number(self) -> bool:
        """Whether it holds shares."""
        return self.digits is not None

    def shown(self, row: Row, unit: str = " %") -> str:
        """What stands there; empty where nothing was measured."""
        value = self.of(row)
        if self.digits is None:
            return str(value or "")
        if isinstance(value, float) and value >= self.most:
            return f"> {100 * self.most:g}{unit}"
        shares = value if isinstance(value, (list, tuple)) else (value,)
        return " to ".join(filter(None, (percent(share, self.digits, self.sign, unit) for share in shares)))


def _entry(name: str) -> Callable[[Row], Any]:
    return lambda row: row.get(name)


COLUMNS = (
    Column("scene", "", _entry("scene")),
    Column("estimator", "With its samples per light", method),
    Column("verdict", "", _entry("verdict")),
    Column("bias", "Mean of the image − reference over shaded pixels, relative", _entry("bias_relative"), 3, True),
    Column(
        "its interval",
        "The bias’s interval; the shaded band is the margin declared not to matter",
        _entry("bias_interval"),
        3,
        True,
    ),
    Column(
        "MDB",
        "Minimum detectable bias: the smallest this row would have found, with 99 % power",
        _entry("minimum_detectable_bias"),
        3,
        most=1.0,
    ),
    Column("RMS", "RMS of one image against the reference, relative", _entry("rms_relative"), 2),
)
