"""What a scene needs, found once; what it does not need, and why.

Everything downstream (estimators, the reference, the report) asks here and nowhere else. Leaving out never
changes a pixel beyond rounding: `find_needs(..., everything=True)` switches every saving off, and a test
compares the two.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from nusselt.renderer.vectors import Ints
from nusselt.renderer.visibility.ray_offset import RayOffset

from . import lobes
from .geometry.arrays import Geometry
from .geometry.flat_disks import disk_hull
from .lights import Light
from .lobes import Lobe
from .scene import Scene
from .vectors import Floats, dot
from .visibility.segments import Blockers, plane_bound

PAIRS = 1 << 22
"""Receiver-blocker pairs beyond which the pairwise search is not worth its time."""


@dataclass(frozen=True)
class LeftOut:
    """Something a scene did not need.

    Parameters
    ----------
    what, why : str
        A noun phrase and its reason.
    """

    what: str
    why: str


@dataclass(frozen=True, eq=False)
class Source:
    """A light, and what stands in its way.

    Parameters
    ----------
    index : int
        Among the scene's lights.
    light : Light
    blockers : Blockers
        Surfaces that may stand between it and a surface it lights.
    glossy : bool
        Whether any surface has a lobe besides Lambert's.
    """

    index: int
    light: Light
    blockers: Blockers
    glossy: bool

    @property
    def has_extent(self) -> bool:
        return self.light.has_extent

    @property
    def lobes(self) -> tuple[type[Lobe], ...]:
        """That are evaluated."""
        return tuple(kind for kind in self.blockers.geometry.lobes if self.glossy or not kind.glossy)

    @property
    def without_form(self) -> tuple[type[Lobe], ...]:
        """The lobes of surfaces for which the light has no closed form: they are to be sampled."""
        return tuple(kind for kind in self.lobes if not self.light.has_form(kind))

    @property
    def without_contour(self) -> tuple[type[Lobe], ...]:
        """The lobes of surfaces without boundary integrals: they are to be sampled behind blockers."""
        return tuple(kind for kind in self.lobes if kind.contour is None)

    def seen_from(self, points: Floats) -> Source:
        """With only the blockers that can matter to these points (3, n)."""
        if self.blockers.triangles.size == 0 or self.blockers.offset is not None:
            return self  # rays that start off the surface can meet what ours cannot: all of it
        return replace(self, blockers=self.blockers.between(points, self.light.hull(), self.light.at_infinity))


@dataclass(frozen=True, eq=False)
class Needs:
    """The findings.

    Parameters
    ----------
    sources : tuple of Source
        The lights that light something.
    left_out : tuple of LeftOut
    """

    sources: tuple[Source, ...]
    left_out: tuple[LeftOut, ...]

    def by_rule(self, offset: RayOffset) -> Needs:
        """The same with shadow rays that start as another renderer's do."""
        return replace(
            self, sources=tuple(replace(s, blockers=replace(s.blockers, offset=offset)) for s in self.sources)
        )

    @property
    def visibility(self) -> bool:
        """Whether any light can be blocked anywhere."""
        return any(not source.blockers.none for source in self.sources)

    @property
    def without_form(self) -> bool:
        """Whether any light has no closed form for a lobe that it meets."""
        return any(source.without_form for source in self.sources)

    @property
    def random(self) -> bool:
        """Whether any light has an extent to be sampled."""
        return any(source.has_extent for source in self.sources)


def _receivers(geometry: Geometry) -> Floats:
    """Points whose convex hull holds every reflecting surface, (3, m)."""
    lit = geometry.reflects
    on = np.flatnonzero(lit[geometry.triangle_surface])
    extent = np.sqrt((geometry.axes**2).sum(axis=2)).T  # half-sides of each ellipsoid's box, (3, e)
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 1, 8)
    boxes = (geometry.center[:, :, None] + signs * extent[:, :, None])[:, lit[geometry.ellipsoid_surface]]
    return np.hstack((geometry.a[:, on], geometry.b[:, on], geometry.c[:, on], boxes.reshape(3, -1)))


def _lights_nothing(light: Light, receivers: Floats) -> str:
    """Why a light can be dropped, or an empty string."""
    if not any(light.colour):
        return "it is black"
    if receivers.shape[1] == 0:
        return "no surface reflects"
    plane = light.plane()
    if plane is not None and (dot(plane[0], receivers - plane[1]) <= 0).all():
        return "every surface lies behind it"
    return ""


