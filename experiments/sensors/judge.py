"""The verdict on every sensor: ours against Mitsuba, and against what the scene expects.

Each channel of each sensor is a test of its own, at its share of the false-alarm rate, in units of itself; where it is
0, of what it would be if nothing blocked.
"""

from __future__ import annotations

import numpy as np

from nusselt.experiments.verdict.evidence import ROUNDING
from nusselt.experiments.verdict.expected import Difference, from_expected, unit_of
from nusselt.experiments.verdict.intervals import Bias
from nusselt.mitsuba_bridge.sensors import SensorReference
from nusselt.renderer.image import Image
from nusselt.renderer.sensor import Sensor


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
    unit = unit_of(reference.mean, reference.unoccluded)
    return Difference(
        bias.value / unit, bias.half_width(level / mean.size) / unit + ROUNDING, np.full(unit.shape, margin)
    )


def against_expected(ours: Image, passes: int, sensors: tuple[Sensor, ...], level: float) -> Difference | None:
    """Ours less what is expected, of the sensors of which something is; None if there is none."""
    index = [k for k, sensor in enumerate(sensors) if sensor.expected is not None]
    if not index:
        return None
    expected = np.array([sensors[k].expected for k in index]).T
    percent = np.array([sensors[k].percent for k in index])
    return from_expected(ours.mean[:, 0, index], ours.variance[:, 0, index], passes, expected, percent, level)
