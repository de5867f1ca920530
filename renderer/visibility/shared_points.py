"""Visibility of one light point from many surface points at once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.geometry.ragged import take
from nusselt.renderer.lights import Light
from nusselt.renderer.vectors import Bools, Floats, Ints, distinct, dot

from .bvh import Hierarchy
from .segments import Blockers
from .silhouette import Outline, Silhouette, outline, project, silhouette, surface_of, winding

FEW = 512
"""Points of one of many light points, below which their rays are followed: a silhouette takes longer."""


@lru_cache(maxsize=16)
def outline_of(geometry: Geometry, hierarchy: Hierarchy, light: Light) -> tuple[Outline | None, str]:
    """The outline of a scene's many triangles for a light, or why there is none."""
    surface, reason = surface_of(geometry, hierarchy.triangles.astype(np.int64).tobytes())
    if surface is None:
        return None, reason
    found = outline(surface, light.hull(), light.at_infinity)
    return found, "" if found else "the light lies beside or inside the surface"


@lru_cache(maxsize=16)
def turned_to(geometry: Geometry, hierarchy: Hierarchy, light: Light) -> Hierarchy:
    """A hierarchy of those triangles alone that some point of a light is before.

    A segment that comes out of closed bodies to the light crosses one of these last.
    """
    k, hull = hierarchy.triangles.astype(np.int64), light.hull()
    normal, a = take(geometry.normal, k), take(geometry.a, k)
    offset = np.zeros(k.size) if light.at_infinity else dot(normal, a)
    slack = 1e-14 * np.abs(normal).sum(axis=0) * (np.abs(a).max() + np.abs(hull).max())
    mine = (normal.T @ hull > (offset - slack)[:, None]).any(axis=1)
    return Hierarchy.over(geometry, k[mine]) if mine.any() else hierarchy


@lru_cache(maxsize=64)
def _silhouette(outline: Outline, eye: bytes) -> Silhouette | None:
    """From one of the few light points at which layers are counted, again and again."""
    return silhouette(outline, np.frombuffer(eye).reshape(3, 1), False)


