"""What a pixel should show, by somebody's word."""

from __future__ import annotations

from dataclasses import dataclass

from .errors import InputError
from .validation import Vec3, colour, finite


@dataclass(frozen=True)
class ExpectedPixel:
    """The radiance of a pixel, from a table, a measurement or another program.

    Parameters
    ----------
    x, y : int
        Column and row, from 0 at the top left.
    radiance : Vec3
        W m^-2 sr^-1.
    percent : float
        How far from that it may be, in percent of it: how well it is known.
    """

    x: int
    y: int
    radiance: Vec3
    percent: float = 0.0

    def __post_init__(self) -> None:
        for name in ("x", "y"):
            number = finite(f"expectPixel {name}", getattr(self, name))
            if number != int(number) or number < 0:
                raise InputError(f"expectPixel {name}", number, "a whole number from 0 on")
            object.__setattr__(self, name, int(number))
        object.__setattr__(self, "radiance", colour("expectPixel radiance", self.radiance))
        object.__setattr__(self, "percent", finite("expectPixel percent", self.percent))
        if self.percent < 0:
            raise InputError("expectPixel percent", self.percent, "a number from 0 on")
