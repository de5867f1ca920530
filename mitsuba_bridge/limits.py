"""Where a scene leaves the range in which Mitsuba is right: said in plain sentences, with the light and the surface.

Up to version 3.9 a shadow ray ends at 1 - 8.94e-4 of its way to the light. A blocker beyond is not seen: 45 % of
the full light was found to come through one.
"""

from __future__ import annotations

import numpy as np

from nusselt.renderer.geometry.arrays import Geometry, build_geometry
from nusselt.renderer.lights import Light
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Bools, Floats, Ints, dot

from .distance import Triangle, between_triangles, distance_to_triangles, from_ellipsoid
from .lights import cover, rounding
from .tolerance import LIFT

CLOSE = 1e-3
"""Blockers closer to a light than this share of the shadow ray's length are ignored by Mitsuba 3.9."""


def close_blockers(scene: Scene, points: Floats, half: float) -> list[str]:
    """A sentence for every light with a surface so close before it that Mitsuba 3.9 may look past it.

    Parameters
    ----------
    points : (3, n) float64
        Whose convex hull holds what is seen.
    half : float
        Half extent of the scene: a billionth of it is called touching.
    """
    geometry = build_geometry(scene)
    owner = geometry.light[geometry.triangle_surface]
    notes = []
    for number, light in enumerate(scene.lights):
        others = np.flatnonzero(owner != number)
        bodies = np.flatnonzero(geometry.light[geometry.ellipsoid_surface] != number)
        to_triangle, to_ellipsoid = clearance(light, geometry, others, bodies)
        distance = min(to_triangle.min(initial=np.inf), to_ellipsoid.min(initial=np.inf))
        if light.hides_itself:
            notes.append(
                f"light {number + 1} may hide parts of itself: Mitsuba up to 3.9 looks past what is closer to a light "
                "than a thousandth of the way, so that its hollow edges shine where they are hidden"
            )
        if light.at_infinity or not distance < np.inf:
            continue
        reach = CLOSE * float(np.sqrt(((points[:, :, None] - light.hull()[:, None]) ** 2).sum(axis=0)).max())
        if distance < reach:
            what = _what(geometry, others, to_triangle, to_ellipsoid)
            where = f"lies {distance:.2g} before" if distance > 1e-9 * half else "touches"
            notes.append(
                f"{what} {where} light {number + 1}: Mitsuba up to 3.9 looks past what is closer to a light "
                f"than a thousandth of the way (here up to {reach:.2g})"
            )
    return notes


LIFTED = 5e-4
"""Share of a scene's half extent by which they may be lifted."""


def farthest(geometry: Geometry) -> float:
    """The largest coordinate of triangles' corners and ellipsoids' centres; 0 if there are none."""
    return max(float(np.abs(v).max(initial=0.0)) for v in (geometry.a, geometry.center))


def far_lifted(scene: Scene, half: float) -> list[str]:
    """A sentence if a scene that is not scaled is too small, or too far from the origin, for Mitsuba's shadow rays."""
    lift = LIFT * (1 + farthest(build_geometry(scene)))
    if lift <= LIFTED * half:
        return []
    return [
        f"the scene is {2 * half:.3g} units large, and Mitsuba up to 3.9 lifts the start of shadow rays by {lift:.2g}: "
        "scale it, or move it to the origin"
    ]


FAULT = 1e-4
"""Share of a light, that float32 may take or add, from which it is said."""


def coarse_lights(scene: Scene, points: Floats) -> list[str]:
    """A sentence for every light that is so small or so narrow that float32 loses it.

    Parameters
    ----------
    points : (3, n) float64
        Whose convex hull holds what is seen.
    """
    notes = []
    for number, light in enumerate(scene.lights):
        share = float(rounding(light, points).max(initial=0.0))
        if share > FAULT:
            notes.append(
                f"light {number + 1} ({light.kind}) is so narrow that Mitsuba's float32 may be off by {share:.1g} of "
                "its light"
            )
    return notes


