"""The closed form minus what is hidden from light points that all pixels share.

L_r = U - L A/N sum_k f(w_k) G(x_k) (1 - V_k) with the x_k on a Fibonacci lattice (Sloan & Joe 1994), the same
for every point of a call. Shared points cost little each: what a light point sees is found for all pixels at
once (see `shared_points`), and a lattice has no direction in which an edge meets many of its points: the
error in penumbrae falls as N^-0.98, against N^-0.75 for strata and N^-0.5 for independent points.

Shifted at random over the light (Cranley & Patterson 1976) the estimate is unbiased. Its noise is shared by
the pixels of a tile: an image says by how much (``clumping``).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.lights import colour
from nusselt.renderer.needs import Needs, Source
from nusselt.renderer.shading import ShadingPoints, reflect
from nusselt.renderer.vectors import Floats, Ints, dot
from nusselt.renderer.visibility.shared_points import CommonVisibility

from .analytic import without_shadows
from .protocol import Claim


def lattice(samples: int) -> Floats:
    """The smallest Fibonacci lattice of at least ``samples`` points, (2, N) in [0, 1)^2."""
    before, size = 1, 1
    while size < samples:
        before, size = size, before + size
    k = np.arange(size)
    return np.stack((k / size, (k * before % size) / size))


def hidden(points: ShadingPoints, source: Source, at: Floats) -> Floats:
    """What light points ``at`` (2, N) of the unit square send and blockers keep, (3, n)."""
    out = np.zeros((3, points.count))
    for one in at.T:
        out += _kept(points, source, one[:, None], np.zeros(points.count, dtype=np.int64), at.shape[1])
    return out * colour(source.light)


def hidden_from(points: ShadingPoints, source: Source, at: Floats, of: Ints) -> Floats:
    """The same where each point has one light point: that of number ``of`` (n,)."""
    return _kept(points, source, at, of, 1) * colour(source.light)


def _kept(points: ShadingPoints, source: Source, at: Floats, of: Ints, among: int) -> Floats:
    """What each point's light point would send, over ``among``, if it is hidden."""
    light, out = source.light, np.zeros((3, points.count))
    beam, worth = light.beams(points.position, *at[:, of, None])
    d, weight = beam[:, :, 0], worth[:, 0]
    reaching = np.flatnonzero((weight > 0) & (dot(points.normal, d) > 0))
    position, normal = points.position[:, reaching], points.normal[:, reaching]
    own, outside = points.ellipsoid[reaching], points.outside[reaching]
    way, places = d[:, reaching], [place for u, v in at.T if (place := light.at(u, v)) is not None]
    if places:
        view, eyes = CommonVisibility.of(source.blockers, light), np.hstack(places)
        seen = view.seen(position, own, way, eyes, light.at_infinity, normal, outside, of[reaching])
    else:
        seen = source.blockers.visible(position, own, way[:, :, None], light.at_infinity, normal)[:, 0]
    k = reaching[~seen]
    if k.size:
        out[:, k] = reflect(points.take(k), d[:, k, None], weight[k, None] / among, source.glossy)
    return out


def _refuse(samples: int) -> None:
    if samples < 1:
        raise InputError("samples", samples, "at least 1")


@dataclass(frozen=True, kw_only=True)
class CommonPoints:
    """At least ``samples`` light points, the next Fibonacci number; ``stratified`` does nothing: they always are."""

    samples: int = 1
    stratified: bool = True
    name: ClassVar[str] = "common-points"
    summary: ClassVar[str] = "closed form minus what a shifted lattice, common to all pixels, finds hidden"
    shares_points: ClassVar[bool] = True

    def __post_init__(self) -> None:
        _refuse(self.samples)

    def claim(self, needs: Needs) -> Claim:
        return "unbiased" if self.is_random(needs) else "exact"

    def is_random(self, needs: Needs) -> bool:
        return needs.random and needs.visibility

    def __call__(self, points: ShadingPoints, source: Source, rng: np.random.Generator) -> Floats:
        out = without_shadows(points, source)
        if source.blockers.none or points.count == 0:
            return out
        shift = rng.random((2, 1))
        at = (lattice(self.samples) + shift) % 1.0 if source.has_extent else np.zeros((2, 1))
        return out - hidden(points, source, at)


@dataclass(frozen=True, kw_only=True)
class CommonPointsFixed:
    """The same lattice, not shifted but centred: no noise, an error that falls with ``samples``."""

    samples: int = 1
    stratified: bool = True
    name: ClassVar[str] = "common-points-fixed"
    summary: ClassVar[str] = "the same with a lattice that stays in place: no noise, and an error that shrinks"
    shares_points: ClassVar[bool] = True

    def __post_init__(self) -> None:
        _refuse(self.samples)

    def claim(self, needs: Needs) -> Claim:
        return "consistent" if needs.random and needs.visibility else "exact"

    def is_random(self, needs: Needs) -> bool:
        return False

    def __call__(self, points: ShadingPoints, source: Source, rng: np.random.Generator) -> Floats:
        out = without_shadows(points, source)
        if source.blockers.none or points.count == 0:
            return out
        at = lattice(self.samples)
        return out - hidden(points, source, at + 0.5 / at.shape[1] if source.has_extent else np.zeros((2, 1)))
