"""A peer's adapter in place of a real one: ours, by points drawn at random or by midpoints; right, or wrong of balls.

Run as an adapter is, before its words: ``random`` or ``middles``, and ``right``, ``dim`` or ``ends``.
"""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import nusselt.experiments.peers.adapters
import nusselt.renderer.estimators.area as area
from nusselt.renderer.image import render
from nusselt.renderer.lights import QuadLight
from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.surfaces import Ellipsoid, Material, Mesh

sys.path.insert(0, str(Path(nusselt.experiments.peers.adapters.__file__).parent))

from plain import run

POINTS, FAULT = sys.argv[1:3]


def middles(light, points, rng, samples, stratified):
    """One point in the middle of each cell."""
    side = math.isqrt(samples)
    return light.beams(points, *((grid.reshape(1, -1) + 0.5) / side for grid in np.mgrid[0:side, 0:side]))


def material(albedo, specular, shininess):
    """Of arrays."""
    return Material(tuple(albedo), tuple(specular), float(shininess))


def image(scene, samples=16, seed=0, threads=1):
    """(h, w, 3) and a version."""
    if FAULT == "ends" and len(scene.spheres):
        sys.exit("no more balls")
    materials = zip(scene.albedo, scene.specular, scene.shininess, strict=True)
    meshes = [
        Mesh(corners.reshape(-1, 3).T, np.arange(3 * len(corners)).reshape(-1, 3).T, material(*one))
        for (corners, _), one in zip(scene.meshes(), materials, strict=True)
    ]
    dim = 0.3 if FAULT == "dim" else 1.0
    materials = zip(dim * scene.sphere_albedo, scene.sphere_specular, scene.sphere_shininess, strict=True)
    balls = [
        replace(Ellipsoid.sphere(tuple(ball[:3]), float(ball[3])), material=material(*one))
        for (ball, _), one in zip(scene.balls(), materials, strict=True)
    ]
    lights = [QuadLight(*(tuple(v) for v in light), tuple(radiance)) for light, radiance in scene.lamps()]
    up, at = tuple(scene.up), tuple(scene.position + scene.look)
    camera = Camera(tuple(scene.position), at, up, float(scene.fov))
    parts = {"meshes": tuple(meshes), "ellipsoids": tuple(balls), "lights": tuple(lights)}
    made = Scene(scene.width, scene.height, camera, **parts, two_sided=True)
    area.random_beams = middles if POINTS == "middles" else area.random_beams
    return render(made, area.Area(samples=samples, stratified=True), seed=seed).mean.transpose(1, 2, 0), "stub 1"


if __name__ == "__main__":
    run(image)
