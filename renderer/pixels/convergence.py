"""How far apart values tell of each other: beside a light not across a pixel.

Seen on a plane through a pinhole, unblocked radiance is an analytic function of the place in the image, and its Taylor
series about a point converges up to its nearest branch point: the complex place where the way to the light's outline
has length 0. With s the nearness of what the image point d shows of the plane, and Q a place of the light, both seen
from the eye, that way is d / s - Q; times s it is affine in the image, a + B u at u pixels from there. It has length 0
first at |u| = |a| / |B|. From values farther apart than that nothing follows for what is between them, however smoothly
they seem to run: a whole highlight may be there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from nusselt.renderer.lights import Light
from nusselt.renderer.needs import Source
from nusselt.renderer.vectors import Bools, Floats, Ints, distinct, dot, unit

from .regions import Regions

PEAK = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
"""Where radiance may be largest beside a branch point: real part plus so many times the imaginary one."""
RESOLVED = 16
"""Cells in the radius of convergence that need not be divided."""
FINEST = 4096
"""Cells in a pixel's side beside a light, at most."""
CELLS = 16384
"""The same in all of a pixel."""
CORNERS = 8
"""Of a light, that are looked at as they are; of more, those of the box around them."""
FEW = 1 << 12
"""Points that are looked at one by one."""
BLOCK = 8
"""Pixels in the side of what is looked at first where they are more."""
AROUND = 1.1
"""How much larger than it must be a block's radius is, to be left out."""
TINY = np.finfo(float).tiny


@dataclass(frozen=True, eq=False)
class Poles:
    """The branch points nearest to image points (n,), as ways a + b u + c v that have length 0 there.

    Parameters
    ----------
    a, b, c : (3, n) float64
    radius : (n,) float64
        Pixels to the nearest.
    """

    a: Floats
    b: Floats
    c: Floats
    radius: Floats

    @classmethod
    def of(cls, regions: Regions, light: Light, x: Floats, y: Floats, surface: Ints) -> Poles:
        """Of image points (n,) of faces, for all straight lines between corners of the light.

        Of each line the place that is nearest to the point stands for all: radii are up to 4 % too large.
        """
        (row, d, position), (across, down) = _seen(regions, x, y, surface), regions.lens.steps
        s, slope, rise = dot(row, d), dot(row, across), dot(row, down)
        corners = _corners(light) - regions.lens.origin
        best, place = np.full(x.size, np.inf), np.zeros((3, x.size))
        for i, j in list(combinations(range(corners.shape[1]), 2)) or [(0, 0)]:
            start, along = corners[:, [i]], corners[:, [j]] - corners[:, [i]]
            t = np.clip(dot(position - start, along) / max(float(dot(along, along)[0]), TINY), 0, 1)
            q = start + t * along
            a, b, c = d - s * q, across - slope * q, down - rise * q
            square = dot(a, a) / _longest(b, c)
            closer = square < best
            best, place = np.where(closer, square, best), np.where(closer, q, place)
        return cls(d - s * place, across - slope * place, down - rise * place, np.sqrt(best))

    def along(self) -> tuple[Floats, Floats, Floats]:
        """Unit ways (2, n) in the image in which they are that near, and their real and imaginary part (n,) there."""
        b, c = self.b, self.c
        angle = np.arctan2(2 * dot(b, c), dot(b, b) - dot(c, c)) / 2
        ways = np.stack((np.cos(angle), np.sin(angle)))
        real = -dot(self.a, ways[0] * b + ways[1] * c) / _longest(b, c)
        return ways, real, np.sqrt(np.maximum(self.radius**2 - real**2, 0.0))

    def axes(self) -> Floats:
        """Pixels (2, n) across and down that are worth one along those ways."""
        return np.sqrt(_longest(self.b, self.c) / np.maximum([dot(self.b, self.b), dot(self.c, self.c)], TINY))


