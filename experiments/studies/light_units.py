"""Point, directional, sun and area lights: limits of one another, and how to make them equally bright.

A light shrunk at constant L A becomes a point of intensity I = L A; one that recedes at constant L d(omega) a direction
of irradiance E = L d(omega). The lecture's rule of thumb between them (slide 30): point for area I = L A, directional
for area E = L times the mean solid angle, directional for point E = I / mean R^2 times 2 "for the average cosine".
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from nusselt.experiments.results.figures import curves, strip
from nusselt.experiments.results.work_precision import slope
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.experiments.scenes.shapes import GREY, lamp, plate
from nusselt.renderer.closed_forms.irradiance import irradiance
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render
from nusselt.renderer.lights import DirectionalLight, Light, PointLight, QuadLight, SunLight
from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.surfaces import Ellipsoid
from nusselt.renderer.validation import Vec3
from nusselt.renderer.vectors import Floats, column, dot, frame, unit

NORMAL = unit(column((0.2, -0.3, 1.0)))
CENTRE = column((0.5, 0.25, 2.0))
SIDES = column((1.0, 0.25, -0.5)), column((-0.25, 1.0, 0.75))
SIZES = 2.0 ** -np.arange(2, 12)
HEIGHTS = (0.5, 1.0, 2.0, 4.0, 8.0)


def to_a_point(size: float) -> float:
    """A light of constant L A around one place: E over L A cos cos' / R^2, less one."""
    ab, ac = (side * size for side in SIDES)
    value, _ = irradiance(np.zeros((3, 1)), NORMAL, CENTRE - (ab + ac) / 2, ab, ac)
    area = np.cross(ab[:, 0], ac[:, 0])
    distance = float(np.linalg.norm(CENTRE))
    cosines = abs(float(area @ CENTRE[:, 0])) * float(dot(NORMAL, CENTRE)[0]) / distance**2
    return float(value[0]) / (cosines / distance**2) - 1


def to_a_direction(size: float) -> float:
    """A facing square that recedes as 1/size at constant solid angle times radiance: E over cos, less one."""
    axis = unit(CENTRE)
    ab, ac = (v * size for v in frame(axis))
    value, _ = irradiance(np.zeros((3, 1)), NORMAL, axis - (ab + ac) / 2, ab, ac)
    solid_angle = 4 * np.arcsin((size / 2) ** 2 / (1 + (size / 2) ** 2))
    return float(value[0]) / (solid_angle * float(dot(NORMAL, axis)[0])) - 1


def sun_by_solid_angle(size: float) -> float:
    """The sun with the lecture's L d(omega) = E in place of its projected solid angle."""
    sun = SunLight((0.0, 0.0, 1.0), (1.0, 1.0, 1.0), float(np.degrees(2 * size)))
    projected = np.pi * np.sin(size) ** 2 * float(sun.irradiance_on(column((0, 0, 1)))[0])
    return float(projected / (4 * np.pi * np.sin(size / 2) ** 2)) - 1


LIMITS: dict[str, Callable[[float], float]] = {
    "area to point, L A constant": to_a_point,
    "area to direction, L d(omega) constant": to_a_direction,
    "sun to direction, L d(omega) constant": sun_by_solid_angle,
}


def order(limit: str) -> Outcome:
    """Order of convergence of one limit: 2."""
    errors = np.abs([LIMITS[limit](float(size)) for size in SIZES])
    value, low, high = slope(SIZES, errors)
    row = {"what": limit, "order": value, "order_low": low, "order_high": high, "as_claimed": abs(value - 2) < 0.05}
    return Outcome([row], {"sizes": SIZES, "errors": errors})


def _grey(value: float) -> Vec3:
    return value, value, value


def lights(height: float) -> tuple[dict[str, Light], Floats]:
    """A square lamp over a floor, and what the lecture puts in its place; the floor's points."""
    quad = lamp((-0.5, 0.5), (-0.5, 0.5), height, (1.0, 1.0, 1.0))
    t = (np.arange(48) + 0.5) / 48 * 4 - 2
    points = np.stack([v.ravel() for v in np.meshgrid(t, [0.0], t)])
    grid = [v.ravel()[None] for v in np.meshgrid((np.arange(12) + 0.5) / 12, (np.arange(12) + 0.5) / 12)]
    _, weights = quad.beams(points, *grid)
    from_centre = points - column((0, height, 0))
    mean_square = float(dot(from_centre, from_centre).mean())
    angle = float(weights.sum(axis=1).mean())
    up = (0.0, 1.0, 0.0)
    return {
        "area": quad,
        "point for area": PointLight((0.0, height, 0.0), _grey(quad.area)),
        "directional for area": DirectionalLight(up, _grey(angle)),
        "directional for point": DirectionalLight(up, _grey(2 * quad.area / mean_square)),
    }, points


