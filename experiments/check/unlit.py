"""Lights that light nothing that is seen, and why: so that two black images are not taken for agreement."""

from __future__ import annotations

import numpy as np

from nusselt.renderer.camera.rays import pixel_centres
from nusselt.renderer.camera.view import look
from nusselt.renderer.lights import Light
from nusselt.renderer.lights.sampling import random_beams
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import dot
from nusselt.renderer.visibility.segments import Blockers

SAMPLES = 16
"""Points of a light that are looked at from each pixel."""


def unlit(scene: Scene) -> list[str]:
    """A sentence for every light that lights none of the pixels' surfaces, as far as a few of its points tell.

    None where nothing that is seen reflects: then the lights are not to blame.
    """
    moved, geometry, _ = prepare(scene)
    x, y = pixel_centres(range(scene.width), range(scene.height))
    points = look(moved, geometry, x, y).points
    if points.count == 0:
        return []
    blockers = Blockers.everything(geometry).gathered()
    told = [(number, _why(light, points, blockers)) for number, light in enumerate(moved.lights)]
    return [
        f"light {number + 1} ({scene.lights[number].kind}) lights nothing that is seen: {why}"
        for number, why in told
        if why
    ]


def _why(light: Light, points: ShadingPoints, blockers: Blockers) -> str:
    """Why a light lights none of the points; empty if it lights one."""
    if not any(light.colour):
        return "it is black"
    d, weight = random_beams(light, points.position, np.random.default_rng(0), SAMPLES, False)
    plane = light.plane()
    if plane is not None and (dot(plane[0], points.position - plane[1]) <= 0).all():
        quad = light.parallelogram() is not None
        return f"it faces away from it all: {'swap its two edges' if quad else 'turn its normal round'}"
    facing = (weight > 0) & (dot(points.normal[:, :, None], d) > 0)
    lit = facing.any(axis=1)
    if not lit.any():
        return "it lies below every horizon"
    some = points.take(np.flatnonzero(lit))
    seen = blockers.visible(some.position, some.ellipsoid, d[:, lit], light.at_infinity, some.normal) & facing[lit]
    return "" if seen.any() else "something always stands before it"
