"""Which pixels another renderer's rounding may resolve otherwise: edges and hard shadows, not all that is dark."""

from __future__ import annotations

from builders import scene

from nusselt.experiments.scenes import shapes
from nusselt.mitsuba_bridge.tolerance import ray_tolerance
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render
from nusselt.renderer.lights import DirectionalLight
from nusselt.renderer.scene import Camera

CAMERA = Camera((0.1, 0.07, 3.9), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 40.0)


def test_walls_that_face_away_from_a_light_are_judged():
    """A room open to the front: light comes in there, and two of its walls turn their backs to it."""
    floor, ceiling = shapes.plate((-1, 1), (-1, 1), -1.0), shapes.plate((-1, 1), (1, -1), 1.0)
    left = shapes.sheet((-1, -1, 1), (-1, -1, -1), (-1, 1, -1), (-1, 1, 1))
    light = DirectionalLight((-0.3, 1.0, 0.8), (1.0, 1.0, 1.0))
    made = scene(floor, ceiling, left, lights=(light,), camera=CAMERA, size=(40, 30))
    image = render(made, Area(), tolerance=ray_tolerance(made))
    dark = image.shaded & (image.mean.max(axis=0) == 0)
    assert dark.sum() > 150
    assert image.unjudged[dark].mean() < 0.3
