"""Mistakes of what blocks, and where shadow rays begin and end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nusselt.experiments.independent.rays import NEAR, Hits, crossings, visible
from nusselt.experiments.independent.world import Floats, Light, World

from .mistake import Mistake, Step, by_chance


def _between(low: float, high: float) -> Step:
    """The step `visible` with other ends."""
    return lambda world, hits, d, light: visible(world, hits, d, light, low, high)


def _without(**fields: Step) -> Step:
    """The step `visible` in a scene with less in it; each field's value takes the right one."""

    def step(world: World, hits: Hits, d: Floats, light: Light) -> Floats:
        less = {name: change(getattr(world, name)) for name, change in fields.items()}
        return visible(replace(world, **less), hits, d, light)

    return step


def _grown(balls: Floats) -> Floats:
    larger = balls.copy()
    larger[:, :3, :3] *= 1.05
    return larger


def _culled(world: World, hits: Hits, d: Floats, light: Light) -> Floats:
    """Only triangles that a ray meets from their front block."""
    n, s = d.shape[1:]
    ways, edges = d.reshape(3, -1), world.triangles[:, 1:] - world.triangles[:, :1]
    facing = np.cross(edges[:, 0], edges[:, 1]) @ ways
    t, inside = crossings(world.triangles, np.repeat(hits.position, s, axis=1), ways)
    blocked = (inside & (facing.T < 0) & (t > 1e-6) & (t < 1 - 1e-6)).any(axis=1)
    return (~blocked).reshape(n, s) * visible(replace(world, triangles=world.triangles[:0]), hits, d, light)


def _to_the_centre(world: World, hits: Hits, d: Floats, light: Light) -> Floats:
    """One shadow ray, to the light's middle, for all samples."""
    if light.kind != "quad":
        return visible(world, hits, d, light)
    way = (light.place + (light.u + light.v) / 2)[:, None] - hits.position
    return np.repeat(visible(world, hits, way[:, :, None], light), d.shape[2], axis=1)


def _first(world: World, hits: Hits, d: Floats, light: Light) -> Floats:
    """The first sample's answer for all."""
    return np.repeat(visible(world, hits, d[:, :, :1], light), d.shape[2], axis=1)


def _averaged(world: World, hits: Hits, d: Floats, light: Light) -> Floats:
    """The average visibility, times what arrives without any."""
    seen = visible(world, hits, d, light)
    return np.repeat(seen.mean(axis=1, keepdims=True), d.shape[2], axis=1)


def _lifted(distance: float) -> Step:
    """The step `visible` from points moved along their normals, the way unchanged."""
    return lambda world, hits, d, light: visible(
        world, replace(hits, position=hits.position + distance * hits.normal), d, light
    )


def _acne(world: World, hits: Hits, d: Floats, light: Light) -> Floats:
    """One shadow ray in twenty meets its own surface."""
    return visible(world, hits, d, light) * ~by_chance(d, 0.05)


def _leaking(share: float) -> Step:
    """The step `visible` that loses a share of the hits."""
    return lambda world, hits, d, light: np.maximum(visible(world, hits, d, light), by_chance(d, share))


VISIBILITY = (
    Mistake("no shadows", "nothing blocks", "ball", "visible", lambda world, hits, d, light: np.ones(d.shape[1:])),
    Mistake("rays go on behind the light", "what stands behind it blocks", "cornell", "visible", _between(NEAR, 1.001)),
    Mistake(
        "endless rays", "all that stands behind the light blocks", "cornell-boxes", "visible", _between(NEAR, np.inf)
    ),
    Mistake("rays 5 % short", "what is near the light does not block", "shade", "visible", _between(NEAR, 0.95)),
    Mistake("rays 3 % short", "what is near the light does not block", "shade", "visible", _between(NEAR, 0.97)),
    Mistake("rays half as long", "what is beyond half way does not block", "shade", "visible", _between(NEAR, 0.5)),
    Mistake(
        "epsilon of a tenth",
        "what is near the surface does not block",
        "tilted lamp and box",
        "visible",
        _between(0.1, 1 - NEAR),
    ),
    Mistake(
        "epsilon of a twentieth",
        "what is near the surface does not block",
        "tilted lamp and box",
        "visible",
        _between(0.05, 1 - NEAR),
    ),
    Mistake(
        "epsilon at both ends", "a tenth of the way at either end", "tilted lamp and box", "visible", _between(0.1, 0.9)
    ),
    Mistake("balls do not block", "forgotten by shadow rays", "ball", "visible", _without(balls=lambda b: b[:0])),
    Mistake(
        "triangles do not block",
        "forgotten by shadow rays",
        "cornell-boxes",
        "visible",
        _without(triangles=lambda t: t[:0], triangle_material=lambda t: t[:0]),
    ),
    Mistake(
        "a triangle does not block",
        "the last one is forgotten",
        "sheet",
        "visible",
        _without(triangles=lambda t: t[:-1]),
    ),
    Mistake(
        "two of a box's sides do not block",
        "four triangles are forgotten",
        "tilted lamp and box",
        "visible",
        _without(triangles=lambda t: np.concatenate((t[:8], t[12:]))),
    ),
    Mistake(
        "lights do not block", "forgotten by shadow rays", "three-lights", "visible", _without(lights=lambda lights: ())
    ),
    Mistake("backs do not block", "culled for shadow rays", "sheet", "visible", _culled),
    Mistake("balls 5 % larger in shadows", "a bounding body blocks", "ball", "visible", _without(balls=_grown)),
    Mistake("shadow rays to the centre", "hard shadows", "ball", "visible", _to_the_centre),
    Mistake("one shadow ray", "the first sample's for all samples", "ball", "visible", _first),
    Mistake("visibility averaged apart", "mean visibility times mean light", "low lamp", "visible", _averaged),
    Mistake(
        "shadows not black",
        "a tenth of what is blocked arrives",
        "ball",
        "visible",
        lambda world, hits, d, light: 0.1 + 0.9 * visible(world, hits, d, light),
    ),
    Mistake(
        "lifted off by 0.05", "shadow rays begin above the surface", "tilted lamp and box", "visible", _lifted(0.05)
    ),
    Mistake(
        "lifted off by 0.01", "shadow rays begin above the surface", "tilted lamp and box", "visible", _lifted(0.01)
    ),
    Mistake("acne", "a twentieth of shadow rays meet their own surface", "ball", "visible", _acne),
    Mistake("1 in 50 blockers missed", "by shadow rays", "ball", "visible", _leaking(0.02)),
    Mistake("1 in 1000 blockers missed", "by shadow rays", "cornell-boxes", "visible", _leaking(0.001)),
)
