"""Mistakes of the Phong lobe and what is added to it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from nusselt.experiments.independent.rays import dot
from nusselt.experiments.independent.steps import Surface, brdf, lobe
from nusselt.experiments.independent.world import Floats

from .mistake import Mistake, Step


def _with(change: Step) -> Step:
    """The step `brdf` on other materials."""
    return lambda surface, normal, towards, w: brdf(change(surface), normal, towards, w)


def _lobe(change: Step) -> Step:
    """The step `brdf` with another lobe: change(lobe, surface, normal, towards, w)."""
    return lambda surface, normal, towards, w: (
        surface.diffuse / math.pi
        + surface.specular * change(lobe(surface, normal, towards, w), surface, normal, towards, w)
    )


def _half_vector(surface: Surface, normal: Floats, towards: Floats, w: Floats) -> Floats:
    half = towards[:, :, None] + w
    cosine = np.maximum(dot(normal[:, :, None], half / np.maximum(np.sqrt(dot(half, half)), 1e-12)), 0)
    return np.asarray((surface.shininess + 2) / (2 * math.pi) * cosine**surface.shininess)


def _even(surface: Surface, normal: Floats, towards: Floats, w: Floats) -> Floats:
    """The absolute value of r.w: an even exponent without the clamp."""
    return lobe(surface, normal, towards, w) + lobe(surface, normal, towards, -w)


def _schlick(surface: Surface, normal: Floats, towards: Floats, w: Floats) -> Floats:
    return np.asarray(0.04 + 0.96 * (1 - np.clip(dot(normal[:, :, None], w), 0, 1)) ** 5)


def _over_cosine(value: Floats, normal: Floats, w: Floats) -> Floats:
    return np.asarray(value / np.maximum(dot(normal[:, :, None], w), 0.02))


SURFACES = (
    Mistake(
        "(s + 1) for (s + 2)",
        "the lobe's norm",
        "shiny ball",
        "brdf",
        _lobe(lambda f, s, n, v, w: f * (s.shininess + 1) / (s.shininess + 2)),
    ),
    Mistake(
        "(s + 8) / 8 pi",
        "Blinn's norm on Phong's lobe",
        "shiny ball",
        "brdf",
        _lobe(lambda f, s, n, v, w: f * (s.shininess + 8) / 4 / (s.shininess + 2)),
    ),
    Mistake(
        "lobe without norm",
        "cos^s alone",
        "shiny ball",
        "brdf",
        _lobe(lambda f, s, n, v, w: f * 2 * math.pi / (s.shininess + 2)),
    ),
    Mistake("lobe over pi", "(s + 2) / (2 pi^2)", "shiny ball", "brdf", _lobe(lambda f, s, n, v, w: f / math.pi)),
    Mistake("exponent one more", "s + 1", "shiny ball", "brdf", _with(lambda s: replace(s, shininess=s.shininess + 1))),
    Mistake("exponent twice", "2 s", "shiny ball", "brdf", _with(lambda s: replace(s, shininess=2 * s.shininess))),
    Mistake(
        "exponent a quarter", "s / 4", "shiny ball", "brdf", _with(lambda s: replace(s, shininess=s.shininess / 4))
    ),
    Mistake(
        "half vector",
        "Blinn's lobe with Phong's exponent",
        "shiny ball",
        "brdf",
        _lobe(lambda f, s, n, v, w: _half_vector(s, n, v, w)),
    ),
    Mistake(
        "half vector, four times the exponent",
        "Blinn's lobe, which is nearly Phong's",
        "shiny ball",
        "brdf",
        _lobe(lambda f, s, n, v, w: _half_vector(replace(s, shininess=4 * s.shininess), n, v, w)),
    ),
    Mistake("mirror's sign", "-r for r", "shiny floor", "brdf", _lobe(lambda f, s, n, v, w: lobe(s, n, v, -w))),
    Mistake(
        "lobe not clamped", "|r.w|^s", "lamp behind the eye", "brdf", _lobe(lambda f, s, n, v, w: _even(s, n, v, w))
    ),
    Mistake(
        "lobe without the cosine",
        "n.w is left out of the glossy part",
        "shiny ball",
        "brdf",
        _lobe(lambda f, s, n, v, w: _over_cosine(f, n, w)),
    ),
    Mistake("no lobe", "the glossy part is left out", "shiny ball", "brdf", _lobe(lambda f, s, n, v, w: 0 * f)),
    Mistake(
        "lobe in the diffuse colour",
        "k_d for k_s",
        "shiny ball",
        "brdf",
        _with(lambda s: replace(s, specular=np.where(s.specular > 0, s.diffuse, 0))),
    ),
    Mistake(
        "lobe alone",
        "the diffuse part of glossy things is left out",
        "shiny ball",
        "brdf",
        _with(lambda s: replace(s, diffuse=np.where(s.specular > 0, 0, s.diffuse))),
    ),
    Mistake(
        "energy shared",
        "k_d (1 - k_s)",
        "shiny ball",
        "brdf",
        _with(lambda s: replace(s, diffuse=s.diffuse * (1 - s.specular))),
    ),
    Mistake("lobe cut off at 1", "min(lobe, 1)", "shiny ball", "brdf", _lobe(lambda f, s, n, v, w: np.minimum(f, 1))),
    Mistake(
        "Fresnel",
        "Schlick's factor on k_s",
        "shiny ball",
        "brdf",
        _lobe(lambda f, s, n, v, w: f * _schlick(s, n, v, w)),
    ),
    Mistake(
        "lobe 1 % too strong",
        "k_s times 1.01",
        "shiny floor",
        "brdf",
        _with(lambda s: replace(s, specular=1.01 * s.specular)),
    ),
    Mistake(
        "albedo of one thing",
        "the first material is 5 % darker",
        "ball",
        "world",
        lambda world: replace(
            world, materials=(replace(world.materials[0], diffuse=(0.475,) * 3), *world.materials[1:])
        ),
    ),
    Mistake(
        "materials exchanged",
        "the last thing has the first one's",
        "ball",
        "world",
        lambda world: replace(world, ball_material=0 * world.ball_material),
    ),
)
