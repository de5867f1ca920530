"""Other ways to say a scene, or to render it: each must give the same light at the same points of the surfaces.

A twin is exact where every number of it is: it is then held to the bounds that are claimed and nothing else. Where it
had to round, it is another scene by that rounding (see `sensitivity`).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from nusselt.experiments.scenes.shapes import box
from nusselt.renderer.lights import Light, QuadLight
from nusselt.renderer.scene import Scene
from nusselt.renderer.surfaces import Material, Mesh
from nusselt.renderer.vectors import Floats, dot

from .colours import recoloured
from .motions import Motion, carried, corners_exact, places, rounding, turn


@dataclass(frozen=True, eq=False)
class Copy:
    """What a scene became.

    Parameters
    ----------
    scene : Scene
    motion : Motion
        Where its points went.
    factor : float
        Its radiance over the first scene's.
    exact : bool
        Whether its numbers stand for the same scene to the last digit.
    everything, shortcuts : bool
        How it is to be rendered.
    of : tuple of int, optional
        Of which of the first scene's lights each of its own is a part; None: they are the same ones.
    """

    scene: Scene
    motion: Motion = field(default_factory=Motion.still)
    factor: float = 1.0
    exact: bool = True
    everything: bool = False
    shortcuts: bool = True
    of: tuple[int, ...] | None = None

    @property
    def parents(self) -> tuple[int, ...]:
        return tuple(range(len(self.scene.lights))) if self.of is None else self.of


Make = Callable[[Scene, np.random.Generator], Copy | None]


@dataclass(frozen=True)
class Twin:
    """A name, and a function of scene and chance; None where the scene has no such twin."""

    name: str
    make: Make


def _carried(scene: Scene, motion: Motion) -> Copy:
    return Copy(carried(scene, motion), motion, exact=not motion.rounds)


def _turned(scene: Scene, rng: np.random.Generator) -> Copy:
    return _carried(scene, turn(rng))


def _nearly_turned(scene: Scene, rng: np.random.Generator) -> Copy:
    """Every tie becomes a near tie."""
    return _carried(scene, turn(rng, float(10.0 ** rng.uniform(-15, -4))))


def _doubled_size(scene: Scene, rng: np.random.Generator) -> Copy:
    return _carried(scene, Motion.scaling(2.0 ** int(rng.integers(-20, 21))))


def _scaled(scene: Scene, rng: np.random.Generator) -> Copy:
    return _carried(scene, Motion.scaling(float(10.0 ** rng.uniform(-6, 6))))


def _moved(scene: Scene, rng: np.random.Generator) -> Copy:
    size = 10.0 ** rng.uniform(0, 6)
    shift = np.round(rng.uniform(-size, size, 3))
    copy = carried(scene, Motion.step(shift))
    exact = not np.any(rounding(places(scene), shift[:, None]))
    exact &= all(corners_exact(light) for light in (*scene.quad_lights, *copy.quad_lights))
    return Copy(copy, Motion.step(shift), exact=exact)


def _mirrored(scene: Scene, rng: np.random.Generator) -> Copy:
    signs = np.ones(3)
    signs[int(rng.integers(3))] = -1
    return _carried(scene, Motion(np.diag(signs), np.zeros(3)))


def _axes(scene: Scene, rng: np.random.Generator) -> Copy:
    """Other names for the axes, other signs."""
    matrix = np.eye(3)[rng.permutation(3)] * rng.choice([-1.0, 1.0], 3)
    return _carried(scene, Motion(matrix, np.zeros(3)))


def _shuffled(scene: Scene, rng: np.random.Generator) -> Copy:
    """Objects in another order, and each one's triangles and vertices."""

    def mixed(mesh: Mesh) -> Mesh:
        order = rng.permutation(mesh.vertices.shape[1])
        triangles = np.argsort(order)[mesh.triangles][:, rng.permutation(mesh.triangles.shape[1])]
        return Mesh(mesh.vertices[:, order], triangles, mesh.material)

    meshes = tuple(mixed(scene.meshes[k]) for k in rng.permutation(len(scene.meshes)))
    ellipsoids = tuple(scene.ellipsoids[k] for k in rng.permutation(len(scene.ellipsoids)))
    return Copy(scene.with_(meshes=meshes, ellipsoids=ellipsoids))


