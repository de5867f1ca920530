"""Small scenes the tests share."""

from __future__ import annotations

import numpy as np

from nusselt.experiments.scenes import shapes
from nusselt.renderer.geometry.arrays import Geometry, build_geometry
from nusselt.renderer.lights import Light, QuadLight
from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.surfaces import Ellipsoid, Material, Mesh

CAMERA = Camera((0.0, 3.0, 6.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 40.0)
GREY = Material((0.5, 0.5, 0.5))


def quad(a, b, c, d, material: Material = GREY) -> Mesh:
    """Two triangles a b c and a c d, their front where they are counter-clockwise."""
    return shapes.sheet(a, b, c, d, material)


def floor(half: float = 2.0, y: float = 0.0, material: Material = GREY) -> Mesh:
    """A square that faces +y."""
    return shapes.plate((-half, half), (-half, half), y, material)


def box(low, high, material: Material = GREY) -> Mesh:
    """A closed box, faces outwards."""
    return shapes.box(low, high, material)


def lamp(y: float = 2.0, half: float = 0.5, radiance=(5.0, 5.0, 5.0)) -> QuadLight:
    """A square light that shines down: -(ab x ac) is -y."""
    return shapes.lamp((-half, half), (-half, half), y, radiance)


def scene(
    *meshes: Mesh,
    lights: tuple[Light, ...] = (),
    ellipsoids: tuple[Ellipsoid, ...] = (),
    size: tuple[int, int] = (32, 24),
    camera: Camera = CAMERA,
    **options,
) -> Scene:
    """A scene of these things, seen from above."""
    return Scene(*size, camera, meshes, ellipsoids, lights, **options)


def geometry(*meshes: Mesh, lights: tuple[Light, ...] = (), ellipsoids: tuple[Ellipsoid, ...] = ()) -> Geometry:
    """The arrays of such a scene."""
    return build_geometry(scene(*meshes, lights=lights, ellipsoids=ellipsoids))


def sphere_mesh(rings: int = 12, radius: float = 1.0) -> Mesh:
    """A closed triangle mesh around the origin, without degenerate triangles."""
    theta = np.pi * np.arange(1, rings) / rings
    phi = 2 * np.pi * np.arange(2 * rings) / (2 * rings)
    ring = np.stack(
        [
            np.outer(np.sin(theta), np.cos(phi)),
            np.outer(np.sin(theta), np.sin(phi)),
            np.outer(np.cos(theta), np.ones(phi.size)),
        ]
    ).reshape(3, -1)
    vertices = radius * np.hstack((ring, [[0, 0], [0, 0], [1, -1]]))
    top, bottom, m = ring.shape[1], ring.shape[1] + 1, phi.size
    triangles = []
    for k in range(m):
        n = (k + 1) % m
        triangles.append((top, k, n))
        triangles.append((bottom, (rings - 2) * m + n, (rings - 2) * m + k))
        for r in range(rings - 2):
            a, b, c, d = r * m + k, r * m + n, (r + 1) * m + k, (r + 1) * m + n
            triangles += [(a, c, d), (a, d, b)]
    return Mesh(vertices, np.array(triangles).T, GREY)
