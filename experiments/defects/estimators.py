"""Wrong estimators: `Area` with one step replaced."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from nusselt.renderer.lights import Light, PointLight, QuadLight, SunLight
from nusselt.renderer.lights.sampling import unit_square
from nusselt.renderer.lobes import Phong
from nusselt.renderer.needs import Source
from nusselt.renderer.shading import ShadingPoints, reflect
from nusselt.renderer.vectors import Floats, dot
from nusselt.renderer.visibility.segments import Blockers

from .altered import Altered


def _length(d: Floats) -> Floats:
    return np.sqrt(dot(d, d))


def gain(factor: float) -> Altered:
    """Everything too dark by a factor."""
    return Altered(finish=lambda source, radiance: radiance * factor)


def no_surface_cosine() -> Altered:
    """The surface's cosine forgotten."""

    def without(points: ShadingPoints, d: Floats, weight: Floats, glossy: bool) -> Floats:
        cosine = dot(points.normal[:, :, None], d) / _length(d)
        return reflect(points, d, np.divide(weight, cosine, out=np.zeros_like(weight), where=cosine > 0), glossy)

    return Altered(reflect=without)


def _light_cosine(light: Light, d: Floats) -> Floats | None:
    """At a light whose area shines from a plane, positive before it."""
    plane = light.plane() if light.area > 0 else None
    return None if plane is None else -dot(plane[0][:, :, None], d) / _length(d)


def no_light_cosine() -> Altered:
    """The light's cosine forgotten."""

    def beam(points: ShadingPoints, light: Light, d: Floats, weight: Floats) -> tuple[Floats, Floats]:
        cosine = _light_cosine(light, d)
        if cosine is None:
            return d, weight
        return d, np.divide(weight, cosine, out=np.zeros_like(weight), where=cosine > 0)

    return Altered(beam=beam)


def one_over_r() -> Altered:
    """1/r for 1/r^2."""
    return Altered(beam=lambda points, light, d, weight: (d, weight * _length(d)))


def light_area(factor: float) -> Altered:
    """The light's area wrong by a factor."""
    return Altered(beam=lambda points, light, d, weight: (d, weight * factor))


def flipped_light() -> Altered:
    """The light's normal on the other side."""

    def turn(source: Source) -> Source:
        light = source.light
        return (
            replace(source, light=replace(light, ab=light.ac, ac=light.ab)) if isinstance(light, QuadLight) else source
        )

    return Altered(source=turn)


def two_sided_light() -> Altered:
    """Light from the back of the light too."""

    def beam(points: ShadingPoints, light: Light, d: Floats, weight: Floats) -> tuple[Floats, Floats]:
        cosine = _light_cosine(light, d)
        if cosine is None:
            return d, weight
        return d, light.area * np.abs(cosine) / _length(d) ** 2 / weight.shape[1]

    return Altered(beam=beam)


def no_pi() -> Altered:
    """The diffuse albedo not divided by pi."""

    def brighter(points: ShadingPoints, d: Floats, weight: Floats, glossy: bool) -> Floats:
        return reflect(points.with_columns(diffuse=points.diffuse * math.pi), d, weight, glossy)

    return Altered(reflect=brighter)


def other_norm() -> Altered:
    """(s + 1) for (s + 2) in the lobe's norm."""

    def dimmer(points: ShadingPoints, d: Floats, weight: Floats, glossy: bool) -> Floats:
        factor = (points.shininess + 1) / (points.shininess + 2)
        return reflect(points.with_columns(specular=points.specular * factor), d, weight, glossy)

    return Altered(reflect=dimmer)


def unclamped_lobe() -> Altered:
    """max(r.w, 0)^s without the max: negative behind the lobe's horizon for an odd exponent."""

    def signed(points: ShadingPoints, d: Floats, weight: Floats, glossy: bool) -> Floats:
        length = _length(d)
        arriving = weight * np.maximum(dot(points.normal[:, :, None], d), 0) / length
        behind = Phong.evaluate(replace(points, mirror=-points.mirror), d, length)
        return reflect(points, d, weight, glossy) - points.specular * (arriving * behind).sum(axis=1)

    return Altered(reflect=signed)


