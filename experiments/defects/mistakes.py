"""Mistakes planted in an 8-bit image, each made another way than the hypothesis that is to find it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nusselt.experiments.images.formats.png import to_levels
from nusselt.experiments.scenes import catalogue
from nusselt.experiments.scenes.sizes import at_width
from nusselt.renderer.camera.view import look
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render
from nusselt.renderer.lights import QuadLight
from nusselt.renderer.lights.sampling import random_beams
from nusselt.renderer.lobes import Phong
from nusselt.renderer.needs import Source
from nusselt.renderer.prepared import prepare
from nusselt.renderer.radiance import reflected
from nusselt.renderer.scene import Scene
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.surfaces import Material, Mesh
from nusselt.renderer.vectors import Floats, dot

Levels = NDArray[np.uint8]


@dataclass(frozen=True)
class Plant:
    """One planted mistake: the hypothesis it should be told as, the classic scene, and its image in levels."""

    name: str
    scene: str
    levels: Callable[[Scene, int], Levels]
    change: Callable[[Scene], Scene] = lambda scene: scene


def _broad(scene: Scene) -> Scene:
    """With exponents of 2: at those of polished things the other side of the lobe is too narrow to be met."""
    meshes = tuple(replace(mesh, material=replace(mesh.material, shininess=2.0)) for mesh in scene.meshes)
    balls = tuple(replace(ball, material=replace(ball.material, shininess=2.0)) for ball in scene.ellipsoids)
    return scene.with_(meshes=meshes, ellipsoids=balls)


def _right(scene: Scene, seed: int) -> Floats:
    return render(scene, Area(samples=scene.light_samples, stratified=scene.stratify), seed=seed).mean


def _by(kind: type[Area]) -> Callable[[Scene, int], Levels]:
    def levels(scene: Scene, seed: int) -> Levels:
        return to_levels(render(scene, kind(samples=scene.light_samples, stratified=scene.stratify), seed=seed).mean)

    return levels


def _after(change: Callable[[Floats], Floats]) -> Callable[[Scene, int], Levels]:
    return lambda scene, seed: to_levels(change(_right(scene, seed)))


def _of(change: Callable[[Scene], Scene]) -> Callable[[Scene, int], Levels]:
    return lambda scene, seed: to_levels(_right(change(scene), seed))


def _half_pixel(scene: Scene, seed: int) -> Levels:
    """Every ray through its pixel's top left corner."""
    scene, geometry, needs = prepare(scene)
    estimator = Area(samples=scene.light_samples, stratified=scene.stratify)
    rng = np.random.default_rng(seed)
    out = np.empty((3, scene.height, scene.width))
    for row in range(scene.height):
        view = look(scene, geometry, np.arange(scene.width) + 0.0, np.full(scene.width, float(row)))
        value = view.emission.copy()
        value[:, view.lit] += reflected(view.points, needs, partial(estimator, rng=rng))
        out[:, row] = value
    return to_levels(out)


def _rounded(scene: Scene, seed: int) -> Levels:
    return np.rint(255 * np.clip(_right(scene, seed), 0, 1)).astype(np.uint8)


def _narrow(scene: Scene) -> Scene:
    return scene.with_(camera=replace(scene.camera, fov_y=scene.camera.fov_y - 1))


def _two_sided(scene: Scene) -> Scene:
    """A light of the other side a hair behind each."""
    lights = []
    for light in scene.quad_lights:
        behind = np.array(light.corner) - 1e-6 * np.array(light.normal)
        lights += [light, QuadLight(tuple(behind), light.ac, light.ab, light.radiance)]
    return scene.with_(lights=tuple(lights))


def _last_forgotten(scene: Scene) -> Scene:
    """The last light is seen and blocks, and lights nothing: a mesh that glows."""
    *kept, light = scene.quad_lights
    p, ab, ac = (np.array(v) for v in (light.corner, light.ab, light.ac))
    corners = np.stack((p, p + ac, p + ab + ac, p + ab), axis=1)
    body = Mesh(corners, np.array([(0, 1, 2), (0, 2, 3)]).T, Material(emission=light.radiance))
    return scene.with_(lights=tuple(kept), meshes=(*scene.meshes, body))


def _seen(
    estimator: Area, points: ShadingPoints, source: Source, rng: np.random.Generator, samples: int
) -> tuple[Floats, Floats, Floats]:
    """Ways (3, n, k) to the light, their lengths (n, k), and what arrives before any cosine (n, k)."""
    d, weight = random_beams(source.light, points.position, rng, samples, estimator.stratified)
    visible = source.blockers.visible(points.position, points.ellipsoid, d, source.light.at_infinity)
    return d, np.sqrt(dot(d, d)), weight * visible


def _arriving(points: ShadingPoints, d: Floats, length: Floats, weight: Floats) -> Floats:
    """Irradiance (n, k)."""
    return weight * np.maximum(dot(points.normal[:, :, None], d), 0) / length


