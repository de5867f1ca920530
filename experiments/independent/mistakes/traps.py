"""What other renderers do by default, and must be told not to: filters, tone curves, denoisers, indirect light."""

from __future__ import annotations

import numpy as np

from nusselt.experiments.independent.rays import Hits, trace
from nusselt.experiments.independent.render import by_cosine, from_light
from nusselt.experiments.independent.steps import RIGHT, Rng
from nusselt.experiments.independent.world import Floats, World

from .mistake import Mistake, Step, everywhere
from .pictures import windows

DIRECTIONS = 16
"""Of indirect light, from each point."""


def _one_bounce(world: World, hits: Hits, rng: Rng) -> Floats:
    """Light that another surface has reflected, by the diffuse albedo: directions by their cosine."""
    count = hits.surface.size
    w, _ = by_cosine(hits.normal * np.where(hits.front, 1, -1), DIRECTIONS, rng)
    others = trace(world, np.repeat(hits.position, DIRECTIONS, axis=1), w.reshape(3, -1))
    on, found = others.shaded & others.front, np.zeros((3, count * DIRECTIONS))
    for light in world.lights if on.any() else ():
        u, v = rng.random((2, int(on.sum()), 1))
        found[:, on] += from_light(world, others.take(on), light, u, v, RIGHT, False, rng)[:, :, 0]
    albedo = world.table("diffuse").T[:, hits.material]
    return np.asarray(albedo * found.reshape(3, count, DIRECTIONS).mean(axis=2))


def _kernel(reach: float, weight: Step) -> Step:
    """The step `pixel` that draws a ray by a reconstruction filter of so many pixels to either side."""
    x = np.linspace(-reach, reach, 2001)
    share = np.cumsum(np.maximum(weight(x / reach), 0))
    return lambda corner, offset: corner + 0.5 + np.interp(offset, share / share[-1], x)


def _blackman_harris(x: Floats) -> Floats:
    """Of -1 to 1 (Harris 1978)."""
    t = np.pi * (x + 1)
    return 0.35875 - 0.48829 * np.cos(t) + 0.14128 * np.cos(2 * t) - 0.01168 * np.cos(3 * t)


def _agx(image: Floats) -> Floats:
    """AgX, Wrensch's fit of its curve (Minimal AgX Implementation, 2023): mixed channels, a logarithm, a sigmoid."""
    mix = np.array([[0.8425, 0.0784, 0.0792], [0.0423, 0.8785, 0.0792], [0.0424, 0.0784, 0.8791]])
    stops = np.log2(np.maximum(np.tensordot(mix, image, 1), 1e-10))
    x = (np.clip(stops, -12.47393, 4.026069) + 12.47393) / (4.026069 + 12.47393)
    curve = np.polyval([15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232], x)
    return np.asarray(np.clip(np.tensordot(np.linalg.inv(mix), curve, 1), 0, 1))


def _hable(image: Floats) -> Floats:
    """Hable's filmic curve of 2010, white at 11.2."""

    def curve(x: Floats) -> Floats:
        return np.asarray((x * (0.15 * x + 0.05) + 0.004) / (x * (0.15 * x + 0.5) + 0.06) - 0.02 / 0.3)

    return curve(2 * image) / curve(np.array(11.2))


def _srgb(image: Floats) -> Floats:
    return np.where(image <= 0.0031308, 12.92 * image, 1.055 * np.maximum(image, 0.0031308) ** (1 / 2.4) - 0.055)


def _bilateral(image: Floats) -> Floats:
    """The mean of 5 x 5 pixels that are of like brightness: a denoiser that keeps edges."""
    around = windows(image, 5)
    near = np.exp(-(((around.mean(axis=0) - image.mean(axis=0)[..., None]) / 0.1) ** 2))
    return np.asarray((around * near).sum(axis=3) / near.sum(axis=2))


TRAPS = (
    Mistake("indirect light", "one bounce of diffuse light too many", "box", "indirect", _one_bounce),
    Mistake("indirect light in a room", "the same, between walls", "cornell", "indirect", _one_bounce),
    Mistake("AgX", "given as radiance", "wall", "finished", everywhere(_agx)),
    Mistake(
        "AgX, decoded",
        "its levels taken for gamma 2.2's",
        "lamp seen",
        "finished",
        everywhere(lambda x: _agx(x) ** 2.2),
    ),
    Mistake("filmic curve", "Hable's", "ball", "finished", everywhere(_hable)),
    Mistake("sRGB", "encoded, given as radiance", "wall", "finished", everywhere(_srgb)),
    Mistake("bilateral filter", "a denoiser that keeps edges", "ball", "finished", everywhere(_bilateral)),
    *(
        Mistake(
            f"{name}, {pixels}",
            f"rays drawn by a filter of {2 * reach:g} pixels across",
            "lamp seen",
            "pixel",
            _kernel(reach, weight),
            pixels=pixels,
        )
        for name, reach, weight in (
            ("Blackman-Harris 1.5", 1.5, _blackman_harris),
            ("Blackman-Harris 2", 2.0, _blackman_harris),
            ("Gaussian 2", 2.0, lambda x: np.exp(-8 * x * x)),
        )
        for pixels in ("jittered", "areas")
    ),
)
