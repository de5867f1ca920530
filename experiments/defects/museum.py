"""Bugs of public renderers and exporters, each as its thread tells it, planted in the independent renderer.

Left out, since no scene of ours can show them:

* mitsuba-renderer/mitsuba3#1952 and mmp/pbrt-v3#229's cause: emitters with vertex normals, which no mesh here has.
* mitsuba-renderer/mitsuba3#42, mmp/pbrt-v4#468: light traced from emitters; only direct light is judged.
* mitsuba-renderer/mitsuba3#1844, BabylonJS/Exporters#689: the cone of a spot light, which the independent renderer
  does not have.
* gkjohnson/three-gpu-pathtracer#847: densities of lobes that no direct-light sampler here draws from.
* mitsuba-renderer/mitsuba-blender#122, #144: another model of rough surfaces, which is no mistake in this one.
* LuxCoreRender/LuxCore#443: a sphere light that becomes a point; the independent renderer has no sphere lights.
* mmp/pbrt-v4#471, #484: no bug.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from nusselt.experiments.independent.mistakes import KINDS, MISTAKES, Mistake
from nusselt.experiments.independent.mistakes.mistake import by_chance
from nusselt.experiments.independent.mistakes.told import names_of
from nusselt.experiments.independent.rays import Hits, visible
from nusselt.experiments.independent.steps import Batch, Rng, places, quad_term
from nusselt.experiments.independent.world import Bools, Floats, Light, World


@dataclass(frozen=True)
class Exhibit:
    """A bug that somebody had.

    Parameters
    ----------
    source : str
        Repository and number of its thread.
    mistake : Mistake
        What is planted; ``says`` tells the bug.
    names : tuple of str
        What it is rightly called.
    """

    source: str
    mistake: Mistake
    names: tuple[str, ...]


def _known(source: str, name: str, says: str, scene: str = "") -> Exhibit:
    """One that is among the mistakes."""
    kind = next(kind for kind, every in KINDS.items() if any(one.name == name for one in every))
    mistake = next(one for one in MISTAKES if one.name == name)
    return Exhibit(source, replace(mistake, says=says, scene=scene or mistake.scene), names_of(name, kind))


def _factor(kind: str, factor: float) -> Callable[[Light, Floats], Floats]:
    return lambda light, values: values * (factor if light.kind == kind else 1.0)


def _two_triangles(batch: Batch, samples: int, strata: bool) -> tuple[Floats, Floats]:
    """A parallelogram as two triangles, in each of which one coordinate is drawn without its square root."""
    u, v = places(batch, samples, strata)
    first, a = u < 0.5, 2 * u % 1
    b = v * (1 - a)
    return np.where(first, a, 1 - a), np.where(first, b, 1 - b)


def _no_number_on_edges(light: Light, cosine: Floats, r: Floats) -> Floats:
    """No number where a place lies in the light's plane, to half a per cent of a right angle."""
    return np.where(np.abs(cosine) < 0.005, np.nan, quad_term(light, cosine, r))


def _neighbour(image: Floats, shaded: Bools, rng: Rng) -> Floats:
    """One pixel in 500 gives its sample to the one on its left."""
    lost = rng.random(shaded.shape) < 0.002
    lost[:, 0] = False
    moved = np.roll(np.where(lost, image, 0.0), -1, axis=2)
    return np.where(lost, 0.0, image) + moved


def _self_shadow(world: World, hits: Hits, d: Floats, light: Light) -> Floats:
    """A third of the places lie below their own surface by rounding: nothing reaches them."""
    return visible(world, hits, d, light) * ~by_chance(hits.position, 1 / 3)[:, None]


