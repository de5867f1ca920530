"""What Mitsuba says a scene's sensors read: irradiance by its light sampling and shadow rays.

Its `irradiancemeter` looks for lights with rays over the hemisphere, which finds small ones rarely, and wants a shape
to lie on; a point and a normal put to its lights, one after the other, is what its `direct` does at a white surface.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Bools, Floats
from nusselt.renderer.visibility.segments import Blockers

from .description import describe
from .llvm import Backend, backend
from .process import ReferenceUnavailable
from .reference import ask
from .temporary import temporary_folder
from .tolerance import LIFT

PASSES = 32


@dataclass(frozen=True)
class SensorReference:
    """Readings of n sensors.

    Parameters
    ----------
    mean, standard_error : (3, n) float64
        Irradiance, W m^-2.
    unoccluded : (3, n) float64
        What it would be if nothing blocked.
    grain : (3, n) float64
        The most that one sample can change it by.
    passes, samples : int
        Independent ones; of each light in all of them.
    version, variant : str
        Of Mitsuba.
    limits : tuple of str
        Where it may be wrong itself.
    too_close : (n,) bool
        Sensors that a surface is before, closer than Mitsuba's shadow rays are lifted off.
    """

    mean: Floats
    standard_error: Floats
    unoccluded: Floats
    grain: Floats
    passes: int
    samples: int
    version: str
    variant: str
    limits: tuple[str, ...]
    too_close: Bools


def sensors_by_mitsuba(
    scene: Scene,
    *,
    seed: int,
    samples: int = 1 << 14,
    timeout: float = 600.0,
    progress: Callable[[int, int], None] | None = None,
    running: Backend | None = None,
) -> SensorReference:
    """Read a scene's sensors with Mitsuba.

    Parameters
    ----------
    samples : int
        Of each light with an extent, in each of PASSES passes; a square number.
    timeout : float
        Seconds.

    Raises
    ------
    ReferenceUnavailable
        If Mitsuba's LLVM variant cannot run here, or fails.
    """
    running = running or backend()
    if not running.variant.startswith("llvm"):
        raise ReferenceUnavailable(f"sensors are put to Mitsuba's LLVM variant alone: {running.sentence}")
    with temporary_folder() as name:
        description = describe(scene, Path(name))
        centre = np.array(description.centre)
        job = {
            "task": "sensors",
            "description": description.as_json(),
            "position": ((np.array([s.position for s in scene.sensors]) - centre) * description.scale).T.tolist(),
            "normal": np.array([s.normal for s in scene.sensors]).T.tolist(),
            "samples": samples,
            "passes": PASSES,
            "seed": seed,
        }
        arrays, told = ask(job, Path(name), running, timeout, progress)
    if not np.isfinite(arrays["mean"]).all():
        raise ReferenceUnavailable("Mitsuba's irradiance is not finite everywhere")
    return SensorReference(
        mean=arrays["mean"],
        standard_error=arrays["standard_error"],
        unoccluded=arrays["unoccluded"],
        grain=arrays["grain"],
        passes=PASSES,
        samples=samples * PASSES,
        version=str(told["version"]),
        variant=str(told["variant"]),
        limits=tuple(description.limits),
        too_close=_too_close(scene, 1 / description.scale, centre),
    )


LIFTS = 4.0
"""Times as far as Mitsuba 3.9 lifts shadow rays that a surface must be before a sensor."""


def _too_close(scene: Scene, unit: float, centre: Floats) -> Bools:
    """Sensors with a surface before them within what Mitsuba's shadow rays start beyond."""
    position, normal = (np.array([getattr(s, name) for s in scene.sensors]).T for name in ("position", "normal"))
    lift = LIFTS * LIFT * (unit + np.abs(position - centre[:, None]).max(axis=0))
    near, geometry, _ = prepare(scene, everything=True)
    moved = np.array([sensor.position for sensor in near.sensors]).T
    ways, on_none = (normal * lift)[:, :, None], np.full(moved.shape[1], -1)
    clear = Blockers.everything(geometry).gathered().visible(moved, on_none, ways, at_infinity=False)
    return np.asarray(~clear[:, 0])
