"""Nusselt's analog: the light on the hemisphere, then on the disk; its area there against the closed form."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from nusselt.experiments.results.figures import BLUE, GOLD, canvas
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.experiments.studies.analog_projection import analog, disk_area
from nusselt.renderer.closed_forms.irradiance import irradiance
from nusselt.renderer.vectors import column, unit

RIGHT = 1e-13
"""Of the disk."""
LIGHTS = {
    "emblem": ((0.45, -0.2, 1.1), (0.9, 0.75, 0.25), (-0.75, 0.95, -0.15)),
    "overhead": ((-0.5, -0.5, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    "across the horizon": ((0.6, -0.8, -0.5), (0.0, 1.6, 0.0), (0.2, 0.0, 1.5)),
    "touching the horizon": ((1.0, -0.5, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    "close above": ((-2.0, -2.0, 0.01), (4.0, 0.0, 0.0), (0.0, 4.0, 0.0)),
    "needle": ((0.3, -1.0, 0.7), (0.001, 0.0, 0.0005), (0.0, 2.0, 0.0)),
}
"""Corner and sides, seen from the origin along z."""


def corners_of(light: tuple[Any, ...]) -> Any:
    """The four corners, (3, 4)."""
    p, ab, ac = (np.array(v) for v in light)
    return np.stack((p, p + ab, p + ab + ac, p + ac), axis=1)


def compare(seed: int, count: int) -> Outcome:
    """The named lights and ``count`` random ones, each by both ways."""
    rng = np.random.default_rng(seed)
    lights = dict(LIGHTS)
    for number in range(count):
        p, ab, ac = rng.normal(size=(3, 3))
        lights[f"random {number + 1}"] = (p, ab, ac)
    up, here = column((0, 0, 1)), np.zeros((3, 1))
    rows = []
    for name, light in lights.items():
        area = disk_area(here[:, 0], up[:, 0], corners_of(light))
        corner, ab, ac = (column(v) for v in light)
        value, _ = irradiance(here, up, corner, ab, ac)
        difference = abs(area - float(value[0])) / np.pi
        row = {"light": name, "disk_area": area, "irradiance": float(value[0]), "difference": difference}
        rows.append(row | {"share_of_disk": area / np.pi, "as_claimed": difference <= RIGHT})
    return Outcome(rows)


def jobs(settings: Settings) -> list[Job]:
    """One."""
    return [Job(compare, {"seed": settings.seed_of("nusselt-analog"), "count": settings.pick(200, 14, 1)})]


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """The light, its projection, its area on the disk."""
    emblem = outcomes[0].rows[0]
    return {"emblem": draw(emblem["disk_area"], emblem["irradiance"])}


def _hemisphere(axis: Any) -> None:
    turn = np.linspace(0, 2 * np.pi, 181)
    for height in np.linspace(0, np.pi / 2, 7)[:-1]:
        axis.plot(
            np.cos(height) * np.cos(turn), np.cos(height) * np.sin(turn), np.sin(height), color=BLUE, lw=0.5, alpha=0.35
        )
    rise = np.linspace(0, np.pi / 2, 61)
    for around in np.linspace(0, 2 * np.pi, 17)[:-1]:
        x, y, z = np.cos(rise) * np.cos(around), np.cos(rise) * np.sin(around), np.sin(rise)
        axis.plot(x, y, z, color=BLUE, lw=0.5, alpha=0.35)
    axis.plot(np.cos(turn), np.sin(turn), 0 * turn, color=BLUE, lw=1.6)


def _patch(light: tuple[Any, ...], steps: int = 24) -> list[Any]:
    """The light on the sphere as small quadrilaterals: one that is drawn whole would be flat."""
    p, ab, ac = (np.array(v) for v in light)
    t = np.linspace(0, 1, steps + 1)
    v = unit(p[:, None, None] + ab[:, None, None] * t[:, None] + ac[:, None, None] * t)
    cells = [v[:, :-1, :-1], v[:, 1:, :-1], v[:, 1:, 1:], v[:, :-1, 1:]]
    return list(np.stack([cell.reshape(3, -1).T for cell in cells], axis=1))


def draw(area: float, value: float) -> Any:
    """The emblem."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    seen = analog(np.zeros(3), np.array([0.0, 0.0, 1.0]), corners_of(LIGHTS["emblem"]))
    disk = np.vstack((seen.disk, np.zeros((1, seen.disk.shape[1]))))
    figure = canvas(7.2, 6.2)
    axis = figure.add_subplot(projection="3d", computed_zorder=False)
    turn = np.linspace(0, 2 * np.pi, 181)
    floor = np.stack((np.cos(turn), np.sin(turn), 0 * turn), axis=1)
    axis.add_collection3d(Poly3DCollection([floor], color=BLUE, alpha=0.08))
    axis.add_collection3d(Poly3DCollection([disk.T], facecolor=GOLD, edgecolor="#744210", alpha=0.95, lw=1.2))
    _hemisphere(axis)
    for k in range(0, disk.shape[1], 64):
        ray = np.stack((np.zeros(3), seen.sphere[:, k], seen.polygon[:, k]), axis=1)
        axis.plot(*ray, color="#4a5568", lw=0.8)
        axis.plot(*np.stack((seen.sphere[:, k], disk[:, k]), axis=1), color="#744210", lw=0.8, ls=":")
    axis.add_collection3d(
        Poly3DCollection(_patch(LIGHTS["emblem"]), facecolor=GOLD, edgecolor="none", alpha=0.7, antialiased=False)
    )
    outline = np.hstack((seen.sphere, seen.sphere[:, :1]))
    axis.plot(*outline, color="#744210", lw=1.4)
    axis.add_collection3d(
        Poly3DCollection([seen.polygon.T], facecolor="#f6e05e", edgecolor="#744210", alpha=0.9, lw=1.2)
    )
    axis.quiver(0, 0, 0, 0, 0, 1.25, color="#1a202c", lw=1.4, arrow_length_ratio=0.07)
    axis.set(xlim=(-1.1, 1.4), ylim=(-1.1, 1.4), zlim=(0, 1.6))
    axis.set_box_aspect((2.5, 2.5, 1.6), zoom=1.4)
    axis.set_axis_off()
    axis.view_init(elev=24, azim=-64)
    figure.suptitle("Nusselt's analog: light, hemisphere, disk", fontsize=13)
    figure.supxlabel(f"area on the disk {area:.13f}, closed form {value:.13f}; no samples, no seed", fontsize=9)
    return figure


NUSSELT_ANALOG = Experiment(
    "nusselt-analog",
    "a light projected on the hemisphere, then on the disk: its area there is the irradiance",
    jobs,
    figures,
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(NUSSELT_ANALOG)