@dataclass(frozen=True, eq=False)
class Convergence:
    """Of radiance on the faces that lights come near.

    Parameters
    ----------
    regions : Regions
    lights : tuple of Light
    widest : float
        Pixels: where radii are larger all over a face they are not found.
    """

    regions: Regions
    lights: tuple[Light, ...]
    widest: float

    @classmethod
    def of(cls, regions: Regions, sources: tuple[Source, ...], widest: float) -> Convergence:
        return cls(regions, tuple(source.light for source in sources if not source.light.at_infinity), widest)

    @cached_property
    def near(self) -> list[tuple[Light, Bools]]:
        """Lights that come near to surfaces (r,), and which."""
        found = []
        for light in self.lights:
            faces = _near_faces(self.regions, light, self.widest)
            if faces.any():
                found.append((light, np.pad(faces, (0, self.regions.surfaces - faces.size))))
        return found

    def radius(self, x: Floats, y: Floats, region: Ints) -> Floats:
        """Pixels (n,), inf for large ones, in which radiance's Taylor series about image points converges."""
        found = np.full(x.size, np.inf)
        for k, poles in self._poles(x, y, region, x.size > FEW):
            found[k] = np.minimum(found[k], poles.radius)
        return found

    def beside(self, shade: Callable[..., Floats], x: Floats, y: Floats, region: Ints) -> tuple[Floats, Ints]:
        """Of pixels about image points: how bright they may be somewhere (n,), and cells (2, n) across and down that
        they need.

        Parameters
        ----------
        shade : callable
            From image points and their regions to radiance (c, n).
        """
        most, cells = np.zeros(x.size), np.ones((2, x.size))
        for k, poles in self._poles(x, y, region):
            ways, real, imaginary = poles.along()
            along = np.clip(real + PEAK[:, None] * imaginary, -0.5, 0.5)
            u, v = x[k] + ways[0] * along, y[k] + ways[1] * along
            value = shade(u.ravel(), v.ravel(), np.tile(region[k], PEAK.size))
            size = np.sqrt((value**2).sum(axis=0)).reshape(along.shape).max(axis=0)
            most[k] = np.maximum(most[k], size)
            least = np.hypot(imaginary, np.maximum(np.abs(real) - 0.5, 0.0))  # from within the pixel
            cells[:, k] = np.maximum(cells[:, k], RESOLVED / np.maximum(least * poles.axes(), TINY))
        return most, _cells(cells)

    def _poles(self, x: Floats, y: Floats, region: Ints, many: bool = False) -> Iterator[tuple[Ints, Poles]]:
        """Which points are on surfaces that a light is near to, light by light, and the branch points there.

        Parameters
        ----------
        many : bool
            Whether to look at blocks of the image first, and leave out points with large radii.
        """
        regions, surface = self.regions, region % self.regions.surfaces
        for light, near in self.near:
            k = np.flatnonzero(near[surface])
            if many:
                k = k[self._close(light, near, x[k], y[k], surface[k])]
            plane = light.plane()
            if plane is not None:
                place = regions.lens.origin + _seen(regions, x[k], y[k], surface[k])[2]
                k = k[dot(plane[0], place - plane[1]) > 0]
            if k.size:
                yield k, Poles.of(regions, light, x[k], y[k], surface[k])

    def _close(self, light: Light, near: Bools, x: Floats, y: Floats, surface: Ints) -> Bools:
        """Points (n,) of such surfaces in blocks where radii may be small: they change by a pixel a pixel at most."""
        column, row, kinds = x.astype(np.int64) // BLOCK, y.astype(np.int64) // BLOCK, np.flatnonzero(near)
        wide = int(column.max(initial=0)) + 1
        key = (row * wide + column) * kinds.size + np.searchsorted(kinds, surface)
        blocks = distinct(key)
        place, kind = np.divmod(blocks, kinds.size)
        middle = BLOCK * (place % wide + 0.5), BLOCK * (place // wide + 0.5)
        radius = Poles.of(self.regions, light, *middle, kinds[kind]).radius
        close = radius < AROUND * (self.widest + BLOCK / np.sqrt(2))
        return np.asarray(close[np.searchsorted(blocks, key)])


def _cells(needed: Floats) -> Ints:
    """Powers of two (2, n): at least 2, and as many as are needed, but for ``FINEST`` and ``CELLS``.

    Twice as many the finer way: that nothing changes any more is to be seen.
    """
    cells = 2.0 ** np.ceil(np.log2(np.clip(needed, 2, FINEST / 2)))
    cells = np.where(cells == cells.max(axis=0), 2 * cells, cells)
    for one, other in ((0, 1), (1, 0)):
        cells[one] = np.minimum(cells[one], np.maximum(np.sqrt(CELLS), CELLS / cells[other]))
    return cells.astype(np.int64)


def _seen(regions: Regions, x: Floats, y: Floats, surface: Ints) -> tuple[Floats, Floats, Floats]:
    """Of image points of faces: the faces' nearness by direction, the directions, and the ways there, (3, n) each."""
    row, d = regions.pencil.planes.nearness[:, regions.faces.triangle[surface]], regions.lens.directions(x, y)
    s = dot(row, d)
    return row, d, d / np.where(s == 0, TINY, s)


def _near_faces(regions: Regions, light: Light, widest: float) -> Bools:
    """Faces (f,) on which radii may be smaller than ``widest`` pixels."""
    g, faces, lens = regions.geometry, regions.faces, regions.lens
    near = np.zeros(faces.count, dtype=bool)
    if faces.count == 0:
        return near
    hull, plane, corners = _corners(light), light.plane(), (g.a, g.b, g.c)
    deep = np.max([dot(lens.look, corner - lens.origin) for corner in corners], axis=0)
    normal = unit(g.normal)
    over = dot(normal[:, :, None], hull[:, None] - g.a[:, :, None])
    over = np.where(dot(normal, lens.origin - g.a) > 0, over.T, -over.T)
    gap = np.maximum(np.minimum.reduce(corners) - hull.max(axis=1)[:, None], 0)
    gap = np.maximum(gap, hull.min(axis=1)[:, None] - np.maximum.reduce(corners))
    distance = np.maximum(np.sqrt(dot(gap, gap)), over.min(axis=0))
    row, bend = regions.pencil.planes.nearness, np.zeros(deep.size)
    for step in lens.steps:
        b = step[:, :, None] - dot(row, step)[:, None] * (hull - lens.origin)[:, None]
        bend += dot(b, b).max(axis=1)
    lit = (deep > 0) & (over.max(axis=0) > 0)
    if plane is not None:
        lit &= np.max([dot(plane[0], corner - plane[1]) for corner in corners], axis=0) > 0
    some = np.flatnonzero(lit & (distance < widest * deep * np.sqrt(bend)))
    if some.size:  # a face that is smaller than it is far from a light is smooth whatever a pixel shows of it
        face = faces.of_triangle[some]
        near[face[distance[some] < 2 * regions.radii[face]]] = True
    return near


def _corners(light: Light) -> Floats:
    """Places (3, m), few, whose convex hull holds the light."""
    hull = light.hull()
    if hull.shape[1] <= CORNERS:
        return hull
    return np.array(np.meshgrid(*zip(hull.min(axis=1), hull.max(axis=1), strict=True))).reshape(3, 8)


def _longest(b: Floats, c: Floats) -> Floats:
    """The largest square (n,) of b cos + c sin (3, n)."""
    bb, cc = dot(b, b), dot(c, c)
    return np.asarray((bb + cc) / 2 + np.hypot((bb - cc) / 2, dot(b, c)))
