"""The most that one light sample can bring to a pixel: what rare events are bounded by where none were seen."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np
from scipy import ndimage

from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.camera.view import View, look
from nusselt.renderer.estimators.protocol import BLOCK
from nusselt.renderer.lights import QuadLight, TriangleLight, colour
from nusselt.renderer.needs import Source
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene
from nusselt.renderer.shading import reflect
from nusselt.renderer.vectors import Floats, cross, dot, unit

NODES, AROUND = np.linspace(0, 1, 3), np.linspace(0, 1, 9)
"""Of a grid of light points, whose brightest is refined once; of a light that shines from all around."""
EDGES = (
    ((0, 0, 1, 0), (0, 1, 1, 0), (0, 0, 0, 1), (1, 0, 0, 1)),
    ((0, 0, 1, 0), (0, 0, 0, 1), (1, 0, -1, 1)),
)
"""Of a parallelogram and of a triangle: where they start and how they go, in multiples of the light's own two."""
TINY = 1e-300
STEPS = 12
"""To the peak of a product; what is doubled need not be exact."""
PIXELS = 1 << 16
"""Of larger images as many are looked at, and their neighbours take the largest."""


@lru_cache(maxsize=8)
def sample_ceilings(scene: Scene, solid: bool = False) -> Floats:
    """The largest radiance, channels averaged, that one sample of each light can bring to each pixel.

    Of its area, or, where ``solid``, of its solid angle.

    Found on a grid over the light, its border included, refined about its brightest point, and where a lobe points at a
    parallelogram, and doubled: of other lights a lobe narrower than a quarter of them is missed. Where a
    pixel is its box, a sample may also meet what its neighbours show.

    Returns
    -------
    (l, h, w) float64
        0 for a light without extent, or one that lights nothing. Read-only.
    """
    scene, geometry, needs = prepare(scene)
    step = math.ceil(math.sqrt(scene.width * scene.height / PIXELS))
    columns, rows = np.arange(0, scene.width, step) + 0.5, np.arange(0, scene.height, step) + 0.5
    out = np.zeros((1 + len(scene.lights), rows.size, columns.size))  # the first: what is seen
    block = max(1, BLOCK // (NODES.size**2 * columns.size))
    for start in range(0, rows.size, block):
        these = slice(start, start + block)
        x, y = (grid.ravel() for grid in np.meshgrid(columns, rows[these]))
        view = look(scene, geometry, x, y)
        out[0, these] = view.emission.mean(axis=0).reshape(-1, columns.size)
        for source in needs.sources:
            if source.has_extent and view.lit.size:
                out[1 + source.index, these] = _brightest(view, source, solid).reshape(-1, columns.size)
    if scene.spp > 1:
        out = np.maximum(out, out[:1])
    if step > 1 or scene.spp > 1:
        out = ndimage.maximum_filter(out, (1, 3, 3))
    whole = np.repeat(np.repeat(out[1:], step, axis=1), step, axis=2)[:, : scene.height, : scene.width]
    whole.setflags(write=False)
    return whole


def grain_of_reference(ceilings: Floats, reference: Reference) -> Floats:
    """The most (h, w) that one sample of a reference brings to the mean of each pixel."""
    samples = np.maximum(reference.light_samples or (reference.samples,), 1)
    return np.asarray((ceilings / np.reshape(samples, (-1, 1, 1))).max(axis=0, initial=0.0))


def _brightest(view: View, source: Source, solid: bool) -> Floats:
    """Of the pixels of a view, (n,): twice the brightest light point, nothing in its way."""
    nodes = AROUND if source.light.surrounds else NODES
    u, v = (grid.reshape(1, -1) for grid in np.meshgrid(nodes, nodes))
    first = _alone(view, source, solid, u, v)
    best = first.argmax(axis=1)
    near = [np.clip(node[0, best][:, None] + (node - 0.5) / (nodes.size - 1), 0, 1) for node in (u, v)]
    brightest = np.maximum(first.max(axis=1), _alone(view, source, solid, *near).max(axis=1))
    if isinstance(source.light, QuadLight | TriangleLight) and not solid:
        with np.errstate(all="ignore"):  # of places in the light's plane, rays beside it, edges that point at them
            peaks = _peaks(view, source.light, source.glossy)
        brightest = np.maximum(brightest, _alone(view, source, solid, *peaks).max(axis=1))
    out = np.zeros(view.background.size)
    out[view.lit] = 2 * brightest
    return out


def _peaks(view: View, light: QuadLight | TriangleLight, glossy: bool) -> tuple[Floats, Floats]:
    """Places (n, k) of a flat light, twice, where what it brings may be largest: in its plane, and on each edge."""
    at, ab, ac = light.columns
    at = at - view.points.position
    found = [_within(place - at, ab, ac) for place in _in_plane(view, cross(ab, ac), at, glossy)]
    for s, t, ds, dt in EDGES[isinstance(light, TriangleLight)]:
        ways = _on_edge(view, at + s * ab + t * ac, ds * ab + dt * ac, glossy)
        found += [(s + x * ds, t + x * dt) for x in (np.clip(np.nan_to_num(way), 0, 1) for way in ways)]
    s, t = (np.clip(np.nan_to_num(np.stack(one, axis=1)), 0, 1) for one in zip(*found, strict=True))
    if isinstance(light, QuadLight):
        return s, t
    return 1 - (1 - t) ** 2, np.clip(s / np.maximum(1 - t, TINY), 0, 1)


def _within(step: Floats, ab: Floats, ac: Floats) -> tuple[Floats, Floats]:
    """What multiples of two edges a step in their plane is, (n,) each."""
    normal = cross(ab, ac)
    size = dot(normal, normal)
    return dot(cross(step, ac), normal) / size, dot(cross(ab, step), normal) / size


def _in_plane(view: View, normal: Floats, at: Floats, glossy: bool) -> list[Floats]:
    """Ways (3, n) to where a plane is brightest by Lambert's cosine, n.d, and by a lobe with it, n.d (m.d)^s."""
    n, m, s = view.points.normal, view.points.mirror, view.points.shininess
    facing = normal * np.copysign(1 / np.sqrt(dot(normal, normal)), dot(at, normal))
    found = [_peak(facing, 3.0, n, 1.0)]
    if glossy:
        start = unit(_peak(unit(found[0]), 4.0, m, s))
        start = np.where((dot(start, facing) > 0) & (dot(start, n) > 0), start, facing + m)
        found.append(_peak_of([(facing, 3.0), (n, 1.0), (m, s)], start))
    return [way * (dot(at, normal) / dot(way, normal)) for way in found]


def _peak(a: Floats, j: float, b: Floats, k: Floats | float) -> Floats:
    """Way to where (a.w)^j (b.w)^k is largest, of unit vectors: between them, k tan = j tan of the angles to both."""
    cosine = dot(a, b)
    both = (j + k) * cosine
    return np.asarray(a + 2 * k / (both + np.sqrt(both**2 + 4 * j * k * (1 - cosine**2))) * (b - cosine * a))


def _peak_of(powers: list[tuple[Floats, Any]], w: Floats) -> Floats:
    """Way (3, n) to where a product of (c.w)^k is largest, by damped steps of Newton's from one where none is 0.

    It is where |w|^2 / 2 times all k, less the sum of k ln(c.w), is least, a convex function that keeps them above 0.
    """
    every = sum(k for _, k in powers)
    for _ in range(STEPS):
        ways = [(c / dot(c, w), k) for c, k in powers]
        slope = every * w - sum(k * c for c, k in ways)
        bend = np.einsum("n,ij->nij", every + 0 * w[0], np.eye(3))
        bend = bend + sum(np.einsum("in,jn->nij", k * c, c) for c, k in ways)
        step = np.linalg.solve(bend, slope.T[..., None])[..., 0].T
        w = w - step / (1 + np.sqrt(np.maximum(dot(step, slope), 0.0)))
    return w


def _on_edge(view: View, start: Floats, along: Floats, glossy: bool) -> list[Floats]:
    """Shares (n,) of an edge: where (n.d) / d^4 is largest or least, and (m.d)^s / d^(s + 3)."""
    points = view.points
    ways: list[tuple[Floats, Any]] = [(points.normal, 1.0), (points.mirror, points.shininess)][: 1 + glossy]
    aa, ab, bb = dot(start, start), dot(start, along), dot(along, along)
    found = []
    for way, k in ways:
        wa, wb = dot(way, start), dot(way, along)
        half, last = ((k + 3) * bb * wa - (k - 3) * ab * wb) / 2, (k + 3) * ab * wa - k * aa * wb
        root = -(half + np.copysign(np.sqrt(np.maximum(half**2 - 3 * wb * bb * last, 0)), half))
        found += [root / (3 * wb * bb), last / root]
    return found


def _alone(view: View, source: Source, solid: bool, u: Floats, v: Floats) -> Floats:
    """Radiance (n, k) that single samples at places of the light bring."""
    points, k = view.points, u.shape[1]
    beams = source.light.solid_beams if solid else source.light.beams
    d, weight = beams(points.position, u, v)
    each = points.take(np.repeat(np.arange(points.count), k))
    radiance = reflect(each, d.reshape(3, -1, 1), (weight * k).reshape(-1, 1), source.glossy) * colour(source.light)
    return np.asarray(radiance.mean(axis=0).reshape(points.count, k))
