"""Embree as the ray caster, with an estimator of its own: stratified points on each light, through pixel centres.

Embree works in single precision. Positions are found anew in double precision, from the plane or the ball that a ray
met; shadow rays start a little off the surface and end a little before the light, which is a surface too.
"""

from __future__ import annotations

import math
from importlib.metadata import version
from typing import Any

import numpy as np
from plain import RENDERING, Floats, Plain, ball_mesh, normal_area, outline, run  # type: ignore[import-not-found]

LEVELS = 6
"""Of a ball's mesh: 81,920 triangles, whose middles lie 1e-4 radii inside."""


def single(values: Floats) -> Floats:
    """As Embree takes it."""
    return np.ascontiguousarray(values, dtype=np.float32)


class Bodies:
    """All surfaces as one list of triangles, first those of meshes, then lights, then balls."""

    def __init__(self, scene: Plain) -> None:
        from embreex import rtcore_scene  # type: ignore[import-not-found]
        from embreex.mesh_construction import TriangleMesh  # type: ignore[import-not-found]

        vertices, faces = ball_mesh(LEVELS)
        lights = [outline(light)[[[0, 1, 2], [0, 2, 3]]] for light in scene.lights]
        balls = [(ball[:3] + ball[3] * vertices)[faces] for ball in scene.spheres]
        self.corners = np.concatenate([scene.corners, *lights, *balls])
        self.first_light = len(scene.corners)
        self.first_ball = self.first_light + 2 * len(scene.lights)
        dark = 2 * len(scene.lights)

        def of_each(meshes: Floats, balls: Floats) -> Floats:
            """Of each triangle."""
            return np.concatenate(
                [meshes[scene.thing], np.zeros((dark, *meshes.shape[1:])), np.repeat(balls, len(faces), 0)]
            )

        self.albedo = of_each(scene.albedo, scene.sphere_albedo)
        self.specular = of_each(scene.specular, scene.sphere_specular)
        self.shininess = of_each(scene.shininess, scene.sphere_shininess)
        self.ball = np.repeat(np.arange(len(scene.spheres)), len(faces))
        self.spheres = scene.spheres
        edges = self.corners[:, 1:] - self.corners[:, :1]
        normal = np.cross(edges[:, 0], edges[:, 1])
        self.normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
        self.scene: Any = rtcore_scene.EmbreeScene()
        TriangleMesh(self.scene, single(self.corners))

    def first_hits(self, o: Floats, d: Floats) -> tuple[Floats, Floats, Floats]:
        """Number of the triangle (n,), -1 for none; position and unit normal (n, 3)."""
        number = self.scene.run(single(np.broadcast_to(o, d.shape)), single(d), output=True)["primID"].astype(int)
        met = np.maximum(number, 0)
        normal = self.normal[met].copy()
        t = ((self.corners[met, 0] - o) * normal).sum(axis=1) / (d * normal).sum(axis=1)
        position = o + t[:, None] * d
        on = number >= self.first_ball
        ball = self.spheres[self.ball[number[on] - self.first_ball]]
        away = position[on] - ball[:, :3]
        normal[on] = away / np.linalg.norm(away, axis=1, keepdims=True)
        position[on] = ball[:, :3] + ball[:, 3:] * normal[on]
        normal[(d * normal).sum(axis=1) > 0] *= -1  # surfaces reflect on both sides
        return number, position, normal

    def reflected(self, number: Floats, d: Floats, n: Floats, towards: Floats) -> Floats:
        """BRDF (n, 3) of triangles seen along d and lit from a direction: Lambert's part and Phong's.

        Phong's is specular (s + 2) / (2 pi) (r . w)^s, r the mirror direction of the viewer; 0 behind it.
        """
        found = self.albedo[number] / math.pi
        on = np.flatnonzero(self.specular[number].any(axis=1))
        if on.size:
            s, mirror = self.shininess[number[on]], d[on] - 2 * (d[on] * n[on]).sum(axis=1)[:, None] * n[on]
            cosine = (mirror * towards[on]).sum(axis=1)
            lobe = np.where(cosine > 0, np.maximum(cosine, 0) ** s, 0) * (s + 2) / (2 * math.pi)
            found[on] += lobe[:, None] * self.specular[number[on]]
        return found

    def free(self, o: Floats, d: Floats) -> Floats:
        """Whether nothing is met from o to o + d, (n,)."""
        met = self.scene.run(single(o), single(d), query="OCCLUDED", dists=single(np.ones(len(o))))
        return met == -1 if met.dtype != bool else ~met


def render(
    scene: Plain, samples: int = 64, seed: int = 0, offset: float = 1e-4, gap: float = 1e-4, threads: int = 1
) -> tuple[Floats, str]:
    """Image and version; offset in the scene's unit, gap a share of the way. It has one thread, whatever is asked."""
    bodies = Bodies(scene)
    with RENDERING:
        image = traced(scene, bodies, samples, seed, offset, gap)
    return image.reshape(scene.height, scene.width, 3), f"embreex {version('embreex')}"


def traced(scene: Plain, bodies: Bodies, samples: int, seed: int, offset: float, gap: float) -> Floats:
    """Radiance (h * w, 3)."""
    rng, cells = np.random.default_rng(seed), math.isqrt(samples)
    d = scene.centre_rays()
    number, position, normal = bodies.first_hits(scene.position, d)
    image = np.zeros(d.shape)
    for k, light in enumerate(scene.lights):
        facing = (d * normal_area(light)[0]).sum(axis=1) < 0
        image[facing & ((number - bodies.first_light) // 2 == k)] = scene.radiance[k]
    shaded = (number >= 0) & ((number < bodies.first_light) | (number >= bodies.first_ball))
    x, n, met, seen = position[shaded], normal[shaded], number[shaded], d[shaded]
    found = np.zeros(x.shape)
    for light, radiance in scene.lamps():
        front, area = normal_area(light)
        for i, j in np.ndindex(cells, cells):
            u, v = ((step + rng.random(len(x))) / cells for step in (i, j))
            way = light[0] + u[:, None] * light[1] + v[:, None] * light[2] - x
            r = np.linalg.norm(way, axis=1)
            term = np.maximum((way * n).sum(axis=1), 0) * np.maximum(-(way @ front), 0) / r**4 * area / cells**2
            on = np.flatnonzero(term > 0)
            free = bodies.free(x[on] + offset * n[on], (way[on] - offset * n[on]) * (1 - gap))
            brdf = bodies.reflected(met[on], seen[on], n[on], way[on] / r[on, None])
            found[on] += (term[on] * free)[:, None] * radiance * brdf
    image[shaded] = found
    return image


if __name__ == "__main__":
    run(render, scale=8.0)
