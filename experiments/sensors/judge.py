"""The verdict on every sensor: ours against Mitsuba, and against what the scene expects.

Each channel of each sensor is a test of its own, at its share of the false-alarm rate, in units of itself; where it is
0, of what it would be if nothing blocked.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.experiments.verdict.evidence import ROUNDING
from nusselt.experiments.verdict.intervals import Bias
from nusselt.mitsuba_bridge.sensors import SensorReference
from nusselt.renderer.image import Image
from nusselt.renderer.sensor import Sensor
from nusselt.renderer.vectors import Floats

OWN_ROUNDING = 1e-9
"""Relative error that a noise-free reading of ours may have and still be what is expected."""


@dataclass(frozen=True)
class Difference:
    """Of readings (3, n), relative, each within a half width at its false-alarm rate; ``allowed`` is no difference."""

    value: Floats
    half: Floats
    allowed: Floats

    def ends(self, k: int) -> list[float]:
        """The interval of the sensor's channel that is furthest off."""
        worst = int((np.abs(self.value[:, k]) + self.half[:, k]).argmax())
        value, half = float(self.value[worst, k]), float(self.half[worst, k])
        return [value - half, value + half]

    def said(self, of: str, k: int) -> tuple[str, str]:
        """The verdict on a sensor, and a sentence.

        It differs if any channel is beyond what is allowed whatever the noise, and agrees if all are within it.
        """
        value, half, allowed = np.abs(self.value[:, k]), self.half[:, k], self.allowed[:, k]
        word = "differs" if (value - half > allowed).any() else "agrees"
        word = word if word == "differs" or (value + half <= allowed).all() else "undecided"
        where = {"agrees": "inside", "differs": "outside", "undecided": "too wide for"}[word]
        low, high = self.ends(k)
        return word, f"off {of} by [{low:+.3%}, {high:+.3%}], {where} {allowed[0]:.3%}"


def _unit(readings: Floats, unoccluded: Floats | None = None) -> Floats:
    """What differences are relative to, (3, n): each channel to itself, or to what it would be if nothing blocked."""
    unit = np.abs(readings)
    for other in ([] if unoccluded is None else [unoccluded]) + [np.broadcast_to(unit.mean(axis=0), unit.shape)]:
        unit = np.where(unit > 0, unit, other)
    return np.where(unit > 0, unit, unit.mean() or 1.0)


def against_mitsuba(
    ours: Image, passes: int, samples: int, reference: SensorReference, margin: float, level: float
) -> Difference:
    """Ours less Mitsuba's.

    Parameters
    ----------
    ours : Image
        From `read_sensors`.
    passes, samples : int
        Of ours: passes, and samples in each.
    level : float
        False-alarm rate of all sensors together.
    """
    mean, variance = ours.mean[:, 0], ours.variance[:, 0] / passes
    noise = reference.standard_error**2
    # Welch and Satterthwaite's; where no pass has seen any noise, the reference's passes.
    parts = variance**2 / max(passes - 1, 1) + noise**2 / (reference.passes - 1)
    freedom = np.divide(
        (variance + noise) ** 2, parts, out=np.full(parts.shape, reference.passes - 1.0), where=parts > 0
    )
    # One of our samples brings what one of Mitsuba's does.
    more = reference.samples / (samples * passes) if variance.any() else 0.0
    grain = np.hypot(1.0, more) * reference.grain
    bias = Bias(mean - reference.mean, np.sqrt(variance + noise), np.maximum(freedom, 1.0), grain)
    unit = _unit(reference.mean, reference.unoccluded)
    return Difference(
        bias.value / unit, bias.half_width(level / mean.size) / unit + ROUNDING, np.full(unit.shape, margin)
    )


def against_expected(ours: Image, passes: int, sensors: tuple[Sensor, ...], level: float) -> Difference | None:
    """Ours less what is expected, of the sensors of which something is; None if there is none."""
    index = [k for k, sensor in enumerate(sensors) if sensor.expected is not None]
    if not index:
        return None
    expected = np.array([sensors[k].expected for k in index]).T
    mean, error = ours.mean[:, 0, index], np.sqrt(ours.variance[:, 0, index] / passes)
    bias = Bias(mean - expected, error, np.full(mean.shape, max(passes - 1.0, 1.0)))
    unit = _unit(expected)
    allowed = np.array([sensors[k].percent / 100 for k in index]) + OWN_ROUNDING
    return Difference(
        bias.value / unit, bias.half_width(level / mean.size) / unit, np.broadcast_to(allowed, unit.shape)
    )
