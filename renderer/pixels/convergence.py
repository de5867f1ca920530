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
FINEST = 1024
"""Cells in a pixel's side beside a light, at most."""
CELLS = 4096
"""The same in all of a pixel."""
FEW = 1 << 12
"""Points that are looked at one by one."""
BLOCK = 8
"""Pixels in the side of what is looked at first where they are more."""
AROUND = 1.1
"""How much larger than it must be a block's radius is, to be left out."""
TINY = np.finfo(float).tiny


@dataclass(frozen=True, eq=False)
class Poles:
    """The branch points nearest to image points (n,).

    Parameters
    ----------
    radius : (n,) float64
        Pixels to the nearest.
    ways : (2, n) float64
        Unit, in which it is that near.
    real, imaginary : (n,) float64
        Its place along that way.
    axes : (2, n) float64
        Pixels across and down that are as long as one along that way.
    """

    radius: Floats
    ways: Floats
    real: Floats
    imaginary: Floats
    axes: Floats


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

    def beside(self, free: Callable[..., Floats], x: Floats, y: Floats, region: Ints) -> tuple[Floats, Ints]:
        """Of pixels about image points: how bright they may be somewhere (n,), and cells (2, n) across and down that
        they need.

        Parameters
        ----------
        free : callable
            From image points and their regions to unshadowed radiance (c, n).
        """
        most, cells = np.zeros(x.size), np.ones((2, x.size))
        for k, poles in self._poles(x, y, region):
            along = np.clip(poles.real + PEAK[:, None] * poles.imaginary, -0.5, 0.5)
            u, v = (place[k] + way * along for place, way in zip((x, y), poles.ways, strict=True))
            value = free(u.ravel(), v.ravel(), np.tile(region[k], PEAK.size))
            size = np.sqrt((value**2).sum(axis=0)).reshape(along.shape).max(axis=0)
            most[k] = np.maximum(most[k], size)
            least = np.hypot(poles.imaginary, np.maximum(np.abs(poles.real) - 0.5, 0.0))  # from within the pixel
            cells[:, k] = np.maximum(cells[:, k], RESOLVED / np.maximum(least * poles.axes, TINY))
        return most, _cells(cells)

    def _poles(self, x: Floats, y: Floats, region: Ints, many: bool = False) -> Iterator[tuple[Ints, Poles]]:
        """Which points are on surfaces that a light is near to, light by light, and the branch points there.

        Parameters
        ----------
        many : bool
            Whether to look at blocks of the image first, and leave out points with large radii.
        """
        surface = region % self.regions.surfaces
        for light, near in self.near:
            k = np.flatnonzero(near[surface])
            if many:
                k = k[self._close(light, near, x[k], y[k], surface[k])]
            if k.size:
                yield k, _poles(self.regions, light, x[k], y[k], surface[k])

    def _close(self, light: Light, near: Bools, x: Floats, y: Floats, surface: Ints) -> Bools:
        """Points (n,) of such surfaces in blocks where radii may be small: they change by a pixel a pixel at most."""
        column, row, kinds = (x // BLOCK).astype(np.int64), (y // BLOCK).astype(np.int64), np.flatnonzero(near)
        wide = int(column.max(initial=0)) + 1
        key = (row * wide + column) * kinds.size + np.searchsorted(kinds, surface)
        blocks = distinct(key)
        place, kind = np.divmod(blocks, kinds.size)
        middle = BLOCK * (place % wide + 0.5), BLOCK * (place // wide + 0.5)
        radius = _poles(self.regions, light, *middle, kinds[kind], False).radius
        close = radius < AROUND * (self.widest + BLOCK / np.sqrt(2))
        return np.asarray(close[np.searchsorted(blocks, key)])


def _cells(needed: Floats) -> Ints:
    """Powers of two (2, n): at least 2, and as many as are needed, but for ``FINEST`` and ``CELLS``."""
    cells = 2.0 ** np.ceil(np.log2(np.clip(needed, 2, FINEST)))
    for one, other in ((0, 1), (1, 0)):
        cells[one] = np.minimum(cells[one], np.maximum(np.sqrt(CELLS), CELLS / cells[other]))
    return cells.astype(np.int64)


def _steps(regions: Regions) -> tuple[Floats, Floats]:
    """What a pixel across, and one down, adds to directions (3, 1)."""
    lens = regions.lens
    return 2 * lens.right / lens.width, -2 * lens.up / lens.height


def _near_faces(regions: Regions, light: Light, widest: float) -> Bools:
    """Faces (f,) on which radii may be smaller than ``widest`` pixels."""
    g, faces, lens = regions.geometry, regions.faces, regions.lens
    near = np.zeros(faces.count, dtype=bool)
    if faces.count == 0:
        return near
    hull, plane, corners = light.hull(), light.plane(), (g.a, g.b, g.c)
    deep = np.max([dot(lens.look, corner - lens.origin) for corner in corners], axis=0)
    normal = unit(g.normal)
    over = dot(normal[:, :, None], hull[:, None] - g.a[:, :, None])
    over = np.where(dot(normal, lens.origin - g.a) > 0, over.T, -over.T)
    gap = np.maximum(np.minimum.reduce(corners) - hull.max(axis=1)[:, None], 0)
    gap = np.maximum(gap, hull.min(axis=1)[:, None] - np.maximum.reduce(corners))
    distance = np.maximum(np.sqrt(dot(gap, gap)), over.min(axis=0))
    row, bend = regions.pencil.planes.nearness, np.zeros(deep.size)
    for step in _steps(regions):
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


def _poles(regions: Regions, light: Light, x: Floats, y: Floats, surface: Ints, lit: bool = True) -> Poles:
    """The branch points nearest to image points (n,) of faces, of all straight lines between corners of the light.

    Of each line the place that is nearest to the point stands for all: radii are up to 4 % too large.

    Parameters
    ----------
    lit : bool
        Whether only what is before the light has any.
    """
    lens, steps = regions.lens, _steps(regions)
    row = regions.pencil.planes.nearness[:, regions.faces.triangle[surface]]
    d, slopes = lens.directions(x, y), [dot(row, step) for step in steps]
    s = dot(row, d)
    s = np.where(s == 0, TINY, s)
    position, hull, plane = d / s, light.hull() - lens.origin, light.plane()
    radius, found = np.full(x.size, np.inf), np.zeros((6, x.size))
    for i, j in list(combinations(range(hull.shape[1]), 2)) or [(0, 0)]:
        start, along = hull[:, [i]], hull[:, [j]] - hull[:, [i]]
        t = np.clip(dot(position - start, along) / max(float(dot(along, along)[0]), TINY), 0, 1)
        q = start + t * along
        a = d - s * q
        b, c = (step - slope * q for step, slope in zip(steps, slopes, strict=True))
        bb, bc, cc = dot(b, b), dot(b, c), dot(c, c)
        most = (bb + cc) / 2 + np.hypot((bb - cc) / 2, bc)
        angle = np.arctan2(2 * bc, bb - cc) / 2
        ways = np.stack((np.cos(angle), np.sin(angle)))
        square = dot(a, a) / most
        real = -dot(a, ways[0] * b + ways[1] * c) / most
        imaginary = np.sqrt(np.maximum(square - real**2, 0.0))
        one = np.stack((*ways, real, imaginary, np.sqrt(most / bb), np.sqrt(most / cc)))
        closer = square < radius**2
        radius = np.where(closer, np.sqrt(square), radius)
        found = np.where(closer, one, found)
    if lit and plane is not None:
        radius = np.where(dot(plane[0], position + lens.origin - plane[1]) > 0, radius, np.inf)
    return Poles(radius, found[:2], found[2], found[3], found[4:])
