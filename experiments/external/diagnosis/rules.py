"""Direct lighting with its rules as switches: each switch is a mistake that people make."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nusselt.renderer.lights import Light, colour
from nusselt.renderer.lobes import Lambert, Phong
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats, dot


@dataclass(frozen=True)
class Rules:
    """How light is reckoned; the defaults are right.

    Parameters
    ----------
    surface_cosine : bool
        The factor n.w at the surface.
    facing : {"front", "both", "back", "all"}
        Which side of a parallelogram emits; ``all`` leaves its cosine out.
    falloff : int
        Power of the distance that is divided by.
    over_pi : bool
        Whether the diffuse albedo is divided by pi.
    lobe : {"clamped", "unclamped", "capped", "s+1", "none"}
        The Phong lobe: right, with negative cosines, at most 1, with (s+1) for (s+2), missing.
    visibility : {"right", "none", "beyond", "short"}
        Shadow rays: right, missing, without a far end, 1 % short.
    without : tuple of int
        Lights left out.
    cap : float
        Most radiance that one sample may bring.
    """

    surface_cosine: bool = True
    facing: str = "front"
    falloff: int = 2
    over_pi: bool = True
    lobe: str = "clamped"
    visibility: str = "right"
    without: tuple[int, ...] = ()
    cap: float = math.inf


RIGHT = Rules()


def _solid_angle(light: Light, d: Floats, rules: Rules) -> Floats:
    """What multiplies the light's colour for one beam (n, k) alone, without the surface's cosine."""
    plane = light.plane()
    if light.at_infinity:
        return light.worth(d)
    length = np.sqrt(dot(d, d))
    if plane is None:
        return light.worth(d) * length ** (2 - rules.falloff)
    cosine = -dot(plane[0][:, :, None], d) / length
    cosine = {
        "front": np.maximum(cosine, 0),
        "back": np.maximum(-cosine, 0),
        "both": np.abs(cosine),
        "all": np.where(cosine > 0, 1.0, 0.0),
    }[rules.facing]
    return light.area * cosine / length**rules.falloff


def _lobe(points: ShadingPoints, d: Floats, length: Floats, kind: str) -> Floats:
    s = points.shininess[:, None]
    cosine = dot(points.mirror[:, :, None], d) / length
    with np.errstate(under="ignore", invalid="ignore"):
        if kind == "unclamped":
            power = np.nan_to_num(cosine**s)  # a negative base with a broken exponent is NaN: black on most screens
        else:
            power = np.where(cosine > 0, np.maximum(cosine, 0) ** s, 0.0)
    value = (s + (1 if kind == "s+1" else 2)) / (2 * math.pi) * power
    return np.minimum(value, 1.0) if kind == "capped" else value


def reflected(points: ShadingPoints, light: Light, d: Floats, seen: Floats, rules: Rules, passes: int) -> Floats:
    """Reflected radiance (3, n, passes): the k beams of each point, dealt to passes in turn.

    Parameters
    ----------
    d : (3, n, k) float64
        Towards the light.
    seen : (n, k)
        Share of each beam that arrives.
    """
    tint = colour(light)
    length = np.sqrt(dot(d, d))
    cosine = dot(points.normal[:, :, None], d) / length
    weight = _solid_angle(light, d, rules) * np.where(cosine > 0, cosine if rules.surface_cosine else 1.0, 0.0) * seen
    per_pass = d.shape[2] // passes
    diffuse = points.diffuse / (math.pi if rules.over_pi else 1.0)
    lobe = _lobe(points, d, length, rules.lobe) if rules.lobe != "none" and points.is_glossy else None
    others = [(points.albedo(k), k.evaluate(points, d, length)) for k in points.lobes if k not in (Lambert, Phong)]
    out = np.empty((3, points.count, passes))
    for channel in range(3):
        value = weight * diffuse[channel][:, None]
        if lobe is not None:
            value = value + weight * lobe * points.specular[channel][:, None]
        for albedo, density in others:
            value = value + weight * density * albedo[channel][:, None]
        value = value * tint[channel, 0]
        if math.isfinite(rules.cap):
            value = np.minimum(value, rules.cap)
        out[channel] = value.reshape(points.count, passes, per_pass).mean(axis=2)
    return out