def _blockers(geometry: Geometry, index: int, light: Light, receivers: Floats) -> Blockers:
    """The surfaces that may stand between a light and some receiver.

    A triangle cannot hide any of a light's points from any of a receiver's if one of three planes separates:
    its own (receiver and light on one side), the receiver's (the triangle below its horizon) or the light's
    (the triangle behind it). First its own plane against all receivers at once, then pair by pair.
    """
    points, at_infinity = light.hull(), light.at_infinity
    found = Blockers.around(geometry, index, light.hides_itself).between(receivers, points, at_infinity)
    found = replace(found, disks=_before(geometry, light, found.disks))
    lit = np.flatnonzero(geometry.reflects[geometry.triangle_surface])
    # Beyond a few thousand, their planes tell little.
    if geometry.ellipsoids or found.triangles.size * lit.size > PAIRS or found.triangles.size == 0:
        return found
    g, k = geometry, found.triangles
    corners = np.stack((g.a, g.b, g.c), axis=2)  # (3, t, 3 corners)
    receiver, blocker = corners[:, lit], corners[:, k]
    everywhere = corners.reshape(3, -1)

    def heights(n: Floats, a: Floats, p: Floats) -> tuple[Floats, Floats]:
        """Lowest and highest corner of triangles p (3, j, 3) over planes n, a (3, i): each (i, j)."""
        h = dot(n[:, :, None, None], p[:, None] - a[:, :, None, None])
        slack = plane_bound(n, a, everywhere)[:, None]
        return h.min(axis=2) + slack, h.max(axis=2) - slack

    low, high = heights(g.normal[:, k], g.a[:, k], receiver)  # over the blockers' planes: (k, r)
    to_light = points[:, None, :] if at_infinity else points[:, None, :] - g.a[:, k, None]
    light_height = dot(g.normal[:, k, None], to_light)
    slack = plane_bound(g.normal[:, k], g.a[:, k], np.hstack((everywhere, points)))
    apart = (low >= 0) & (light_height.min(axis=1) >= -slack)[:, None]
    apart |= (high <= 0) & (light_height.max(axis=1) <= slack)[:, None]
    low, high = heights(g.normal[:, lit], g.a[:, lit], blocker)  # over the receivers' planes: (r, k)
    # A light on both sides of a receiver is parted only if the blocker is beyond the lit side of each.
    lit_height = dot(g.normal[:, lit, None], points[:, None] if at_infinity else points[:, None] - g.a[:, lit, None])
    lit_slack = plane_bound(g.normal[:, lit], g.a[:, lit], np.hstack((everywhere, points)))
    front = lit_height.max(axis=1) > lit_slack
    back = lit_height.min(axis=1) < -lit_slack
    apart |= ((high <= 0) | ~front[:, None]).T & ((low >= 0) | ~back[:, None]).T
    plane = light.plane()
    if plane is not None:
        _, in_front = heights(*plane, blocker)
        apart |= (in_front <= 0).T
        _, receiver_in_front = heights(*plane, receiver)
        apart |= receiver_in_front <= 0
    return replace(found, triangles=k[~apart.all(axis=1)])


def _before(geometry: Geometry, light: Light, disks: Ints) -> Ints:
    """The disks that rise over a light's plane: its own does not."""
    plane = light.plane()
    if plane is None:
        return disks
    normal, place = plane
    hulls = [disk_hull(geometry, index) for index in disks]
    rises = [(dot(normal, hull - place) > plane_bound(normal, place, hull)).any() for hull in hulls]
    return disks[np.array(rises, dtype=bool)]


def _lobes_left_out(scene: Scene, geometry: Geometry) -> list[LeftOut]:
    """The kinds of lobe that are not evaluated."""
    evaluated = geometry.lobes if scene.is_glossy else ()
    return [
        LeftOut(kind.title, f"no surface has a {kind.PARAMETERS[0].name} albedo")
        for kind in lobes.LOBES
        if kind.glossy and kind not in evaluated
    ]


def find_needs(scene: Scene, geometry: Geometry, everything: bool = False) -> Needs:
    """Look at a scene once and decide what its image takes.

    Parameters
    ----------
    everything : bool
        Leave nothing out: the same image to rounding, at full price.
    """
    if everything:
        pairs = enumerate(
            (light, Blockers.around(geometry, index, light.hides_itself).gathered())
            for index, light in enumerate(scene.lights)
        )
        return Needs(tuple(Source(index, light, whole, True) for index, (light, whole) in pairs), ())
    receivers = _receivers(geometry)
    left_out: list[LeftOut] = []
    sources: list[Source] = []
    total = geometry.triangles + geometry.ellipsoids + geometry.disks
    for index, light in enumerate(scene.lights):
        name = f"light {index + 1} ({light.kind})"
        reason = _lights_nothing(light, receivers)
        if reason:
            left_out.append(LeftOut(name, reason))
            continue
        blockers = _blockers(geometry, index, light, receivers).gathered()
        kept = blockers.count
        if kept == 0:
            left_out.append(LeftOut(f"shadow rays to {name}", "nothing stands between it and a surface it lights"))
        elif kept < total:
            why = "no segment from a surface to the light can cross them"
            left_out.append(LeftOut(f"{total - kept} of {total} blockers of {name}", why))
        if not light.has_extent:
            left_out.append(LeftOut(f"further samples of {name}", "it has no extent"))
        sources.append(Source(index, light, blockers, scene.is_glossy))
    if scene.lights:
        left_out += _lobes_left_out(scene, geometry)
    if not geometry.ellipsoids:
        left_out.append(LeftOut("sphere intersections", "the scene has no spheres"))
    if not scene.lights:
        left_out.append(LeftOut("shading", "the scene has no light"))
    return Needs(tuple(sources), tuple(left_out))
