"""Primary rays of the course's pinhole camera."""

from __future__ import annotations

import math

import numpy as np

from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats, column, cross, unit


def view_frame(scene: Scene) -> tuple[Floats, Floats, Floats]:
    """look, right and up such that a pixel's ray is look + x right + y up, x and y in [-1, 1].

    ``right`` and ``up`` carry tan(fov/2), and ``right`` the aspect ratio w/h. y grows upwards.

    Returns
    -------
    look, right, up : (3, 1) float64
    """
    camera = scene.camera
    look = unit(column(camera.target) - column(camera.position))
    right = unit(cross(look, unit(column(camera.up))))
    up = cross(right, look)
    half_height = math.tan(math.radians(camera.fov_y) / 2)
    return look, right * (half_height * scene.width / scene.height), up * half_height


def primary_directions(scene: Scene, x: Floats, y: Floats) -> Floats:
    """Directions through image points, not normalised: affine in (x, y).

    Parameters
    ----------
    x, y : (n,) float64
        Position in pixels, y down; (0.5, 0.5) is the centre of the top left pixel.

    Returns
    -------
    (3, n) float64
    """
    look, right, up = view_frame(scene)
    return look + (2 * x / scene.width - 1) * right + (1 - 2 * y / scene.height) * up


def pixel_corners(scene: Scene) -> Floats:
    """Directions (3, 3) through three corners of the first pixel: its own, the one across, the one below."""
    return primary_directions(scene, np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]))


def pixel_size(scene: Scene) -> float:
    """Height of a pixel in the plane at distance one from the camera (dimensionless)."""
    return 2 * math.tan(math.radians(scene.camera.fov_y) / 2) / scene.height


def pixel_centres(columns: range, rows: range) -> tuple[Floats, Floats]:
    """Centres of a block of pixels, row by row, each (n,)."""
    y, x = np.meshgrid(np.array(rows) + 0.5, np.array(columns) + 0.5, indexing="ij")
    return x.ravel(), y.ravel()
