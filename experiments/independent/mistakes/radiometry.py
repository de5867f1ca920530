"""Mistakes of factors, cosines, falloff, pi and measures."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from nusselt.experiments.independent.rays import Hits, dot
from nusselt.experiments.independent.steps import Surface, brdf, lobe, shown
from nusselt.experiments.independent.world import Floats, Light, World

from .mistake import Mistake, Step, everywhere, where_shaded


def _gain(factor: float) -> Mistake:
    says = f"what arrives is multiplied by {factor:g}"
    return Mistake(f"gain {factor:g}", says, "ball", "arriving", lambda light, values: factor * values)


def _colours(change: Step) -> Step:
    """The step `world` that changes the lights."""
    return lambda world: replace(world, lights=tuple(change(light) for light in world.lights))


def _of(kind: str, factor: float) -> Step:
    """The step `arriving` that multiplies what lights of a kind bring."""
    return lambda light, values: values * (factor if light.kind == kind else 1)


def _by_view(surface: Surface, normal: Floats, towards: Floats, w: Floats) -> Floats:
    """The eye's cosine in place of the light's."""
    cosine = dot(normal[:, :, None], w)
    turned = dot(normal, towards)[:, None] / np.where(cosine > 1e-9, cosine, 1.0)
    return brdf(surface, normal, towards, w) * turned


def _diffuse(factor: float) -> Step:
    """The step `brdf` with another diffuse part."""
    return lambda surface, normal, towards, w: (
        surface.diffuse * factor / math.pi + surface.specular * lobe(surface, normal, towards, w)
    )


def _squared(surface: Surface, normal: Floats, towards: Floats, w: Floats) -> Floats:
    return brdf(replace(surface, diffuse=surface.diffuse**2), normal, towards, w)


def _area(power: float, r_power: float, light_power: float = 1.0) -> Step:
    """The step `quad_term` with other powers of the area, the distance and the light's cosine."""

    def term(light: Light, cosine: Floats, r: Floats) -> Floats:
        facing = np.where(cosine > 0, np.maximum(cosine, 1e-300) ** light_power, 0.0)
        return np.asarray(light.area**power * facing / r**r_power)

    return term


def _from_both_sides(world: World, hits: Hits) -> Floats:
    return shown(world, replace(hits, front=np.ones_like(hits.front)))