def floor_irradiance(light: Light, points: Floats) -> Floats:
    """Unshadowed irradiance (n,) of a floor that faces +y."""
    if isinstance(light, QuadLight):
        up = np.broadcast_to(column((0, 1, 0)), points.shape)
        return irradiance(points, up, column(light.corner), column(light.ab), column(light.ac))[0]
    if isinstance(light, PointLight):
        d = column(light.position) - points
        return light.intensity[0] * d[1] / dot(d, d) ** 1.5
    if isinstance(light, DirectionalLight):
        return np.full(points.shape[1], light.direction[1] * light.irradiance[0])
    raise TypeError(f"the lecture has no {light.kind} light")


def thumb(height: float) -> Outcome:
    """Each substitute's floor against the lamp's: mean, lowest and highest ratio."""
    made, points = lights(height)
    right = floor_irradiance(made["area"], points)
    rows = []
    for name, light in made.items():
        if name == "area":
            continue
        there = floor_irradiance(light, points)
        ratio = there / right
        mean = float(there.mean() / right.mean())
        row = {"what": name, "lamp_height": height, "mean_ratio": mean}
        row |= {"lowest_ratio": float(ratio.min()), "highest_ratio": float(ratio.max())}
        # A rule of thumb: what is claimed is no more than its order of magnitude.
        rows.append(row | {"as_claimed": 0.1 < mean < 10})
    return Outcome(rows)


def images(height: float, width: int, seed: int) -> Outcome:
    """The same ball under each light; no rows but those of `thumb` are claimed of it."""
    made, _ = lights(height)
    camera = Camera((0.25, 2.0, 5.0), (0.0, 0.25, 0.0), (0.0, 1.0, 0.0), 40.0)
    ball = (Ellipsoid.sphere((0.0, 0.5, 0.0), 0.5, GREY),)
    arrays = {}
    for name, light in made.items():
        scene = Scene(width, width * 3 // 4, camera, (plate((-2, 2), (-2, 2), 0.0),), ball, (_times(light, 5.0),))
        arrays[name] = render(scene, Area(samples=64, stratified=True), seed=seed).mean
    return Outcome([], arrays)


def _times(light: Light, factor: float) -> Light:
    r, g, b = (factor * c for c in light.colour)
    return light.with_colour((r, g, b))


def jobs(settings: Settings) -> list[Job]:
    """Limits, the rule of thumb, and images."""
    width = settings.pick(240, 64, 12)
    found = [Job(order, {"limit": limit}) for limit in LIMITS]
    found += [Job(thumb, {"height": height}) for height in HEIGHTS]
    return [*found, Job(images, {"height": 2.0, "width": width, "seed": settings.seed_of("light-units")})]


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """How fast each limit is reached, and the images."""
    limits = [outcome for outcome in outcomes if "errors" in outcome.arrays]
    lines = {o.rows[0]["what"]: (o.arrays["sizes"].tolist(), o.arrays["errors"].tolist()) for o in limits}
    order_figure = curves(lines, "size (angle) of the light", "relative difference from its limit", "Lights as limits")
    rows = [row for outcome in outcomes for row in outcome.rows if "mean_ratio" in row]
    kinds = dict.fromkeys(row["what"] for row in rows)
    ratio = {
        kind: tuple([row[k] for row in rows if row["what"] == kind] for k in ("lamp_height", "mean_ratio"))
        for kind in kinds
    }
    title = "The rule of thumb: mean floor irradiance over that of a lamp 1 x 1, floor 4 x 4"
    thumb_figure = curves(ratio, "height of the lamp", "ratio", title)
    shown = [(name, image) for name, image in outcomes[-1].arrays.items()]
    pictures = strip([("", shown)], "Equally bright by the rule of thumb: lamp 2 above the floor, area 64 stratified")
    return {"limits": order_figure, "rule-of-thumb": thumb_figure, "images": pictures}


LIGHT_UNITS = Experiment(
    "light-units", "point, directional, sun and area lights as limits, and made equally bright", jobs, figures
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(LIGHT_UNITS)