def clearance(light: Light, geometry: Geometry, triangles: Ints, bodies: Ints | None = None) -> tuple[Floats, Floats]:
    """How far a light is from what its light can meet: infinity where that lies behind it.

    Parameters
    ----------
    triangles : (t,) int64
        Those of the geometry to look at.
    bodies : (k,) int64, optional
        The same of its ellipsoids; infinity for the others.

    Returns
    -------
    (t,), (e,) float64
        To each triangle, exact but for disks, whose polygon around them is taken; to each ellipsoid, from below.
    """
    g = geometry
    corners = g.a[:, triangles], g.b[:, triangles], g.c[:, triangles]
    to_triangle, to_ellipsoid = np.full(triangles.size, np.inf), np.full(g.ellipsoids, np.inf)
    before, before_bodies = _before(light, g, corners)
    a, b, c = (points[:, before] for points in corners)
    ahead = a, b, c
    covering, around = cover(light)
    pieces = list(zip(*(points.T[:, :, None] for points in covering), strict=True))
    if bodies is not None:
        before_bodies &= np.isin(np.arange(g.ellipsoids), bodies)
    to_triangle[before] = _between(covering, pieces, ahead)
    for body in np.flatnonzero(before_bodies):
        shape = g.center[:, [body]], g.axes[body], g.inverse[body]
        to_ellipsoid[body] = min((from_ellipsoid(*shape, *piece).item() for piece in pieces), default=np.inf)
    return np.maximum(to_triangle - around, 0.0), np.maximum(to_ellipsoid - around, 0.0)


def _between(covering: Triangle, pieces: list[Triangle], ahead: Triangle) -> Floats:
    """How far each triangle (t,) is from the nearest piece of a light; whichever are fewer are taken one by one."""
    nearest = np.full(ahead[0].shape[1], np.inf)
    if len(pieces) > nearest.size:
        each = zip(*(points.T[:, :, None] for points in ahead), strict=True)
        return np.array([between_triangles(one, covering).min() for one in each])
    for piece in pieces:
        is_point = not (piece[0] != piece[1]).any()
        away = distance_to_triangles(piece[0], *ahead) if is_point else between_triangles(piece, ahead)
        nearest = np.minimum(nearest, away)
    return nearest


def _before(light: Light, g: Geometry, corners: Triangle) -> tuple[Bools, Bools]:
    """Which triangles and ellipsoids rise over the plane from which a light shines, by more than rounding."""
    plane = light.plane()
    if plane is None:
        return np.ones(corners[0].shape[1], dtype=bool), np.ones(g.ellipsoids, dtype=bool)
    normal, place = plane
    rounding = 1e-12 * light.middle()[1]
    heights = np.stack([dot(p - place, normal) for p in corners])
    reach = np.sqrt((np.einsum("eij,i->ej", g.axes, normal[:, 0]) ** 2).sum(axis=1))
    rises: Bools = np.asarray((heights > rounding).any(axis=0))
    return rises, np.asarray(dot(g.center - place, normal) + reach > rounding)


def _what(g: Geometry, triangles: Ints, to_triangle: Floats, to_ellipsoid: Floats) -> str:
    """The surface that is nearest."""
    if to_ellipsoid.min(initial=np.inf) <= to_triangle.min(initial=np.inf):
        body = int(to_ellipsoid.argmin())
        light = g.light[g.ellipsoid_surface[body]]
        if light >= 0:
            return f"light {light + 1}"
        return f"sphere {body + 1} about {_place(g.center[:, body])}"
    triangle = triangles[int(to_triangle.argmin())]
    place = _place((g.a + g.b + g.c)[:, triangle] / 3)
    light = g.light[g.triangle_surface[triangle]]
    return f"light {light + 1}" if light >= 0 else f"the triangle about {place}"


def _place(point: Floats) -> str:
    return "(" + ", ".join(f"{x:.4g}" for x in point) + ")"
