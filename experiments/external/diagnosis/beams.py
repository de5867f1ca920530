"""The beams of one light at the probe's points, and what they bring under a rule: right, or with one mistake in it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from nusselt.renderer.lights import Light, colour
from nusselt.renderer.lobes import Lambert, Phong
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats, dot


@dataclass(frozen=True, eq=False)
class Beams:
    """Beams of one light: k of each of n points, dealt to passes in turn.

    Parameters
    ----------
    light : Light
    points : ShadingPoints
    u, v : (n, k) float64
        Of the unit square.
    d : (3, n, k) float64
        Towards the light.
    seen : (n, k) float64
        Share of each that arrives.
    passes : int
    """

    light: Light
    points: ShadingPoints
    u: Floats
    v: Floats
    d: Floats
    seen: Floats
    passes: int

    @cached_property
    def r(self) -> Floats:
        return np.sqrt(dot(self.d, self.d))

    @cached_property
    def cosine(self) -> Floats:
        """At the surface, of either sign."""
        return dot(self.points.normal[:, :, None], self.d) / self.r

    @cached_property
    def at_light(self) -> Floats:
        """At a light that shines from a plane, of either sign; 1 at others."""
        plane = self.light.plane()
        if plane is None:
            return np.ones_like(self.r)
        return np.asarray(-dot(plane[0][:, :, None], self.d) / self.r)

    @cached_property
    def eye(self) -> Floats:
        """Cosine at the surface towards the eye, (n, 1)."""
        return dot(self.points.normal, self.points.outgoing)[:, None]

    @cached_property
    def mirror(self) -> Floats:
        """Cosine to the mirror direction."""
        return dot(self.points.mirror[:, :, None], self.d) / self.r

    @cached_property
    def half(self) -> Floats:
        """Cosine of the half vector to the normal."""
        h = self.d / self.r + self.points.outgoing[:, :, None]
        return dot(self.points.normal[:, :, None], h) / np.sqrt(np.maximum(dot(h, h), 1e-300))

    @cached_property
    def worth(self) -> Floats:
        """What multiplies the light's colour for one beam alone, without the surface's cosine."""
        return self.light.worth(self.points.position, self.d)

    @cached_property
    def exponent(self) -> Floats:
        return self.points.shininess[:, None]

    def mean(self, values: Floats) -> Floats:
        """Over each pass's beams, (n, passes)."""
        n = self.points.count
        values = np.broadcast_to(values, self.r.shape)
        return np.asarray(values.reshape(n, self.passes, values.shape[1] // self.passes).mean(axis=2))


def right_weight(b: Beams) -> Floats:
    """What a beam brings, without what the surface makes of it and without shadow."""
    return np.asarray(b.worth * np.maximum(b.cosine, 0))


def right_lobe(b: Beams) -> Floats:
    """(s + 2) / (2 pi) max(r.w, 0)^s."""
    return (b.exponent + 2) / (2 * math.pi) * power(b.mirror, b.exponent)


def power(cosine: Floats, exponent: Floats) -> Floats:
    """max(c, 0)^s, 0 below the horizon."""
    with np.errstate(under="ignore"):
        return np.where(cosine > 0, np.maximum(cosine, 0.0) ** exponent, 0.0)


def diffuse(b: Beams) -> Floats:
    """k_d / pi, (3, n)."""
    return b.points.diffuse / math.pi


def specular(b: Beams) -> Floats:
    """k_s, (3, n)."""
    return b.points.specular


@dataclass(frozen=True)
class Rule:
    """How one light's light is reckoned; the defaults are right.

    Parameters
    ----------
    weight, lobe : callable
        Of beams, (n, k).
    diffuse, specular : callable
        Of beams, (3, n): what multiplies the mean weight, and the mean of weight times lobe.
    """

    weight: Callable[[Beams], Floats] = right_weight
    lobe: Callable[[Beams], Floats] | None = right_lobe
    diffuse: Callable[[Beams], Floats] = diffuse
    specular: Callable[[Beams], Floats] = specular

    def radiance(self, b: Beams) -> Floats:
        """Reflected radiance (3, n, passes) of one light."""
        weight = self.weight(b) * b.seen
        out = self.diffuse(b)[:, :, None] * b.mean(weight)
        if self.lobe is not None and b.points.is_glossy:
            out = out + self.specular(b)[:, :, None] * b.mean(weight * self.lobe(b))
        for kind in b.points.lobes:
            if kind not in (Lambert, Phong):
                out = out + b.points.albedo(kind)[:, :, None] * b.mean(weight * kind.evaluate(b.points, b.d, b.r))
        return np.asarray(out * colour(b.light)[:, :, None])

    def samples(self, b: Beams) -> Iterator[Floats]:
        """What each sample brings (n, k), channel by channel, the other lobes' light left out."""
        weight = self.weight(b) * b.seen
        lobe = self.lobe(b) if self.lobe is not None and b.points.is_glossy else np.zeros(1)
        for tint, kd, ks in zip(colour(b.light)[:, 0], self.diffuse(b), self.specular(b), strict=True):
            yield tint * weight * (kd[:, None] + ks[:, None] * lobe)


RIGHT = Rule()


def seen_as(b: Beams, seen: Floats) -> Beams:
    """The same beams, other shadows."""
    return replace(b, seen=np.broadcast_to(seen, b.r.shape))