@dataclass(frozen=True, eq=False)
class CommonVisibility:
    """What stands between many points and single points of one light.

    Parameters
    ----------
    blockers : Blockers
        All of it.
    rest : Blockers
        What ``outline`` does not stand for.
    outline : Outline or None
        Of the triangles in the hierarchy, if they close.
    light : Light
    """

    blockers: Blockers
    rest: Blockers
    outline: Outline | None
    light: Light

    @classmethod
    def of(cls, b: Blockers, light: Light) -> CommonVisibility:
        """What may stand between a light and some points."""
        if b.hierarchy is None or b.offset is not None:  # rays that start off the surface are traced
            return cls(b, b, None, light)
        found, _ = outline_of(b.geometry, b.hierarchy, light)
        return cls(b, replace(b, triangles=b.loose, hierarchy=None) if found else b, found, light)

    @property
    def turned(self) -> Blockers:
        """All of it but triangles turned from the light: where they close, what stands before points outside them."""
        b = self.blockers
        return replace(b, hierarchy=turned_to(b.geometry, b.hierarchy, self.light)) if b.hierarchy else b

    def seen(
        self,
        points: Floats,
        own: Ints,
        d: Floats,
        eye: Floats,
        at_infinity: bool,
        normal: Floats | None = None,
        outside: Bools | None = None,
        of: Ints | None = None,
    ) -> Bools:
        """Which points see the light point ``eye``, or each its own of several.

        Parameters
        ----------
        points, d : (3, n) float64
            Points, and from each the way to the light point.
        own : (n,) int64
            Ellipsoid each point lies on, -1 for none.
        eye : (3, m) float64
            The light points, or the directions to them.
        normal : (3, n) float64, optional
            Unit normals; see `Blockers.visible`.
        outside : (n,) bool, optional
            See `ShadingPoints`; those points face the light point.
        of : (n,) int64, optional
            Which light point is whose; the first without it.
        """
        seen: Bools = np.ones(points.shape[1], dtype=bool)
        if not self.rest.none:
            seen = self.rest.visible(points, own, d[:, :, None], at_infinity, normal)[:, 0]
        if self.outline is not None:
            open_ = np.flatnonzero(seen)
            around = None if outside is None else take(outside, open_)
            which = np.zeros(open_.size, dtype=np.int64) if of is None else take(of, open_)
            p, way = take(points, open_), take(d, open_)
            seen[open_] = ~self._hidden(self.outline, p, way, eye, which, at_infinity, around)
        return seen

    def _hidden(
        self,
        outline: Outline,
        points: Floats,
        d: Floats,
        eyes: Floats,
        of: Ints,
        at_infinity: bool,
        outside: Bools | None,
    ) -> Bools:
        hidden, few = np.zeros(points.shape[1], dtype=bool), np.zeros(points.shape[1], dtype=bool)
        counts = np.bincount(of, minlength=eyes.shape[1])
        for number, mine in enumerate(np.split(np.argsort(of, kind="stable"), np.cumsum(counts)[:-1])):
            if eyes.shape[1] > 1 and mine.size < FEW:
                few[mine] = True
                continue
            eye = eyes[:, [number]]
            seen_edges = silhouette(outline, eye, at_infinity)
            if seen_edges is None:
                continue
            around = None if outside is None else take(outside, mine)
            hidden[mine] = _turned_faces(outline, seen_edges, take(points, mine), eye, at_infinity, around) != 0
        # What the winding number counts may lie behind the point, unless the whole box lies before it.
        k = np.flatnonzero(hidden)
        unsure = np.append(np.flatnonzero(few), k[~self._beyond(take(points, k), take(d, k))])
        if unsure.size:
            before = np.zeros(unsure.size, dtype=bool) if outside is None else take(outside, unsure)
            for mine, blockers in ((unsure[before], self.turned), (unsure[~before], self.blockers)):
                hidden[mine] = blockers.hierarchy_hides(take(points, mine), take(d, mine), at_infinity)
        return hidden

    def layers(self, points: Floats, d: Floats, eyes: Floats, of: Ints, outside: Bools | None = None) -> Ints:
        """How many layers of the closed surface lie between points outside it (3, n) and each its own of several light
        points, (3, m).

        ``d``, ``of`` and ``outside`` as in `seen`.
        """
        found: Ints = np.zeros(points.shape[1], dtype=np.int64)
        if self.outline is None:
            return found
        for number in distinct(of).tolist():
            mine, eye = np.flatnonzero(of == number), eyes[:, [number]]
            edges = _silhouette(self.outline, eye.tobytes())
            if edges is not None:
                around = None if outside is None else take(outside, mine)
                found[mine] = _turned_faces(self.outline, edges, take(points, mine), eye, False, around)
        k = np.flatnonzero(found)
        unsure = k[~self._beyond(take(points, k), take(d, k))]
        # Into a closed surface and out of it again: two crossings a layer.
        found[unsure] = self.blockers.crossings(take(points, unsure), take(d, unsure), False) // 2
        return found

    def _beyond(self, p: Floats, d: Floats) -> Bools:
        """Whether the hierarchy's box lies wholly ahead on the way."""
        tree = self.blockers.hierarchy
        if tree is None:
            return np.ones(p.shape[1], dtype=bool)
        with np.errstate(divide="ignore", invalid="ignore"):
            first, second = (tree.centre - tree.half - p) / d, (tree.centre + tree.half - p) / d
        return np.asarray(np.fmin(first, second).max(axis=0) > 0)


def _turned_faces(
    outline: Outline, edges: Silhouette, points: Floats, eye: Floats, at_infinity: bool, outside: Bools | None
) -> Ints:
    """How many faces turned to the light may block each point's ray (n,): not the point's own, if alone.

    A point on the outside has a winding number of 0 in space before it, and so has the light point: between them
    the ray goes in as often as out. Where its own face is the only way in, nothing is between.
    """
    x, y, depth = project(outline, points, eye, at_infinity)
    faces = winding(edges, x if at_infinity else np.where(depth > 0, x, np.inf), y)
    return faces if outside is None else np.where(outside & (faces == 1), 0, faces)
