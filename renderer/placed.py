"""What other programs place by a matrix, as ours: meshes, balls, flat lights, cameras."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .errors import InputError
from .lights import DiskLight, QuadLight, SphereLight
from .scene import Camera
from .surfaces import Ellipsoid, Material, has_area
from .validation import Vec3, triple
from .vectors import Floats, Ints

ROUND = 1e-6
"""Relative difference of the axes of what is round."""
Faces = NDArray[np.int64]


def moved(matrix: Floats, points: Floats) -> Floats:
    """Points (3, n) under an affine matrix (4, 4)."""
    return np.asarray(matrix[:3, :3] @ points + matrix[:3, 3:])


def outside_out(faces: Ints, matrix: Floats, inside_out: bool = False) -> Faces:
    """Triangles whose outside stays outside under a matrix, where it mirrors too; or goes inside."""
    mirrored = bool(np.linalg.det(matrix[:3, :3]) < 0)
    return (faces[::-1] if mirrored != inside_out else faces).astype(np.int64)


def placed(vertices: Floats, faces: Faces, matrix: Floats, inside_out: bool = False) -> tuple[Floats, Faces]:
    """Triangles under a matrix, see `outside_out`. Those without area are left out."""
    world, turned = moved(matrix, vertices), outside_out(faces, matrix, inside_out)
    return world, turned[:, has_area(*(world[:, k] for k in turned))]


def is_round(matrix: Floats) -> bool:
    """Whether a matrix turns, moves, mirrors and scales alike in all directions, and no more."""
    axes = matrix[:3, :3]
    square = float((axes**2).sum()) / 3
    return bool(square > 0 and np.abs(axes.T @ axes - square * np.eye(3)).max() <= ROUND * square)


def ball(matrix: Floats, radius: float, material: Material) -> Ellipsoid:
    """A sphere about the origin under a matrix."""
    a, b, c = (triple(row) for row in matrix[:3, :3] * radius)
    found = Ellipsoid(triple(matrix[:3, 3]), (a, b, c), material)
    return Ellipsoid.sphere(found.center, found.radius, material) if found.radius is not None else found


def ball_light(matrix: Floats, radius: float, radiance: Vec3) -> SphereLight:
    """A ball that shines, about the origin under a matrix that keeps it round."""
    if not is_round(matrix):
        raise InputError("transform", "one that stretches a shining sphere", "one that turns, moves or scales it")
    return SphereLight(triple(matrix[:3, 3]), radius * abs(float(np.linalg.det(matrix[:3, :3]))) ** (1 / 3), radiance)


def facing(matrix: Floats, normal: tuple[float, float, float]) -> Floats:
    """Where a plane's side faces under a matrix, mirrored or not."""
    return np.asarray(np.linalg.inv(matrix[:3, :3]).T @ np.array(normal))


def rectangle_light(
    matrix: Floats, low: tuple[float, float], high: tuple[float, float], radiance: Vec3, side: float = -1.0
) -> QuadLight:
    """A rectangle of the xy plane that shines along ``side`` times z, under any affine matrix."""
    corner = moved(matrix, np.array([[low[0]], [low[1]], [0.0]]))[:, 0]
    ab, ac = (high[0] - low[0]) * matrix[:3, 0], (high[1] - low[1]) * matrix[:3, 1]
    if np.cross(ab, ac) @ facing(matrix, (0.0, 0.0, side)) > 0:  # ours shines along -(ab x ac)
        ab, ac = ac, ab
    return QuadLight(triple(corner), triple(ab), triple(ac), radiance)


def disk_scale(matrix: Floats) -> float | None:
    """By how much a matrix scales a disk of the xy plane; None where it makes an ellipse of it."""
    x, y = matrix[:3, 0], matrix[:3, 1]
    size = math.hypot(*x)
    return None if abs(math.hypot(*y) / size - 1) > ROUND or abs(x @ y) > ROUND * size**2 else size


def disk_light(matrix: Floats, radius: float, normal: tuple[float, float, float], radiance: Vec3) -> DiskLight:
    """A disk of the xy plane that shines along a normal, under a matrix that keeps it round."""
    size = disk_scale(matrix)
    if size is None:
        raise InputError("transform", "one that makes an ellipse of a disk", "one that keeps it round")
    return DiskLight(triple(matrix[:3, 3]), triple(facing(matrix, normal)), radius * size, radiance)


def is_sheared(matrix: Floats) -> bool:
    """Whether the axes of a matrix, however long each, are not at right angles."""
    axes = matrix[:3, :3] / np.sqrt((matrix[:3, :3] ** 2).sum(axis=0))
    return bool(np.abs(axes.T @ axes - np.eye(3)).max() > ROUND)


def looking(matrix: Floats, fov_y: float, forward: float) -> Camera:
    """A camera that looks along forward times the z axis of a matrix, its y axis up."""
    axes = matrix[:3, :3] / np.sqrt((matrix[:3, :3] ** 2).sum(axis=0))
    if is_sheared(matrix):
        raise InputError("camera transform", "a sheared one", "one that turns, moves or scales")
    origin = matrix[:3, 3]
    return Camera(triple(origin), triple(origin + forward * axes[:, 2]), triple(axes[:, 1]), fov_y)
