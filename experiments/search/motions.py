"""Similarities of space, and scenes carried along: the image stays, mirrored ones with their columns turned."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from nusselt.renderer.lights import Light, QuadLight
from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.surfaces import Ellipsoid, Mesh
from nusselt.renderer.validation import Vec3
from nusselt.renderer.vectors import Floats, transform

PLACES = ("corner", "position", "center", "a", "b", "c")
STEPS = ("ab", "ac", "direction", "normal")
TURNS = (("ab", "ac"), ("b", "c"))
"""Numbers of lights that are points; that are differences; that a mirror exchanges, to keep the bright side."""


@dataclass(frozen=True, eq=False)
class Motion:
    """p -> matrix p + shift.

    Parameters
    ----------
    matrix : (3, 3) float64
        A scale times an orthogonal matrix.
    shift : (3,) float64
    """

    matrix: Floats
    shift: Floats

    @classmethod
    def still(cls) -> Motion:
        return cls(np.eye(3), np.zeros(3))

    @classmethod
    def scaling(cls, factor: float) -> Motion:
        return cls(np.eye(3) * factor, np.zeros(3))

    @classmethod
    def step(cls, shift: Any) -> Motion:
        return cls(np.eye(3), np.asarray(shift, dtype=float))

    @property
    def mirrors(self) -> bool:
        return bool(np.linalg.det(self.matrix) < 0)

    @property
    def scale(self) -> float:
        """Length of an image of a unit vector."""
        return float(np.sqrt((self.matrix[:, 0] ** 2).sum()))

    @property
    def rounds(self) -> bool:
        """Whether the matrix may round a coordinate: not where each row is one power of two."""
        used = self.matrix[self.matrix != 0]
        return bool(used.size != 3 or (np.frexp(np.abs(used))[0] != 0.5).any())

    def points(self, p: Floats) -> Floats:
        """Images of (3, n)."""
        return transform(self.matrix, p) + self.shift[:, None]

    def steps(self, v: Floats) -> Floats:
        """Images of differences (3, n)."""
        return transform(self.matrix, v)

    def directions(self, v: Floats) -> Floats:
        """Images of unit vectors (3, n)."""
        return transform(self.matrix / self.scale, v)


def turn(rng: np.random.Generator, most: float = np.pi) -> Motion:
    """A rotation about a random axis, by at most an angle in radians; uniform over all if that is pi."""
    q = np.append(rng.normal(size=3), 0.0)
    q /= np.sqrt((q**2).sum())
    if most < np.pi:
        angle = most * rng.uniform(0.5, 1.0)
        q = np.append(q[:3] * np.sin(angle / 2), np.cos(angle / 2))
    else:
        q = rng.normal(size=4)
        q /= np.sqrt((q**2).sum())
    x, y, z, w = q
    matrix = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return Motion(np.array(matrix), np.zeros(3))


def carried(scene: Scene, motion: Motion) -> Scene:
    """The scene's image: windings and the lights' emitting sides are kept, and so is every radiance."""

    def at(p: Any) -> Any:
        return tuple(motion.points(np.array(p, dtype=float)[:, None])[:, 0].tolist())

    def along(v: Any) -> Any:
        return tuple(motion.steps(np.array(v, dtype=float)[:, None])[:, 0].tolist())

    def lit(light: Light) -> Light:
        """By the names of its numbers: they mean the same in every kind."""
        ways: dict[str, Any] = {
            **dict.fromkeys(PLACES, at),
            **dict.fromkeys(STEPS, along),
            "radius": lambda radius: radius * motion.scale,
            "intensity": lambda rgb: tuple(channel * motion.scale**2 for channel in rgb),
        }
        held = {entry.name: getattr(light, entry.name) for entry in fields(light)}  # type: ignore[arg-type]
        moved = {name: ways[name](value) if name in ways else value for name, value in held.items()}
        for one, other in TURNS if motion.mirrors else ():
            if one in moved and other in moved:
                moved[one], moved[other] = moved[other], moved[one]
        return type(light)(**moved)

    def surface(mesh: Mesh) -> Mesh:
        triangles = mesh.triangles[::-1] if motion.mirrors else mesh.triangles
        return Mesh(motion.points(mesh.vertices), triangles, mesh.material)

    def body(one: Ellipsoid) -> Ellipsoid:
        axes = motion.steps(np.array(one.axes))
        return replace(one, center=at(one.center), axes=rows(axes))

    camera = scene.camera
    return scene.with_(
        camera=Camera(at(camera.position), at(camera.target), along(camera.up), camera.fov_y),
        meshes=tuple(surface(mesh) for mesh in scene.meshes),
        ellipsoids=tuple(body(one) for one in scene.ellipsoids),
        lights=tuple(lit(light) for light in scene.lights),
    )


def rows(matrix: Floats) -> tuple[Vec3, Vec3, Vec3]:
    """A 3 x 3 matrix as an ellipsoid's axes are given."""
    a, b, c = ((float(x), float(y), float(z)) for x, y, z in matrix)
    return a, b, c


def rounding(a: Floats, b: Floats) -> Floats:
    """What a + b loses (Knuth's two-sum): 0 where the sum is exact."""
    total = a + b
    part = total - a
    return (a - (total - part)) + (b - part)


def places(scene: Scene) -> Floats:
    """Every vertex, centre and light corner, (3, n)."""
    found = [np.zeros((3, 0)), *(mesh.vertices for mesh in scene.meshes)]
    found += [np.array(one.center, dtype=float)[:, None] for one in scene.ellipsoids]
    found += [corners(light) for light in scene.quad_lights]
    found += [v.anchored() for v in scene.lights if v.parallelogram() is None]
    return np.hstack(found)


def corners(light: QuadLight) -> Floats:
    """(3, 4)."""
    corner, ab, ac = (np.array(v) for v in (light.corner, light.ab, light.ac))
    return np.stack((corner, corner + ab, corner + ab + ac, corner + ac), axis=1)


def corners_exact(light: QuadLight) -> bool:
    """Whether the sums that make the light's corners lose nothing."""
    corner, ab, ac = (np.array(v) for v in (light.corner, light.ab, light.ac))
    lost = [rounding(corner, ab), rounding(corner, ac), rounding(corner + ab, ac), rounding(corner + ac, ab)]
    return not np.any(lost)