def _corners_turned(scene: Scene, rng: np.random.Generator) -> Copy:
    """Every triangle begins with another of its corners."""

    def turned(mesh: Mesh) -> Mesh:
        start = rng.integers(3, size=mesh.triangles.shape[1])
        rows = (np.arange(3)[:, None] + start) % 3
        return Mesh(mesh.vertices, np.take_along_axis(mesh.triangles, rows, axis=0), mesh.material)

    return Copy(scene.with_(meshes=tuple(map(turned, scene.meshes))))


def _apart(scene: Scene, rng: np.random.Generator) -> Copy:
    """No two triangles share a vertex."""

    def loose(mesh: Mesh) -> Mesh:
        count = mesh.triangles.shape[1]
        return Mesh(mesh.vertices[:, mesh.triangles.T.ravel()], np.arange(3 * count).reshape(count, 3).T, mesh.material)

    return Copy(scene.with_(meshes=tuple(map(loose, scene.meshes))))


def _subdivided(scene: Scene, rng: np.random.Generator) -> Copy:
    """Every triangle of some meshes, or one triangle of them, in four at the midpoints."""
    one, exact, meshes = rng.random() < 0.3, True, []
    for mesh in scene.meshes:
        if rng.random() < 0.3:
            meshes.append(mesh)
            continue
        k = np.arange(mesh.triangles.shape[1])
        chosen = rng.permutation(k)[:1] if one else k
        a, b, c = (mesh.vertices[:, mesh.triangles[i][chosen]] for i in range(3))
        exact &= not np.any([rounding(a, b), rounding(b, c), rounding(c, a)])
        ab, bc, ca = a / 2 + b / 2, b / 2 + c / 2, c / 2 + a / 2
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        kept = mesh.triangles[:, np.setdiff1d(k, chosen)]
        whole = [mesh.vertices[:, kept[i]] for i in range(3)]
        corners = [np.hstack([whole[i], *(part[i] for part in parts)]) for i in range(3)]
        vertices, index = np.unique(np.hstack(corners), axis=1, return_inverse=True)
        meshes.append(Mesh(vertices, index.reshape(3, -1), mesh.material))
    return Copy(scene.with_(meshes=tuple(meshes)), exact=exact)


def _split(light: Light, ab: bool) -> tuple[Light, ...]:
    """Two halves across one edge; a light without extent as it is."""
    quad = light.parallelogram()
    if quad is None:
        return (light,)
    edge, corner = np.array(quad.ab if ab else quad.ac) / 2, np.array(quad.corner)
    half = replace(quad, **{"ab" if ab else "ac": tuple(edge)})
    return half, replace(half, corner=tuple(corner + edge))


def _lights_cut(scene: Scene, rng: np.random.Generator, times: int) -> Copy | None:
    pieces = list(enumerate(scene.lights))
    if not scene.quad_lights:
        return None
    first, exact = bool(rng.random() < 0.5), all(corners_exact(light) for light in scene.quad_lights)
    for time in range(times):
        pieces = [(k, half) for k, light in pieces for half in _split(light, first ^ bool(time))]
    exact &= all(corners_exact(quad) for quad in (light.parallelogram() for _, light in pieces) if quad is not None)
    lights, of = tuple(light for _, light in pieces), tuple(k for k, _ in pieces)
    return Copy(scene.with_(lights=lights), exact=exact, of=of)


def _halves(scene: Scene, rng: np.random.Generator) -> Copy | None:
    return _lights_cut(scene, rng, 1)


def _quarters(scene: Scene, rng: np.random.Generator) -> Copy | None:
    return _lights_cut(scene, rng, 2)


def _lights_shuffled(scene: Scene, rng: np.random.Generator) -> Copy | None:
    if len(scene.lights) < 2:
        return None
    return Copy(scene.with_(lights=scene.lights[::-1]), of=tuple(range(len(scene.lights)))[::-1])