def _sent(points: ShadingPoints, arriving: Floats, lobe: Floats) -> Floats:
    """Radiance (3, n): Lambert's share of what arrives (n, k), and that of a glossy lobe (n, k)."""
    return points.diffuse * arriving.sum(axis=1) / np.pi + points.specular * (arriving * lobe).sum(axis=1)


@dataclass(frozen=True, kw_only=True)
class NoCosine(Area):
    """Radiance times solid angle, without n.w."""

    def _block(self, points: ShadingPoints, source: Source, rng: np.random.Generator, samples: int) -> Floats:
        d, length, weight = _seen(self, points, source, rng, samples)
        return _sent(points, weight * (dot(points.normal[:, :, None], d) > 0), Phong.evaluate(points, d, length))


@dataclass(frozen=True, kw_only=True)
class EvenLobe(Area):
    """The Phong lobe to an even power, with nothing cut off."""

    def _block(self, points: ShadingPoints, source: Source, rng: np.random.Generator, samples: int) -> Floats:
        d, length, weight = _seen(self, points, source, rng, samples)
        turned = replace(points, mirror=-points.mirror)
        even = Phong.evaluate(points, d, length) + Phong.evaluate(turned, d, length)
        return _sent(points, _arriving(points, d, length, weight), even)


@dataclass(frozen=True, kw_only=True)
class NoGap(Area):
    """Shadow rays are tried, in float32, against the triangles of the light they go to, and may hit at their end."""

    def _block(self, points: ShadingPoints, source: Source, rng: np.random.Generator, samples: int) -> Floats:
        d, length, weight = _seen(self, points, source, rng, samples)
        quad = source.light.parallelogram()
        if quad is not None:
            p, ab, ac = (v.astype(np.float32)[:, :, None] for v in quad.columns)
            for b, c in ((p + ab, p + ab + ac), (p + ab + ac, p + ac)):
                weight = weight * ~_hit(points.position, d, p, b, c)
        return _sent(points, _arriving(points, d, length, weight), Phong.evaluate(points, d, length))


def _hit(origin: Floats, d: Floats, a: Any, b: Any, c: Any) -> Any:
    """Moller and Trumbore's test in float32, before the ray's end at one."""
    o, d = origin.astype(np.float32)[:, :, None], d.astype(np.float32)
    e, f = b - a, c - a
    h = np.cross(d, f, axis=0)
    det = (e * h).sum(axis=0)
    s = o - a
    with np.errstate(divide="ignore", invalid="ignore"):
        u = (s * h).sum(axis=0) / det
        q = np.cross(s, e, axis=0)
        v = (d * q).sum(axis=0) / det
        t = (f * q).sum(axis=0) / det
    return (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t < 1)


@dataclass(frozen=True, kw_only=True)
class SharedPoints(Area):
    """The same random numbers for every pixel."""

    def _block(self, points: ShadingPoints, source: Source, rng: np.random.Generator, samples: int) -> Floats:
        out = np.empty((3, points.count))
        for index in range(points.count):
            same = np.random.default_rng(source.index)
            out[:, index] = super()._block(points.take(np.array([index])), source, same, samples)[:, 0]
        return out


@dataclass(frozen=True, kw_only=True)
class DullSamples(Area):
    """The lobe of each sample is cut off at one."""

    def _block(self, points: ShadingPoints, source: Source, rng: np.random.Generator, samples: int) -> Floats:
        d, length, weight = _seen(self, points, source, rng, samples)
        dull = np.minimum(Phong.evaluate(points, d, length), 1)
        return _sent(points, _arriving(points, d, length, weight), dull)


PLANTS: tuple[Plant, ...] = (
    Plant("gain", "quad-random", _after(lambda x: 0.98 * x)),
    Plant("gamma", "quad-stratified", _after(lambda x: np.clip(x, 0, 1) ** (1 / 2.2))),
    Plant("half-pixel", "quad-stratified", _half_pixel),
    Plant("mirrored", "three-lights", _after(lambda x: x[:, :, ::-1])),
    Plant("fov", "quad-random", _of(_narrow)),
    Plant("channels-swapped", "cornell", _after(lambda x: x[::-1])),
    Plant("missing-cosine", "quad-random", _by(NoCosine)),
    Plant("two-sided-light", "cornell-boxes", _of(_two_sided)),
    Plant("forgotten-light", "three-lights", _of(_last_forgotten)),
    Plant("lost-samples", "cornell", _by(NoGap)),
    Plant("clamped-highlights", "glossy", _by(DullSamples)),
    Plant("unclamped-phong", "glossy", _by(EvenLobe), _broad),
    Plant("correlated-seeds", "quad-random", _by(SharedPoints)),
    Plant("rounding", "quad-stratified", _rounded),
)


def planted_scene(plant: Plant, width: int | None = None) -> Scene:
    """The scene of a plant, at its own size or at another width of the same shape."""
    return at_width(plant.change(catalogue.load(plant.scene)), width)
