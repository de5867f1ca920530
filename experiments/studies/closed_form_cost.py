"""Milliseconds per 65,536 points of the closed forms, on one core: raw times kept, the first apart."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from nusselt.experiments.results.figures import BLUE, RED, canvas
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.renderer.closed_forms.irradiance import irradiance
from nusselt.renderer.closed_forms.phong_lobe import phong_lobe
from nusselt.renderer.vectors import Floats, column, unit

POINTS = 65_536
GOALS = {"irradiance": 60.0, "lobe": 500.0}
EXPONENTS = (1.0, 30.0, 1000.0)
LIGHTS: dict[str, tuple[Any, ...]] = {
    "overhead": ((-0.5, 2.0, -0.5), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)),
    "standing on the floor": ((-0.5, 0.0, -0.5), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    "small": ((-0.02, 2.0, -0.02), (0.0, 0.0, 0.04), (0.04, 0.0, 0.0)),
}


def floor(seed: int, count: int) -> tuple[Floats, Floats, Floats]:
    """Points of a floor 4 wide, their normals, and where a camera above is mirrored."""
    rng = np.random.default_rng(seed)
    x, z = rng.uniform(-2, 2, (2, count))
    points = np.stack((x, np.zeros(count), z))
    normals = np.broadcast_to(column((0, 1, 0)), points.shape)
    mirror = unit(points - column((0.3, 2.5, 5.0))) * column((1, -1, 1))
    return points, normals, mirror


def timed(light: str, form: str, exponent: float | None, repeats: int, points: int, seed: int) -> Outcome:
    """One form over one light: every time, scaled to 65,536 points."""
    places, normals, mirror = floor(seed, points)
    p, ab, ac = (column(v) for v in LIGHTS[light])
    scale = 1000 * POINTS / points
    times, busy = [], []
    for _ in range(repeats + 1):
        started, worked = time.perf_counter(), time.process_time()
        if exponent is None:
            value, _ = irradiance(places, normals, p, ab, ac)
        else:
            value, _ = phong_lobe(places, normals, mirror, exponent, p, ab, ac)
        times.append(scale * (time.perf_counter() - started))
        busy.append(scale * (time.process_time() - worked))
    median = float(np.median(times[1:]))
    row = {"form": form, "light": light, "exponent": exponent, "points": points, "milliseconds": median}
    row |= {"processor": float(np.median(busy[1:]))}  # less than the clock where others had the core
    row |= {"fastest": min(times[1:]), "first": times[0], "goal": GOALS[form], "within_goal": median <= GOALS[form]}
    # A time is shown, never judged: what is claimed is that all values are numbers.
    return Outcome([row | {"raw": times[1:], "as_claimed": bool(np.isfinite(value).all())}])


def jobs(settings: Settings) -> list[Job]:
    """One a light, form and exponent, each with the machine to itself."""
    repeats, points = settings.pick((3, POINTS), (2, 2048), (1, 16))
    seed = settings.seed_of("cost")
    asked: list[tuple[str, str, float | None]] = [(light, "irradiance", None) for light in LIGHTS]
    asked += [(light, "lobe", s) for light in LIGHTS for s in EXPONENTS]
    return [
        Job(
            timed,
            {"light": light, "form": form, "exponent": s, "repeats": repeats, "points": points, "seed": seed},
            alone=True,
        )
        for light, form, s in asked
    ]


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Milliseconds, every repeat a mark."""
    rows = [outcome.rows[0] for outcome in outcomes]
    figure = canvas(9, 0.4 * len(rows) + 1.6)
    axis = figure.subplots()
    for k, row in enumerate(rows):
        axis.plot(row["raw"], [k] * len(row["raw"]), ".", color=BLUE, alpha=0.6)
        axis.plot(row["milliseconds"], k, "|", color=BLUE, ms=16, mew=2)
        axis.plot(row["goal"], k, "|", color=RED, ms=12)
    names = [f"{r['form']}, {r['light']}" + ("" if r["exponent"] is None else f", s = {r['exponent']:g}") for r in rows]
    axis.set_yticks(range(len(rows)), names)
    axis.set_xscale("log")
    axis.set_xlabel(f"milliseconds per {POINTS:,} points, one core; bar: median, red: goal")
    axis.set_title("Cost of the closed forms (first run apart)", fontsize=10)
    axis.grid(axis="x", alpha=0.3)
    return {"cost": figure}


CLOSED_FORM_COST = Experiment(
    "closed-form-cost", "milliseconds per 65,536 points of the closed forms on one core", jobs, figures
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(CLOSED_FORM_COST)