def _light_corner(scene: Scene, rng: np.random.Generator) -> Copy | None:
    """Each light from its next corner: the same parallelogram, shining to the same side."""

    def from_next(light: QuadLight) -> QuadLight:
        ab, ac, corner = (np.array(v) for v in (light.ab, light.ac, light.corner))
        return QuadLight(tuple(corner + ab), tuple(ac), tuple(-ab), light.radiance)

    if not scene.quad_lights:
        return None
    quads = [(light, light.parallelogram()) for light in scene.lights]
    lights = tuple(light if quad is None else from_next(quad) for light, quad in quads)
    copy = scene.with_(lights=lights)
    exact = all(corners_exact(light) for light in (*scene.quad_lights, *copy.quad_lights))
    return Copy(copy, exact=exact)


def _far_thing(scene: Scene, rng: np.random.Generator) -> Copy | None:
    """A box outside the hull of everything, the camera among it, behind which no light is and no line of sight ends."""
    low, high = extent(scene)
    size = (high - low).max()
    ahead = np.array(scene.camera.target) - np.array(scene.camera.position)
    far = [light.hull() for light in scene.lights if light.at_infinity]
    signs = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))[rng.permutation(8)]
    for sign in signs:
        near = np.where(sign > 0, high, low) + sign * size * rng.uniform(0.5, 1.5, 3)
        corners = np.array(list(itertools.product(*zip(near, near + sign * size / 2, strict=True)))).T
        seen = (dot(ahead[:, None], corners - np.array(scene.camera.position)[:, None]) >= 0).any()
        # The hull, drawn out towards a light, stays on its side of one of the box's faces.
        if not seen and all((sign[:, None] * way <= 0).all(axis=1).any() for way in far):
            thing = box(tuple(corners.min(axis=1)), tuple(corners.max(axis=1)), Material((0.5, 0.5, 0.5)))
            return Copy(scene.with_(meshes=(*scene.meshes, thing)))
    return None


def extent(scene: Scene) -> tuple[Floats, Floats]:
    """Lowest and highest coordinates (3,) of everything, the camera among it."""
    everywhere = np.hstack((places(scene), np.array(scene.camera.position)[:, None], _reach(scene)))
    return everywhere.min(axis=1), everywhere.max(axis=1)


def _reach(scene: Scene) -> Floats:
    """Corners of boxes about the ellipsoids, and hulls of lights, (3, n)."""
    found = [np.zeros((3, 0)), *(light.hull() for light in scene.lights if not light.at_infinity)]
    for one in scene.ellipsoids:
        reach = np.sqrt((np.array(one.axes) ** 2).sum(axis=1))
        found.append(np.stack((np.array(one.center) - reach, np.array(one.center) + reach), axis=1))
    return np.hstack(found)


def _brighter(scene: Scene, rng: np.random.Generator) -> Copy:
    """Twice the radiance of everything that shines."""
    return Copy(recoloured(scene, lights=lambda rgb: 2 * rgb, emission=lambda rgb: 2 * rgb), factor=2.0)


def _everything(scene: Scene, rng: np.random.Generator) -> Copy:
    return Copy(scene, everything=True)


def _no_shortcuts(scene: Scene, rng: np.random.Generator) -> Copy:
    return Copy(scene, shortcuts=False)


TWINS: tuple[Twin, ...] = (
    Twin("turned", _turned),
    Twin("nearly turned", _nearly_turned),
    Twin("size times a power of two", _doubled_size),
    Twin("scaled", _scaled),
    Twin("moved by whole numbers", _moved),
    Twin("mirrored", _mirrored),
    Twin("axes renamed", _axes),
    Twin("objects shuffled", _shuffled),
    Twin("triangles from another corner", _corners_turned),
    Twin("no vertex shared", _apart),
    Twin("subdivided", _subdivided),
    Twin("lights in two", _halves),
    Twin("lights in four", _quarters),
    Twin("lights in another order", _lights_shuffled),
    Twin("lights from another corner", _light_corner),
    Twin("a far thing more", _far_thing),
    Twin("twice as bright", _brighter),
    Twin("nothing left out", _everything),
    Twin("no shortcuts", _no_shortcuts),
)
"""All of them, each once."""