LIGHTER = ("light-factor", "light-scale", "gain")
MUSEUM: tuple[Exhibit, ...] = (
    Exhibit(
        "mitsuba-renderer/mitsuba3#1861",
        Mistake(
            "4 emitter samples of a point light",
            "samples of lights without extent are summed, not averaged: brighter with their number",
            "point and lamp",
            "arriving",
            _factor("point", 4.0),
        ),
        LIGHTER,
    ),
    Exhibit(
        "KhronosGroup/glTF-Blender-IO#564",
        Mistake(
            "power for intensity",
            "a point light's watts are written where watts per steradian belong",
            "point",
            "arriving",
            _factor("point", 4 * math.pi),
        ),
        LIGHTER,
    ),
    _known("PearCoding/Ignis#27", "point by its power", "a point light's intensity lacks a factor of 4 pi"),
    Exhibit(
        "mitsuba-renderer/mitsuba-blender#109",
        Mistake(
            "4 for pi",
            "an area light's watts become radiance by a 4 where pi belongs",
            "ball",
            "arriving",
            _factor("quad", math.pi / 4),
        ),
        LIGHTER,
    ),
    Exhibit(
        "nvpro-samples/vk_gltf_renderer#38",
        Mistake(
            "weighted though alone",
            "a light without extent is weighted against directions of the surface, which never meet it",
            "direction",
            "cosine",
            lambda c: np.maximum(c, 0) / (1 + np.maximum(c, 0) / math.pi),
        ),
        (),
    ),
    Exhibit(
        "RayTracing/raytracing.github.io#145",
        Mistake(
            "cosine cubed",
            "directions in a sphere for those on it: what is called Lambert's falls as the cube of the cosine",
            "ball",
            "cosine",
            lambda c: 2 * np.maximum(c, 0) ** 3,
        ),
        ("cosine-squared",),
    ),
    Exhibit(
        "w23/xash3d-fwgs#265",
        Mistake(
            "triangles without the root",
            "points crowd at one corner of each of a light's triangles",
            "low lamp",
            "places",
            _two_triangles,
        ),
        ("light-points",),
    ),
    Exhibit(
        "o3de/o3de#5912",
        Mistake(
            "no number in the light's plane",
            "an inverse root of nothing where a quad light meets a surface",
            "tilted lamp",
            "quad_term",
            _no_number_on_edges,
        ),
        (),
    ),
    Exhibit(
        "mitsuba-renderer/mitsuba3#287",
        Mistake(
            "samples in the next pixel",
            "rounding puts a pixel's only sample into its neighbour",
            "ball",
            "finished",
            _neighbour,
        ),
        (),
    ),
    Exhibit(
        "knightcrawler25/GLSL-PathTracer#35",
        Mistake(
            "places below their surface",
            "an offset in scene units is too small for a large scene: surfaces shadow themselves",
            "ball",
            "visible",
            _self_shadow,
        ),
        ("lost-samples", "gain", "light-scale"),
    ),
    _known(
        "mitsuba-renderer/mitsuba2#171",
        "lifted off by 0.05",
        "shadow rays start so far off a surface that shadows at its foot are lost",
    ),
    _known("LuxCoreRender/LuxCore#68", "lights averaged", "of two lights one is chosen, by a chance not its own"),
    _known("mmp/pbrt-v3#229", "light turned over", "the side that emits is flipped"),
    _known(
        "Unity-Technologies/ScriptableRenderPipeline#4597",
        "light from its back",
        "a rectangular light lights what is behind it",
    ),
    _known(
        "gkjohnson/three-gpu-pathtracer#343",
        "lights do not block",
        "shadow rays pass through other lights",
    ),
    _known("godotengine/godot#53844", "1 in 50 blockers missed", "an epsilon of the triangle test loses hits"),
    _known("JiayinCao/SORT#35", "numbers repeated by tiles", "every thread begins with the same seed"),
    _known("bevyengine/bevy#2955", "normals by the matrix", "normals of stretched balls by the matrix itself"),
    _known("mrdoob/three.js#7523", "albedo not over pi", "pi is in the lights' units, or in nothing"),
    _known("godotengine/godot#11748", "no surface cosine", "a model of reflection comes without the cosine"),
    _known("isl-org/Open3D#7579", "half a pixel", "a pixel's centre is at its corner"),
    _known("RayTracing/raytracing.github.io#1076", "upside down", "the image is turned over"),
)
"""All of them."""