RADIOMETRY = (
    *map(_gain, (0.98, 1.005, 1.02)),
    Mistake("no surface cosine", "n.w is left out", "ball", "cosine", lambda c: (c > 0).astype(float)),
    Mistake("surface cosine squared", "n.w is taken twice", "ball", "cosine", lambda c: np.maximum(c, 0) ** 2),
    Mistake("surface cosine not clamped", "a negative n.w is kept", "low lamp", "cosine", lambda c: c),
    Mistake("surface cosine's absolute value", "light from behind the surface counts", "low lamp", "cosine", np.abs),
    Mistake("eye's cosine", "n.v stands for n.w", "ball", "brdf", _by_view),
    Mistake("no light cosine", "the light's cosine is left out", "ball", "quad_term", _area(1, 2, 0)),
    Mistake("light cosine squared", "the light's cosine is taken twice", "ball", "quad_term", _area(1, 2, 2)),
    Mistake("1/r", "an area light falls off by 1/r", "ball", "quad_term", _area(1, 1)),
    Mistake("1/r^3", "an area light falls off by 1/r^3", "ball", "quad_term", _area(1, 3)),
    Mistake("1/r^4", "r^2 is divided by twice", "ball", "quad_term", _area(1, 4)),
    Mistake("no falloff", "distance does not matter", "ball", "quad_term", _area(1, 0)),
    Mistake("no area", "the light's area is left out", "ball", "quad_term", _area(0, 2)),
    Mistake("area squared", "the light's area is taken twice", "ball", "quad_term", _area(2, 2)),
    Mistake(
        "area measure", "neither 1/r^2 nor the light's cosine: dA is taken for dw", "ball", "quad_term", _area(1, 0, 0)
    ),
    Mistake("measure changed twice", "cos/r^2 is taken twice", "ball", "quad_term", _area(1, 4, 2)),
    Mistake("area 1 % too large", "as if an edge were 1 % longer", "ball", "arriving", _of("quad", 1.01)),
    Mistake("area of a triangle", "|u x v| / 2", "ball", "arriving", _of("quad", 0.5)),
    Mistake(
        "radiance times pi",
        "radiance is taken for radiant exitance the wrong way",
        "ball",
        "arriving",
        _of("quad", math.pi),
    ),
    Mistake("radiance over pi", "radiance is taken for radiant exitance", "ball", "arriving", _of("quad", 1 / math.pi)),
    Mistake("albedo not over pi", "k_d, not k_d / pi", "ball", "brdf", _diffuse(math.pi)),
    Mistake("albedo over pi twice", "k_d / pi^2", "ball", "brdf", _diffuse(1 / math.pi)),
    Mistake("albedo over two pi", "k_d / (2 pi)", "ball", "brdf", _diffuse(0.5)),
    Mistake("albedo twice", "k_d is multiplied by twice", "ball", "brdf", _squared),
    Mistake("point 1/r", "a point light falls off by 1/r", "point and lamp", "point_term", lambda r: 1 / r),
    Mistake("point without falloff", "distance does not matter", "point and lamp", "point_term", np.ones_like),
    Mistake(
        "point by its power", "intensity is divided by 4 pi", "point and lamp", "arriving", _of("point", 0.25 / math.pi)
    ),
    Mistake("point over pi", "intensity is divided by pi", "point and lamp", "arriving", _of("point", 1 / math.pi)),
    Mistake("point attenuated", "1 / (1 + r^2)", "point and lamp", "point_term", lambda r: 1 / (1 + r * r)),
    Mistake(
        "direction over pi",
        "irradiance is divided by pi",
        "direction and lamp",
        "arriving",
        _of("directional", 1 / math.pi),
    ),
    Mistake(
        "direction 1 % too strong", "irradiance times 1.01", "direction and lamp", "arriving", _of("directional", 1.01)
    ),
    Mistake(
        "direction not normalised",
        "its length of 1.1 stays in n.w",
        "direction and lamp",
        "world",
        _colours(lambda light: replace(light, place=1.1 * light.place) if light.kind == "directional" else light),
    ),
    Mistake(
        "grey lights",
        "the light's colour is averaged",
        "wall",
        "world",
        _colours(lambda light: replace(light, colour=np.full(3, light.colour.mean()))),
    ),
    Mistake(
        "red 1 % too strong",
        "one channel of what arrives",
        "wall",
        "arriving",
        lambda light, values: values * np.array([1.01, 1, 1])[:, None, None],
    ),
    Mistake("ambient light", "0.005 is added to every surface", "box", "finished", where_shaded(lambda x: x + 0.005)),
    Mistake(
        "ambient in the shadows",
        "no surface is darker than 0.03",
        "box",
        "finished",
        where_shaded(lambda x: np.maximum(x, 0.03)),
    ),
    Mistake(
        "tilted lights forgotten",
        "only level lights count",
        "two lamps",
        "arriving",
        lambda light, values: values * (light.normal[1] < -0.99),
    ),
    Mistake(
        "lights averaged",
        "the sum over lights is divided by their number",
        "two lamps",
        "arriving",
        lambda light, values: values / 2,
    ),
    Mistake(
        "light seen twice as bright",
        "emission is added once a light",
        "three-lights",
        "shown",
        lambda world, hits: 3 * shown(world, hits),
    ),
    Mistake(
        "light seen cut off at 1",
        "emission is clamped",
        "lamp seen",
        "shown",
        lambda world, hits: np.minimum(shown(world, hits), 1),
    ),
    Mistake(
        "light not seen",
        "emitters are black to the camera",
        "lamp seen",
        "shown",
        lambda world, hits: np.zeros_like(hits.position),
    ),
    Mistake(
        "light's back seen", "emission on both sides, to the camera", "lamp from behind", "shown", _from_both_sides
    ),
    Mistake(
        "light from its back",
        "the light's cosine by its absolute value",
        "lamp from behind",
        "quad_term",
        lambda light, cosine, r: light.area * np.abs(cosine) / r**2,
    ),
    Mistake(
        "light turned over",
        "edges in the other order",
        "ball",
        "world",
        _colours(lambda light: replace(light, u=light.v, v=light.u)),
    ),
    Mistake("Reinhard", "x / (1 + x)", "ball", "finished", everywhere(lambda x: x / (1 + x))),
    Mistake(
        "gamma 2.2",
        "x^(1/2.2), given as radiance",
        "ball",
        "finished",
        everywhere(lambda x: np.maximum(x, 0) ** (1 / 2.2)),
    ),
    Mistake("exposure 1.1", "all of the image times 1.1", "lamp seen", "finished", everywhere(lambda x: 1.1 * x)),
)