def no_gap(share: float = 2e-3) -> Altered:
    """Shadow rays that go on behind the light, to whatever is there but the light itself."""

    def see(source: Source, points: ShadingPoints, d: Floats, at_infinity: bool) -> Floats:
        geometry = source.blockers.geometry
        every = Blockers.everything(geometry)
        others = np.flatnonzero(geometry.light[geometry.triangle_surface] < 0)
        seen = replace(every, triangles=others).visible(points.position, points.ellipsoid, d * (1 + share), at_infinity)
        return seen.astype(np.float64)

    return Altered(see=see)


def short_rays(share: float = 0.01) -> Altered:
    """Shadow rays that stop short of the light."""
    return Altered(shadow=lambda d: d * (1 - share))


def forgotten_light(index: int) -> Altered:
    """One light left out."""
    return Altered(finish=lambda source, radiance: radiance * (source.index != index))


def _corners(rng: np.random.Generator, n: int, samples: int, stratified: bool) -> tuple[Floats, Floats]:
    side = math.isqrt(samples)
    i, j = np.divmod(np.arange(samples), side)
    return np.broadcast_to(i / side, (n, samples)), np.broadcast_to(j / side, (n, samples))


def stratum_corners() -> Altered:
    """Every stratum sampled at its corner."""
    return Altered(lay=_corners)


def _shared(rng: np.random.Generator, n: int, samples: int, stratified: bool) -> tuple[Floats, Floats]:
    u, v = _corners(rng, n, samples, stratified)
    x, y = rng.random(2) / math.isqrt(samples)
    return u + x, v + y


def shared_offsets() -> Altered:
    """One random offset for all strata and pixels."""
    return Altered(lay=_shared)


def sheared_as_rectangle() -> Altered:
    """A parallelogram sampled as the rectangle on its first edge."""

    def square(light: QuadLight) -> QuadLight:
        ab, ac = np.array(light.ab), np.array(light.ac)
        x, y, z = (float(value) for value in ac - ab * (ab @ ac) / (ab @ ab))
        return replace(light, ac=(x, y, z))

    def take(source: Source) -> Source:
        light = source.light
        return replace(source, light=square(light)) if isinstance(light, QuadLight) else source

    return Altered(source=take)


def area_measure() -> Altered:
    """A density over area used as one over solid angle."""

    def beam(points: ShadingPoints, light: Light, d: Floats, weight: Floats) -> tuple[Floats, Floats]:
        if _light_cosine(light, d) is None:
            return d, weight
        return d, np.where(weight > 0, light.area / weight.shape[1], 0.0)

    return Altered(beam=beam)


def same_seed() -> Altered:
    """Every pass with the same random numbers."""

    def lay(rng: np.random.Generator, n: int, samples: int, stratified: bool) -> tuple[Floats, Floats]:
        return unit_square(np.random.default_rng(1), n, samples, stratified)

    return Altered(lay=lay)


def one_nan() -> Altered:
    """One pixel that is not a number."""

    def spoil(source: Source, radiance: Floats) -> Floats:
        radiance[:, :1] = np.nan
        return radiance

    return Altered(finish=spoil)


def inverted_triangle(number: int) -> Altered:
    """One triangle hides what it should let through, and lets through what it should hide."""

    def see(source: Source, points: ShadingPoints, d: Floats, at_infinity: bool) -> Floats:
        blockers, chosen = source.blockers, np.array([number])
        others = replace(blockers, triangles=np.setdiff1d(blockers.triangles, chosen))
        alone = replace(blockers, triangles=chosen, ellipsoids=chosen[:0])
        past, through = (b.visible(points.position, points.ellipsoid, d, at_infinity) for b in (others, alone))
        return (past & ~through).astype(np.float64)

    return Altered(see=see)


def wide_sun() -> Altered:
    """The sun's radius taken for its diameter."""

    def widen(source: Source) -> Source:
        light = source.light
        return replace(source, light=replace(light, angle=2 * light.angle)) if isinstance(light, SunLight) else source

    return Altered(source=widen)


def linear_point() -> Altered:
    """A point light without its square."""

    def beam(points: ShadingPoints, light: Light, d: Floats, weight: Floats) -> tuple[Floats, Floats]:
        return (d, weight * _length(d)) if isinstance(light, PointLight) else (d, weight)

    return Altered(beam=beam)
